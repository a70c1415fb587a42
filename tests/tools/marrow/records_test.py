# SPDX-License-Identifier: Apache-2.0
"""The folder of a run that somebody else made, or that is damaged: what reads it refuses it in words, waits for nothing
and shows nothing from outside it."""
import json
import os
import shutil

from harness.formats import grey_png
from harness.program import Case, main

NUMBER = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
NOT_WRITTEN = "a/run.json is not what 'marrow run' wrote: "
SHOW = ["show", "a"]
READERS = (["rerun", "a", "--out", "b"], ["diff", "a", "a"])  # both read a record by the same function


class Records(Case):
    """run.json and pipeline.yaml of a folder that somebody else made, or that is damaged."""

    has_own_store = False

    def setUp(self):
        super().setUp()
        self.expect(0, "run", self.write("p.yaml", NUMBER), "--out", "a", "--quiet")
        self.record = self.json("a/run.json")
        self.folder = self.scratch / "a"

    def change(self, **values):
        self.write("a/run.json", json.dumps({**self.record, **values}))

    def test_wrong_records_are_refused(self):
        node = self.record["nodes"][0]
        for number, (values, why) in enumerate(
            (
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
            )
        ):
            self.change(**values)
            self.refused(["marrow: error: " + NOT_WRITTEN, why, "; run it again\n"], *READERS[number % 2])
        deep = "[" * 100000 + "]" * 100000
        for text, why in (
            ('{"nodes": %s}' % deep, "it: lists and objects are nested more than 64 deep"),
            ("{", "it:1:2: not valid JSON"),
            ("[]", "it holds no object"),
            ("", "it:1:1: not valid JSON"),
        ):
            self.write("a/run.json", text)
            for command in (*READERS, SHOW):
                self.refused(NOT_WRITTEN + why + "; run it again", *command)
        for values in ({"nodes": 1}, {"outputs": [1]}, {"pipeline": []}, {"seconds": "x"}):
            self.change(**values)
            self.refused(NOT_WRITTEN, *SHOW)
        self.write("a/run.json", "{}")
        self.refused(NOT_WRITTEN + "what it should say is missing in it", *SHOW)
        self.assertFalse((self.scratch / "b").exists())

    def test_wrong_pipelines_are_refused(self):
        for number, (text, why) in enumerate(
            (
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
            )
        ):
            self.write("a/pipeline.yaml", text)
            error = self.refused(why, *READERS[number % 2])
            self.assertEqual(error.count("\n"), 1)
            self.assertNotIn("yaml-cpp", error)

    def test_no_pipe_keeps_a_reader_waiting(self):
        shutil.copytree(self.folder, self.scratch / "b")
        (self.folder / "pipeline.yaml").unlink()
        os.mkfifo(self.folder / "pipeline.yaml")
        os.mkfifo(self.folder / "report.html")
        said = (
            "a/pipeline.yaml is not what 'marrow run' wrote: the pipeline is a named pipe, not a regular file; run it "
            "again"
        )
        self.refusals((said, "diff", "a", "b"), (said, "diff", "b", "a"), (said, "rerun", "a", "--out", "c"))
        self.expect(0, *SHOW)
        self.assertEqual(self.shown()["experiment"]["pipeline_text"], "")
        for name, kind in (("a/pipeline.yaml", "a named pipe"), ("/dev/zero", "a device")):
            for command in ("check", "graph", "run", "plan"):
                self.assertEqual(
                    self.expect(2, command, name).stderr,
                    "%s: error: the pipeline file is %s, not a regular file\n  hint: write the text to a file and give"
                    " that\n1 error\n" % (name, kind),
                )
            self.refused("is %s, not a regular file" % kind, "compare", name, "--out", "c")
        self.assertFalse((self.scratch / "c").exists())
        (self.scratch / "out").symlink_to("/dev/stdout")
        page = self.marrow("show", "b", "--out", "out").stdout
        self.assertIn("</html>", page, "a pipe that is named as the place of the page")

    def test_functions_that_call_each_other_in_a_circle(self):
        node, nodes, pipeline = self.record["nodes"][0], [], "marrow: 1\nname: p\nnodes:\n"
        for i in range(60):
            inputs = {"a": "%032x" % 1, "b": "%032x" % 1}
            nodes.append({**node, "id": "f%d" % i, "functions": ["number"], "inputs": inputs})
            pipeline += "  f%d: {uses: x.y, in: {a: f%d, b: f%d}}\n" % (i, (i + 1) % 60, (i + 2) % 60)
        nodes.append({**node, "id": "c", "inputs": {"a": "%032x" % 1}})
        self.write("a/pipeline.yaml", pipeline + "  c: {uses: x.y, in: {a: f0}}\noutputs: {o: c}\n")
        self.change(nodes=nodes)
        shutil.copytree(self.folder, self.scratch / "b")
        for one in nodes:
            one["inputs"] = {port: "%032x" % 2 for port in one["inputs"]}
        nodes[-1]["keys"] = {"number": "%032x" % 3}
        self.write("b/run.json", json.dumps({**self.record, "nodes": nodes}))
        self.assertIn("First difference: node 'c'", self.expect(1, "diff", "a", "b", timeout=300).stdout)

    def shown(self):
        """What the page of the run holds."""
        return self.page_data("a/report.html")

    def test_a_page_shows_nothing_from_outside_the_run(self):
        self.write("a/outputs/inside.png", grey_png(4, 4, lambda u, v: 0))
        self.expect(0, *SHOW)
        self.assertEqual(self.shown()["pictures"], {})
        self.write("secret.json", json.dumps({"metrics": [{"name": "secret figure", "value": 1, "unit": ""}]}))
        secret = self.write("secret.png", grey_png(4, 4, lambda u, v: 1000 * u))
        (self.folder / "outputs" / "link.png").symlink_to(secret)
        (self.folder / "outputs" / "link").symlink_to(self.scratch)
        outside = ["../secret.png", str(secret), "outputs/link.png", "outputs/link/secret.png"]
        outside += ["outputs/../../secret.png", "../secret.json"]
        self.change(outputs=[{"name": "o", "files": [*outside, "outputs/inside.png", "outputs/none.png", "outputs"]}])
        self.assertEqual(
            self.expect(0, *SHOW).stderr.splitlines(),
            ["marrow: warning: %s is not shown: it lies outside the run's folder a" % name for name in outside],
        )
        self.assertEqual([picture["name"] for picture in self.shown()["cells"][0]["pictures"]], ["inside"])
        self.assertNotIn("secret figure", self.read("a/report.html"))
        # diff reads files where the store has no values
        for folder, digit in (("b", "1"), ("a", "2")):
            self.change(outputs=[{"name": "o", "files": ["../secret.json"], "items": [["", digit * 32]]}])
            if folder == "b":
                shutil.copytree(self.folder, self.scratch / "b", symlinks=True)
        self.assertIn("by how much is not known", self.expect(1, "diff", "a", "b").stdout)

    def test_a_page_shows_no_pipeline_from_outside_the_run(self):
        secret = self.write("secret.yaml", self.read("a/pipeline.yaml") + "# secret\n")
        (self.folder / "pipeline.yaml").unlink()
        (self.folder / "pipeline.yaml").symlink_to(secret)
        said = "marrow: warning: pipeline.yaml is not shown: it lies outside the run's folder a\n"
        self.assertEqual(self.expect(0, *SHOW).stderr, said)
        self.assertEqual(self.shown()["experiment"]["pipeline_text"], "")
        self.assertNotIn("graph", self.shown())
        self.assertNotIn("# secret", self.read("a/report.html"))
        shutil.move(self.folder / "run.json", self.scratch / "run.json")
        (self.folder / "run.json").symlink_to(self.scratch / "run.json")
        self.refused(
            "a/run.json is a link to a file outside of the folder, and such files are not shown; copy it into the "
            "folder",
            *SHOW,
        )

    def test_a_scene_fetches_nothing(self):
        view = {"name": "x", "image": "http://example.invalid/x.png"}
        scene = {"marrow-scene": 1, "meshes": [], "poses": [], "views": [view]}
        self.write("a/outputs/scene.json", json.dumps(scene))
        self.change(outputs=[{"name": "scene", "files": ["outputs/scene.json"]}])
        self.expect(0, *SHOW)
        self.assertNotIn("example.invalid", self.read("a/report.html"))


if __name__ == "__main__":
    main()
