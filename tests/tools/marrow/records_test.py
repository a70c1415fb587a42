# SPDX-License-Identifier: Apache-2.0
"""The folder of a run that somebody else made, or that is damaged: what reads it refuses it in words, waits for nothing
and shows nothing from outside it."""
import json
import os
import shutil
import subprocess

from harness import MARROW
from harness.formats import grey_png
from harness.program import main
from number_cases import NUMBER, Commands


class Records(Commands):
    """run.json and pipeline.yaml of a folder that somebody else made, or that is damaged."""

    def setUp(self):
        super().setUp()
        self.expect(0, "run", self.write("p.yaml", NUMBER % ""), "--out", "a", "--quiet")
        self.record = json.loads((self.scratch / "a" / "run.json").read_text())

    def change(self, **values):
        self.write("a/run.json", json.dumps({**self.record, **values}))

    def test_wrong_records_are_refused(self):
        deep = "[" * 100000 + "]" * 100000
        node = self.record["nodes"][0]
        for values, why in (
            ({"threads": 10**9}, "its 'threads' is 1000000000; expected a whole number from 0 to 1024"),
            ({"threads": -1}, "its 'threads' is -1; expected"),
            ({"threads": 1.5}, "its 'threads': expected a whole number"),
            ({"threads": "2"}, "its 'threads': expected a whole number"),
            ({"seed": -1}, "its 'seed' is no whole number"),
            ({"seed": 1e30}, "its 'seed' is no whole number"),
            ({"seed": None}, "its 'seed' is no whole number"),
            ({"status": "\x1b[2J"}, "it says 'status': '\\x1b[2J'"),
            ({"nodes": {}}, "its 'nodes' is no list"),
            ({"nodes": [1]}, "what it should say is missing in it, or of another type"),
            ({"nodes": [{**node, "keys": {"number": "../x"}}]}, "a key in it has not 32 hexadecimal digits"),
            ({"inputs": 1}, "its 'inputs' is no object"),
            ({"outputs": {}}, "its 'outputs' is no list"),
            ({"overrides": [1]}, "of another type"),
            ({"pipeline": 1}, "of another type"),
        ):
            self.change(**values)
            for command in (["rerun", "a", "--out", "b"], ["diff", "a", "a"]):
                result = self.marrow(*command)
                error = result.stderr
                self.assertEqual(result.returncode, 2, (values, command, error))
                self.assertIn("marrow: error: a/run.json is not what 'marrow run' wrote: ", error)
                self.assertIn(why, error)
                self.assertIn("; run it again\n", error)
        for text, why in (
            ('{"nodes": %s}' % deep, "it: lists and objects are nested more than 64 deep"),
            ("{", "it:1:2: not valid JSON"),
            ("[]", "it holds no object"),
            ("", "it:1:1: not valid JSON"),
        ):
            self.write("a/run.json", text)
            for command in (["rerun", "a", "--out", "b"], ["diff", "a", "a"], ["show", "a"]):
                self.assertIn(
                    "a/run.json is not what 'marrow run' wrote: " + why + "; run it again",
                    self.expect(2, *command).stderr,
                )
        for values in ({"nodes": 1}, {"outputs": [1]}, {"pipeline": []}, {"seconds": "x"}):
            self.change(**values)
            self.assertIn("a/run.json is not what 'marrow run' wrote: ", self.expect(2, "show", "a").stderr)
        self.write("a/run.json", "{}")
        self.assertIn(
            "a/run.json is not what 'marrow run' wrote: what it should say is missing in it",
            self.expect(2, "show", "a").stderr,
        )
        self.assertFalse((self.scratch / "b").exists())

    def test_wrong_pipelines_are_refused(self):
        for text, why in (
            ("nodes: &a {c: *a}\n", "an alias names the list or map that contains it"),
            ("a: " + "[" * 50000, "nested more than 100 deep"),
            ("{", "not valid YAML"),
            ("x" * 4000001, "longer than 4 MB"),
            ("", "it holds no pipeline"),
            ("root:x:0:0\n", "it holds no pipeline"),
            ("[a]", "it holds no pipeline"),
            ("nodes: x\n", "it holds no pipeline"),
            ("nodes: {c: x}\n", "its node 'c' is no map"),
            ("nodes: {d: {uses: a}}\n", "its node 'c' is none of pipeline.yaml"),
        ):
            self.write("a/pipeline.yaml", text)
            for command in ("rerun", "diff"):
                error = self.expect(2, command, "a", *(["a"] if command == "diff" else [])).stderr
                self.assertIn(why, error)
                self.assertEqual(error.count("\n"), 1)
                self.assertNotIn("yaml-cpp", error)

    def test_no_pipe_keeps_a_reader_waiting(self):
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        (self.scratch / "a" / "pipeline.yaml").unlink()
        os.mkfifo(self.scratch / "a" / "pipeline.yaml")
        os.mkfifo(self.scratch / "a" / "report.html")
        for command in (["diff", "a", "b"], ["diff", "b", "a"], ["rerun", "a", "--out", "c"]):
            self.assertIn(
                (
                    "a/pipeline.yaml is not what 'marrow run' wrote: the pipeline is a named pipe, not a regular"
                    " file; run it again"
                ),
                self.expect(2, *command).stderr,
            )
        self.expect(0, "show", "a")
        self.assertEqual(self.shown()["experiment"]["pipeline_text"], "")
        for name, kind in (("a/pipeline.yaml", "a named pipe"), ("/dev/zero", "a device")):
            for command in ("check", "graph", "run", "plan"):
                self.assertEqual(
                    self.expect(2, command, name).stderr,
                    "%s: error: the pipeline file is %s, not a regular file\n  hint: write the text to a file and give"
                    " that\n1 error\n" % (name, kind),
                )
            self.assertIn("is %s, not a regular file" % kind, self.expect(2, "compare", name, "--out", "c").stderr)
        self.assertFalse((self.scratch / "c").exists())
        (self.scratch / "out").symlink_to("/dev/stdout")
        page = subprocess.run(
            [str(MARROW), "show", "b", "--out", "out"], cwd=self.scratch, capture_output=True, text=True, timeout=300
        )
        self.assertIn("</html>", page.stdout, "a pipe that is named as the place of the page")

    def test_functions_that_call_each_other_in_a_circle(self):
        node, nodes, pipeline = self.record["nodes"][0], [], "marrow: 1\nname: p\nnodes:\n"
        for i in range(60):
            nodes.append(
                {**node, "id": "f%d" % i, "functions": ["number"], "inputs": {"a": "%032x" % 1, "b": "%032x" % 1}}
            )
            pipeline += "  f%d: {uses: x.y, in: {a: f%d, b: f%d}}\n" % (i, (i + 1) % 60, (i + 2) % 60)
        nodes.append({**node, "id": "c", "inputs": {"a": "%032x" % 1}})
        self.write("a/pipeline.yaml", pipeline + "  c: {uses: x.y, in: {a: f0}}\noutputs: {o: c}\n")
        self.change(nodes=nodes)
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        for one in nodes:
            one["inputs"] = {port: "%032x" % 2 for port in one["inputs"]}
        nodes[-1]["keys"] = {"number": "%032x" % 3}
        self.write("b/run.json", json.dumps({**self.record, "nodes": nodes}))
        self.assertIn("First difference: node 'c'", self.expect(1, "diff", "a", "b", timeout=300).stdout)

    def shown(self):
        """What the page of the run holds."""
        return self.page_data("a/report.html")

    def test_a_page_shows_nothing_from_outside_the_run(self):
        secret = json.dumps({"metrics": [{"name": "secret figure", "value": 1, "unit": ""}]})
        (self.scratch / "a" / "outputs" / "inside.png").write_bytes(grey_png(4, 4, lambda u, v: 0))
        self.expect(0, "show", "a")
        self.assertEqual(self.shown()["pictures"], {})
        self.write("secret.json", secret)
        (self.scratch / "secret.png").write_bytes(grey_png(4, 4, lambda u, v: 1000 * u))
        (self.scratch / "a" / "outputs" / "link.png").symlink_to(self.scratch / "secret.png")
        (self.scratch / "a" / "outputs" / "link").symlink_to(self.scratch)
        outside = [
            "../secret.png",
            str(self.scratch / "secret.png"),
            "outputs/link.png",
            "outputs/link/secret.png",
            "outputs/../../secret.png",
            "../secret.json",
        ]
        self.change(outputs=[{"name": "o", "files": [*outside, "outputs/inside.png", "outputs/none.png", "outputs"]}])
        result = self.expect(0, "show", "a")
        self.assertEqual(
            result.stderr.splitlines(),
            ["marrow: warning: %s is not shown: it lies outside the run's folder a" % name for name in outside],
        )
        page = (self.scratch / "a" / "report.html").read_text()
        data = self.shown()
        self.assertEqual([picture["name"] for picture in data["cells"][0]["pictures"]], ["inside"])
        self.assertNotIn("secret figure", page)
        # diff reads files where the store has no values
        for folder, digit in (("b", "1"), ("a", "2")):
            self.change(outputs=[{"name": "o", "files": ["../secret.json"], "items": [["", digit * 32]]}])
            if folder == "b":
                shutil.copytree(self.scratch / "a", self.scratch / "b", symlinks=True)
        self.assertIn("by how much is not known", self.expect(1, "diff", "a", "b").stdout)

    def test_a_page_shows_no_pipeline_from_outside_the_run(self):
        secret = self.write("secret.yaml", (self.scratch / "a" / "pipeline.yaml").read_text() + "# secret\n")
        (self.scratch / "a" / "pipeline.yaml").unlink()
        (self.scratch / "a" / "pipeline.yaml").symlink_to(secret)
        result = self.expect(0, "show", "a")
        self.assertEqual(
            result.stderr, "marrow: warning: pipeline.yaml is not shown: it lies outside the run's folder a\n"
        )
        self.assertEqual(self.shown()["experiment"]["pipeline_text"], "")
        self.assertNotIn("graph", self.shown())
        self.assertNotIn("# secret", (self.scratch / "a" / "report.html").read_text())
        shutil.move(self.scratch / "a" / "run.json", self.scratch / "run.json")
        (self.scratch / "a" / "run.json").symlink_to(self.scratch / "run.json")
        self.assertIn(
            "a/run.json is a link to a file outside of the folder, and such files are not shown; copy it into the "
            "folder",
            self.expect(2, "show", "a").stderr,
        )

    def test_a_scene_fetches_nothing(self):
        scene = {
            "marrow-scene": 1,
            "meshes": [],
            "poses": [],
            "views": [{"name": "x", "image": "http://example.invalid/x.png"}],
        }
        self.write("a/outputs/scene.json", json.dumps(scene))
        self.change(outputs=[{"name": "scene", "files": ["outputs/scene.json"]}])
        self.expect(0, "show", "a")
        self.assertNotIn("example.invalid", (self.scratch / "a" / "report.html").read_text())


if __name__ == "__main__":
    main()
