# SPDX-License-Identifier: Apache-2.0
"""marrow new: its files work without changes, and no existing file is lost."""
import os
import subprocess
import unittest

import yaml

from harness import BUILD, MARROW, SOURCE, onnx
from harness.program import Case, main
from harness.sample import sample

KINDS = sorted(path.parent.parent.name for path in (SOURCE / "plugins").glob("*/template/template.yaml"))
PYTHON_KINDS = sorted(path.parent.parent.parent.name for path in (SOURCE / "plugins").glob("*/template/python/node.py"))


ONLY_EDGES = """marrow: 1
extends: pipeline.yaml
outputs: {verdict: null, pose: null, errors: null, overlay: null, edges: edges}
"""


class New(Case):
    plugins = []
    has_own_store = False

    def refused_with(self, *arguments):
        """The one sentence for which nothing is made."""
        before = self.everything()
        said = self.expect(2, "new", *arguments).stderr
        self.assertEqual(self.everything(), before)
        return said.strip().removeprefix("marrow: error: ")

    def run_in(self, folder, *command, code=0, **environment):
        result = subprocess.run(
            [*map(str, command)],
            cwd=self.scratch / folder,
            env={**os.environ, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.assertEqual(result.returncode, code, result.stdout)
        return result.stdout

    def with_one_coarse_case(self, folder):
        """Makes the comparison of a new node shorter."""
        coarse = [("compare.yaml", "seeds: 1..2", "seeds: [1]")]
        if "extends:" not in self.read(folder + "/pipeline.yaml"):
            coarse.append(("pipeline.yaml", "spacing_mm: [1, 1, 1.2]", "spacing_mm: [1.5, 1.5, 1.5]"))
        for name, old, new in coarse:
            text = self.read("%s/%s" % (folder, name))
            self.assertEqual(text.count(old), 1, old)
            self.write("%s/%s" % (folder, name), text.replace(old, new))

    def test_every_kind_with_a_suite_has_a_template(self):
        with_suite = sorted(path.parent.name for path in (SOURCE / "plugins").glob("*/suite.cpp"))
        self.assertEqual(KINDS, with_suite)
        self.assertEqual(PYTHON_KINDS, KINDS)

    def test_nodes_of_kinds_and_a_kind_are_built_against_an_installation_and_tested(self):
        prefix = self.scratch / "installed"
        self.run_in(".", "cmake", "--install", BUILD, "--prefix", prefix)
        program = prefix / "bin" / "marrow"
        for kind in KINDS:
            said = self.run_in(".", program, "new", "node", kind + ".mine")
            self.assertIn("%s_mine/ci builds it, tests it" % kind, said)
        self.run_in(".", program, "new", "kind", "denoised")
        projects = [kind + "_mine" for kind in sample(KINDS, 1)] + ["denoised"]
        # One project for all, so that the packages are looked for once.
        lines = ["cmake_minimum_required(VERSION 3.25)", "project(all CXX)", "enable_testing()"]
        lines += ["add_subdirectory(%s)" % project for project in projects]
        self.write("CMakeLists.txt", "\n".join(lines))
        self.run_in(".", "cmake", "-S", ".", "-B", "build", "-G", "Ninja", "-DCMAKE_PREFIX_PATH=%s" % prefix)
        self.run_in(".", "ninja", "-C", "build")
        said = self.run_in(".", "ctest", "--test-dir", "build", "-j2", "--no-tests=error", "--output-on-failure")
        self.assertIn("100%% tests passed, 0 tests failed out of %d" % (2 * len(projects)), said)
        plugins = {"MARROW_PLUGIN_PATH": ":".join(str(self.scratch / "build" / project) for project in projects)}
        for project in projects:
            self.run_in(project, program, "check", "pipeline.yaml", **plugins)
            self.run_in(project, program, "compare", "compare.yaml", "--dry-run", **plugins)
            self.assertEqual(yaml.safe_load(self.read(project + "/plugin.yaml"))["name"], project)
            self.assertTrue(os.access(self.scratch / project / "ci", os.X_OK))
        self.with_one_coarse_case(projects[0])
        row = self.run_in(projects[0], program, "compare", "compare.yaml", "--out", "compared", **plugins)
        self.assertRegex(row, r"\nmine +1 +0 ")

    @unittest.skipUnless((BUILD / "python" / "marrow" / "nodes.pyi").exists(), "the Python package is not built")
    def test_nodes_in_python_work_without_a_build(self):
        checked = sample(PYTHON_KINDS, 3)
        compared = sample(checked, 1)
        for kind in PYTHON_KINDS:
            with self.subTest(kind):
                said = self.printed("new", "node", kind + ".mine", "--python")
                self.assertIn("%s_mine/ci tests it, and tries it in a pipeline" % kind, said)
                folder = kind + "_mine"
                place = self.scratch / folder
                paths = {"PYTHONPATH": str(BUILD / "python"), "MARROW_PLUGIN_PATH": str(place)}
                self.assertIn("OK", self.run_in(folder, "/usr/bin/python3", "test.py", **paths))
                if kind in checked:
                    self.assertIn(", 0 failed", self.run_in(folder, MARROW, "conformance", kind + ".mine", **paths))
                self.run_in(folder, MARROW, "check", "pipeline.yaml", **paths)
                if kind in compared:
                    self.with_one_coarse_case(folder)
                    row = self.run_in(folder, MARROW, "compare", "compare.yaml", **paths)
                    self.assertRegex(row, r"\nmine +1 +0 +0 +100.0 %", "it takes its place in a whole registration")
                self.assertTrue(os.access(place / "ci", os.X_OK))
                self.assertIn("%s.mine" % kind, self.read(folder + "/ci"))
                self.assertFalse(any(path.suffix in (".cpp", ".txt") for path in place.iterdir()))

    def test_a_node_in_python_says_how_to_find_the_package(self):
        self.expect(0, "new", "node", "edges.mine", "--python")
        # Python without installed packages
        python = self.write("python", '#!/bin/sh\nunset PYTHONPATH\nexec /usr/bin/python3 -S "$@"\n')
        python.chmod(0o755)
        said = self.run_in("edges_mine", "./ci", code=2, MARROW_PYTHON=str(python))
        for line in (
            "python cannot import marrow: install the Debian package python3-marrow, or name",
            "export PYTHONPATH=MARROW/build/python  where marrow was built in MARROW",
            "No module named 'marrow'",
        ):
            self.assertIn(line, said)

    def finds_edges(self, folder):
        """Runs the part of the folder's pipeline that ends with the network's edges, on a coarse femur."""
        self.write(folder + "/edges.yaml", ONLY_EDGES)
        coarse = ["--set", "femur.resolution_mm=3", "--set", "ct.range_mm=[0, 60]"]
        run = ["run", "edges.yaml", "--only", "edges", "--out", "out", *coarse]
        self.expect(0, *run, cwd=self.scratch / folder)
        self.assertTrue(any((self.scratch / folder / "out/outputs/edges").iterdir()))

    def test_a_network_takes_the_place_of_a_node(self):
        said = self.printed("new", "network", "mine")
        self.assertIn("mine/ci trains the network, and tries it in a pipeline", said)
        folder = self.scratch / "mine"
        names = {".gitignore", "README.md", "ci", "mine.yaml", "pipeline.yaml", "train.py"}
        self.assertEqual({path.name for path in folder.iterdir()}, names)
        self.assertFalse(any("@name@" in path.read_text() for path in folder.iterdir()))
        self.assertTrue(os.access(folder / "ci", os.X_OK))
        checked = self.marrow("check", "pipeline.yaml", cwd=folder)
        self.assertIn("mine.onnx", checked.stdout + checked.stderr, "it says that the network is not there yet")
        # As trained: a convolution that is sure of a border everywhere.
        layer, tensors = onnx.convolution("image", "borders", [[[[0.0]]]], [5.0])
        self.write("mine/mine.onnx", onnx.model([layer], tensors, {"borders": (1, 256, 256)}, 256, 256))
        self.expect(0, "check", "pipeline.yaml", cwd=folder)
        self.finds_edges("mine")

    def test_the_training_of_a_new_network(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import torch, onnx"], capture_output=True).returncode:
            self.skipTest("PyTorch is not installed (python3-torch, python3-onnx)")
        self.expect(0, "new", "network", "mine")
        text = self.read("mine/train.py")
        self.assertIn("STEPS, BATCH = 300, 8", text)
        self.write("mine/train.py", text.replace("STEPS, BATCH = 300, 8", "STEPS, BATCH = 5, 2"))
        self.assertIn("wrote mine.onnx", self.run_in("mine", "/usr/bin/python3", "train.py"))
        self.finds_edges("mine")

    def test_a_pipeline_and_an_experiment_work_where_they_are_put(self):
        (self.scratch / "mine").mkdir()
        self.expect(0, "new", "pipeline", "simple")
        self.marrow("check", "simple.yaml")
        for name in ("femur-best", "guidance-closed"):  # one names a failure model, the other a body
            self.expect(0, "new", "pipeline", "copy", "--from", name, "--out", "mine/%s.yaml" % name)
            self.expect(0, "check", "mine/%s.yaml" % name)
        self.expect(0, "new", "experiment", "try", "--from", "edges")
        self.expect(0, "compare", "try.yaml", "--dry-run")

    def test_a_case_says_what_is_still_missing(self):
        self.expect(0, "new", "case", "patient")
        self.refused("ct.mha", "run", SOURCE / "pipelines/femur/femur.yaml", "case=patient", status=1)
        for name in ("frontal", "lateral"):
            self.assertEqual(yaml.safe_load(self.read("patient/%s.camera.yaml" % name))["marrow-camera"], 1)

    def test_names_that_cannot_be(self):
        for words, said in (
            ("node mine", "new node 'mine': expected KIND.NAME, such as edges.mine"),
            (
                "node edges.My-Node",
                "new node: the name 'My-Node': a name has small letters, digits and '_', begins with a letter, and is "
                "at most 60 characters long",
            ),
            ("node edges.canny", "a node 'edges.canny' exists already; choose another name"),
            (
                "node edge.mine",
                "no library brings the kind 'edge'; make it by: marrow new kind edge; or did you mean 'edges'?",
            ),
            (
                "node render.mine",
                "the kind 'render' has no template; there are templates of %s. Copy a node of this kind, or the "
                "example-plugin of the documentation" % ", ".join(KINDS),
            ),
            ("kind edges", "a kind 'edges' exists already; a node of it: marrow new node edges.mine"),
            ("case a/b", "new case 'a/b': expected the name of a folder; its place is given with --out"),
            (
                "pipeline mine --from femr",
                "--from 'femr': neither a file here nor one of marrow's own; did you mean 'femur'?",
            ),
        ):
            with self.subTest(words):
                self.assertEqual(self.refused_with(*words.split()), said)
        said = self.refused_with("network", "My net")
        self.assertTrue(said.startswith("new network: the name 'My net': a name has small"), said)

    def test_what_is_there_stays(self):
        for what, name, place in (
            ("node", "edges.mine", "edges_mine"),
            ("kind", "denoised", "denoised"),
            ("network", "mine", "mine"),
            ("case", "patient", "patient"),
            ("pipeline", "mine", "mine.yaml"),
            ("experiment", "mine", "mine.yaml"),
        ):
            self.write(place, "precious")
            said = ": it exists already, and nothing was written; name another place with --out"
            self.assertEqual(self.refused_with(what, name), place + said)
            self.assertEqual(self.read(place), "precious")
        nowhere = self.refused_with("pipeline", "mine", "--out", "nowhere/mine.yaml")
        self.assertIn("nowhere: there is no such folder; make it first", nowhere)

    def test_an_installation_without_templates(self):
        program = self.write("bin/marrow", (BUILD / "bin/marrow").read_bytes())
        program.chmod(0o755)
        self.assertIn(
            "share/marrow/templates/case: it is not there; install the package marrow-dev, or marrow as a whole",
            self.run_in(".", program, "new", "case", "x", code=2, LD_LIBRARY_PATH=str(BUILD / "lib")),
        )


if __name__ == "__main__":
    main()
