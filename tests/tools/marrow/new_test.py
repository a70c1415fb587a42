# SPDX-License-Identifier: Apache-2.0
"""marrow new: its files work without changes, and no existing file is lost."""
import os
import pathlib
import subprocess
import unittest

import yaml
from harness import BUILD, MARROW, SOURCE, onnx
from harness.program import Case, main, marrow
from harness.sample import sample

KINDS = sorted(path.parent.parent.name for path in (SOURCE / "plugins").glob("*/template/template.yaml"))
PYTHON_KINDS = sorted(path.parent.parent.parent.name for path in (SOURCE / "plugins").glob("*/template/python/node.py"))


class New(Case):
    def new(self, *arguments):
        return marrow("new", *arguments, cwd=self.scratch)

    def refused(self, *arguments):
        before = sorted(self.scratch.rglob("*"))
        result = self.new(*arguments)
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertEqual(sorted(self.scratch.rglob("*")), before)
        return result.stderr.strip().removeprefix("marrow: error: ")

    def run_in(self, folder, *command, **environment):
        result = subprocess.run(
            [*map(str, command)],
            cwd=folder,
            env={**os.environ, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.assertEqual(result.returncode, 0, result.stdout)
        return result.stdout

    def with_one_coarse_case(self, folder):
        """Makes the comparison of a new node shorter."""
        coarse = [("compare.yaml", "seeds: 1..2", "seeds: [1]")]
        if "extends:" not in (folder / "pipeline.yaml").read_text():
            coarse.append(("pipeline.yaml", "spacing_mm: [1, 1, 1.2]", "spacing_mm: [1.5, 1.5, 1.5]"))
        for name, old, new in coarse:
            text = (folder / name).read_text()
            self.assertEqual(text.count(old), 1, old)
            (folder / name).write_text(text.replace(old, new))

    def test_every_kind_with_a_suite_has_a_template(self):
        with_suite = sorted(path.parent.name for path in (SOURCE / "plugins").glob("*/suite.cpp"))
        self.assertEqual(KINDS, with_suite)
        self.assertEqual(PYTHON_KINDS, KINDS)

    def test_nodes_of_kinds_and_a_kind_are_built_against_an_installation_and_tested(self):
        prefix = self.scratch / "installed"
        self.run_in(self.scratch, "cmake", "--install", BUILD, "--prefix", prefix)
        program = prefix / "bin" / "marrow"
        for kind in KINDS:
            said = self.run_in(self.scratch, program, "new", "node", kind + ".mine")
            self.assertIn("%s_mine/ci builds it, tests it" % kind, said)
        self.run_in(self.scratch, program, "new", "kind", "denoised")
        kinds = sample(KINDS, 1)
        projects = [kind + "_mine" for kind in kinds] + ["denoised"]
        # One project for all, so that the packages are looked for once.
        lines = ["cmake_minimum_required(VERSION 3.25)", "project(all CXX)", "enable_testing()"]
        lines += ["add_subdirectory(%s)" % project for project in projects]
        self.write("CMakeLists.txt", "\n".join(lines))
        build = self.scratch / "build"
        self.run_in(self.scratch, "cmake", "-S", ".", "-B", build, "-G", "Ninja", "-DCMAKE_PREFIX_PATH=%s" % prefix)
        self.run_in(self.scratch, "ninja", "-C", build)
        said = self.run_in(self.scratch, "ctest", "--test-dir", build, "-j2", "--no-tests=error", "--output-on-failure")
        self.assertIn("100%% tests passed, 0 tests failed out of %d" % (2 * len(projects)), said)
        plugins = ":".join(str(build / project) for project in projects)
        for project in projects:
            pipeline = self.scratch / project / "pipeline.yaml"
            self.run_in(self.scratch, program, "check", pipeline, MARROW_PLUGIN_PATH=plugins)
            self.run_in(
                self.scratch,
                program,
                "compare",
                pipeline.with_name("compare.yaml"),
                "--dry-run",
                MARROW_PLUGIN_PATH=plugins,
            )
            about = yaml.safe_load(pipeline.with_name("plugin.yaml").read_text())
            self.assertEqual(about["name"], project)
            self.assertTrue(os.access(pipeline.with_name("ci"), os.X_OK))
        self.with_one_coarse_case(self.scratch / projects[0])
        experiment = "%s/compare.yaml" % projects[0]
        row = self.run_in(self.scratch, program, "compare", experiment, "--out", "compared", MARROW_PLUGIN_PATH=plugins)
        self.assertRegex(row, r"\nmine +1 +0 ")

    @unittest.skipUnless((BUILD / "python" / "marrow" / "nodes.pyi").exists(), "the Python package is not built")
    def test_nodes_in_python_work_without_a_build(self):
        checked = sample(PYTHON_KINDS, 3)
        compared = sample(checked, 1)
        for kind in PYTHON_KINDS:
            with self.subTest(kind):
                result = self.new("node", kind + ".mine", "--python")
                self.assertIn("%s_mine/ci tests it, and tries it in a pipeline" % kind, result.stdout)
                folder = self.scratch / (kind + "_mine")
                paths = {"PYTHONPATH": str(BUILD / "python"), "MARROW_PLUGIN_PATH": str(folder)}
                self.assertIn("OK", self.run_in(folder, "/usr/bin/python3", "test.py", **paths))
                if kind in checked:
                    self.assertIn(", 0 failed", self.run_in(folder, MARROW, "conformance", kind + ".mine", **paths))
                self.run_in(folder, MARROW, "check", "pipeline.yaml", **paths)
                if kind in compared:
                    self.with_one_coarse_case(folder)
                    row = self.run_in(folder, MARROW, "compare", "compare.yaml", **paths)
                    self.assertRegex(row, r"\nmine +1 +0 +0 +100.0 %", "it takes its place in a whole registration")
                self.assertTrue(os.access(folder / "ci", os.X_OK))
                self.assertIn("%s.mine" % kind, (folder / "ci").read_text())
                self.assertFalse(any(path.suffix in (".cpp", ".txt") for path in folder.iterdir()))

    def test_a_node_in_python_says_how_to_find_the_package(self):
        self.assertEqual(self.new("node", "edges.mine", "--python").returncode, 0)
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        (self.scratch / "python").write_text('#!/bin/sh\nexec /usr/bin/python3 -S "$@"\n')  # without installed packages
        (self.scratch / "python").chmod(0o755)
        done = subprocess.run(
            ["./ci"],
            cwd=self.scratch / "edges_mine",
            env={**environment, "MARROW_PYTHON": str(self.scratch / "python")},
            capture_output=True,
            text=True,
        )
        self.assertEqual(done.returncode, 2)
        self.assertIn("python cannot import marrow: install the Debian package python3-marrow, or name", done.stderr)
        self.assertIn("export PYTHONPATH=MARROW/build/python  where marrow was built in MARROW", done.stderr)
        self.assertIn("No module named 'marrow'", done.stderr)

    ONLY_EDGES = """marrow: 1
extends: pipeline.yaml
outputs: {verdict: null, pose: null, errors: null, overlay: null, edges: edges}
"""

    def finds_edges(self, folder):
        """Runs the part of the folder's pipeline that ends with the network's edges, on a coarse femur."""
        (folder / "edges.yaml").write_text(self.ONLY_EDGES)
        coarse = ["--set", "femur.resolution_mm=3", "--set", "ct.range_mm=[0, 60]"]
        ran = marrow("run", "edges.yaml", "--only", "edges", "--out", "out", *coarse, cwd=folder)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertTrue(any((folder / "out/outputs/edges").iterdir()))

    def test_a_network_takes_the_place_of_a_node(self):
        said = self.new("network", "mine").stdout
        self.assertIn("mine/ci trains the network, and tries it in a pipeline", said)
        folder = self.scratch / "mine"
        names = {".gitignore", "README.md", "ci", "mine.yaml", "pipeline.yaml", "train.py"}
        self.assertEqual({path.name for path in folder.iterdir()}, names)
        self.assertFalse(any("@name@" in path.read_text() for path in folder.iterdir()))
        self.assertTrue(os.access(folder / "ci", os.X_OK))
        checked = marrow("check", "pipeline.yaml", cwd=folder)
        self.assertIn("mine.onnx", checked.stdout + checked.stderr, "it says that the network is not there yet")
        # As trained: a convolution that is sure of a border everywhere.
        layer, tensors = onnx.convolution("image", "borders", [[[[0.0]]]], [5.0])
        (folder / "mine.onnx").write_bytes(onnx.model([layer], tensors, {"borders": (1, 256, 256)}, 256, 256))
        checked = marrow("check", "pipeline.yaml", cwd=folder)
        self.assertEqual(checked.returncode, 0, checked.stderr)
        self.finds_edges(folder)

    def test_the_training_of_a_new_network(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import torch, onnx"], capture_output=True).returncode:
            self.skipTest("PyTorch is not installed (python3-torch, python3-onnx)")
        self.new("network", "mine")
        folder = self.scratch / "mine"
        text = (folder / "train.py").read_text()
        self.assertIn("STEPS, BATCH = 300, 8", text)
        (folder / "train.py").write_text(text.replace("STEPS, BATCH = 300, 8", "STEPS, BATCH = 5, 2"))
        self.assertIn("wrote mine.onnx", self.run_in(folder, "/usr/bin/python3", "train.py"))
        self.finds_edges(folder)

    def test_a_pipeline_and_an_experiment_work_where_they_are_put(self):
        (self.scratch / "mine").mkdir()
        self.assertEqual(self.new("pipeline", "simple").returncode, 0)
        marrow("check", self.scratch / "simple.yaml")
        for name in ("femur-best", "guidance-closed"):  # one names a failure model, the other a body
            self.assertEqual(self.new("pipeline", "copy", "--from", name, "--out", "mine/%s.yaml" % name).returncode, 0)
            result = marrow("check", self.scratch / "mine" / (name + ".yaml"))
            self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.new("experiment", "try", "--from", "edges").returncode, 0)
        result = marrow("compare", self.scratch / "try.yaml", "--dry-run")
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_a_case_says_what_is_still_missing(self):
        self.assertEqual(self.new("case", "patient").returncode, 0)
        result = marrow(
            "run", SOURCE / "pipelines/femur/femur.yaml", "case=%s" % (self.scratch / "patient"), cwd=self.scratch
        )
        self.assertEqual(result.returncode, 1)
        self.assertIn("ct.mha", result.stderr)
        for name in ("frontal", "lateral"):
            camera = yaml.safe_load((self.scratch / "patient" / (name + ".camera.yaml")).read_text())
            self.assertEqual(camera["marrow-camera"], 1)

    def test_names_that_cannot_be(self):
        self.assertEqual(self.refused("node", "mine"), "new node 'mine': expected KIND.NAME, such as edges.mine")
        self.assertEqual(
            self.refused("node", "edges.My-Node"),
            "new node: the name 'My-Node': a name has small letters, digits and '_', begins with a letter, and is at "
            "most 60 characters long",
        )
        self.assertEqual(
            self.refused("node", "edges.canny"), "a node 'edges.canny' exists already; choose another name"
        )
        self.assertEqual(
            self.refused("node", "edge.mine"),
            "no library brings the kind 'edge'; make it by: marrow new kind edge; or did you mean 'edges'?",
        )
        self.assertEqual(
            self.refused("node", "render.mine"),
            "the kind 'render' has no template; there are templates of %s. Copy a node of "
            "this kind, or the example-plugin of the documentation" % ", ".join(KINDS),
        )
        self.assertEqual(
            self.refused("kind", "edges"), "a kind 'edges' exists already; a node of it: marrow new node edges.mine"
        )
        self.assertEqual(
            self.refused("case", "a/b"), "new case 'a/b': expected the name of a folder; its place is given with --out"
        )
        self.assertTrue(
            self.refused("network", "My net").startswith("new network: the name 'My net': a name has small")
        )
        self.assertEqual(
            self.refused("pipeline", "mine", "--from", "femr"),
            "--from 'femr': neither a file here nor one of marrow's own; did you mean 'femur'?",
        )

    def test_what_is_there_stays(self):
        for what, name, place in (
            ("node", "edges.mine", "edges_mine"),
            ("kind", "denoised", "denoised"),
            ("network", "mine", "mine"),
            ("case", "patient", "patient"),
            ("pipeline", "mine", "mine.yaml"),
            ("experiment", "mine", "mine.yaml"),
        ):
            path = self.write(place, "precious")
            said = self.refused(what, name)
            self.assertEqual(
                said, place + ": it exists already, and nothing was written; name another place with --out"
            )
            self.assertEqual(path.read_text(), "precious")
        self.assertIn(
            "nowhere: there is no such folder; make it first",
            self.refused("pipeline", "mine", "--out", "nowhere/mine.yaml"),
        )

    def test_an_installation_without_templates(self):
        program = self.scratch / "bin" / "marrow"
        program.parent.mkdir()
        program.write_bytes((BUILD / "bin/marrow").read_bytes())
        program.chmod(0o755)
        library = pathlib.Path(BUILD) / "lib"
        result = subprocess.run(
            [program, "new", "case", "x"],
            cwd=self.scratch,
            capture_output=True,
            text=True,
            env={**os.environ, "LD_LIBRARY_PATH": str(library)},
        )
        self.assertEqual(result.returncode, 2)
        self.assertIn(
            "share/marrow/templates/case: it is not there; install the package marrow-dev, or marrow as a whole",
            result.stderr,
        )


if __name__ == "__main__":
    main()
