#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the server answers to the page "Pipeline": states, edits, faults, runs and plans."""
import json
import subprocess
import unittest
import unittest.mock

import bench
from bench import MARROW


from pipeline_bench import PIPELINE, PipelineBench


class RequestTest(PipelineBench):
    """What the server answers."""

    def setUp(self):
        super().setUp()
        self.server = self.open()
        self.server.enter()

    def state(self):
        return self.server.json("GET", "/api/pipeline?file=small.yaml")

    def post(self, path, **body):
        return self.server.ask("POST", "/api/pipeline/" + path, {"file": "small.yaml", **body})

    def edit(self, revision=None, **change):
        return self.post("edit", revision=revision or self.state()["revision"], **change)

    def error(self, answer, status=400):
        self.assertEqual(answer[0], status, answer[2])
        return json.loads(answer[2])["error"]

    def test_an_edit_changes_its_line_only_and_can_be_taken_back(self):
        answer = self.edit(what="option", node="cameras", uses="camera.carm", name="width_px", value="64")
        self.assertEqual(answer[0], 200, answer[2])
        self.assertEqual(self.file.read_text(), PIPELINE.replace("width_px: 96", "width_px: 64"))
        state = json.loads(answer[2])
        self.assertEqual((state["undo"], state["redo"]), ("cameras.width_px = 64", None))
        state = json.loads(self.post("undo", revision=state["revision"])[2])
        self.assertEqual(self.file.read_text(), PIPELINE)
        self.assertEqual((state["undo"], state["redo"]), (None, "cameras.width_px = 64"))
        self.post("redo", revision=state["revision"])
        self.assertIn("width_px: 64", self.file.read_text())

    def test_nodes_of_other_files_are_shown(self):
        (self.folder / "below").mkdir()
        (self.folder / "below" / "part.yaml").write_text(
            "marrow: 1\ninputs: {views: {type: view, over: view}}\n"
            "nodes: {edges: {uses: edges.canny, in: {view: views}}}\noutputs: {edges: edges}\n"
        )
        (self.folder / "base.yaml").write_text(PIPELINE)
        self.file.write_text(
            "marrow: 1\nextends: base.yaml\nnodes:\n  cameras: {with: {width_px: 64}}\n"
            "  more: {uses: below/part.yaml, in: {views: views}}\noutputs: {more: more}\n"
        )
        state = self.state()
        self.assertEqual(state["faults"], [])
        self.assertEqual([(one["name"], one["type"]) for one in state["inputs"]], [("level", "number")])
        nodes = state["nodes"]
        self.assertEqual((nodes["bone"]["file"], nodes["bone"]["line"]), ("base.yaml", 6))
        self.assertEqual((nodes["more/edges"]["file"], nodes["more/edges"]["line"]), ("below/part.yaml", 3))
        self.assertEqual((nodes["cameras"]["uses"], nodes["cameras"]["with"]), ("camera.carm", {"width_px": "64"}))
        self.assertNotIn("file", nodes["cameras"])
        options = {one["name"]: (one["now"], one["written"]) for one in nodes["cameras"]["info"]["options"]}
        self.assertEqual((options["width_px"], options["height_px"]), (("64", ""), ("96", "base.yaml:13")))
        answer = self.edit(what="option", node="cameras", uses="camera.carm", name="width_px", value="32")
        self.assertEqual(answer[0], 200, answer[2])
        self.assertIn("{width_px: 32}", self.file.read_text())

    def test_a_text_is_quoted_where_yaml_needs_it(self):
        text = "marrow: 1\nnodes:\n  bone: {uses: read.mesh, with: {path: a.stl}}  # mine\noutputs: {bone: bone}\n"
        self.file.write_text(text)
        for typed, written in (
            ("my bone: #1.stl", '"my bone: #1.stl"'),
            ("007", '"007"'),
            ("x}, may_fail: {y", '"x}, may_fail: {y"'),
            ("b.stl", "b.stl"),
        ):
            self.assertEqual(self.edit(what="option", node="bone", uses="read.mesh", name="path", value=typed)[0], 200)
            self.assertEqual(self.file.read_text(), text.replace("a.stl", written))

    def test_a_wire_goes_to_another_output(self):
        self.assertEqual(self.edit(what="wire", node="edges", name="view", value="views.frontal")[0], 200)
        self.assertEqual(self.file.read_text(), PIPELINE.replace("{view: views}", "{view: views.frontal}"))

    def test_an_edit_of_an_old_revision_is_refused(self):
        old = self.state()["revision"]
        self.file.write_text(PIPELINE.replace("high: 5", "high: 6"))
        self.assertEqual(
            self.error(
                self.edit(old, what="option", node="edges", uses="edges.canny", name="noise_high", value="7"), 409
            ),
            "small.yaml was changed elsewhere; the page now shows what is newest",
        )
        state = self.state()
        self.assertIn("high: 6", state["text"])
        self.assertEqual(state["undo"], "a change by another program")

    def test_an_edit_that_would_be_a_fault_is_not_written(self):
        fault = self.error(self.edit(what="option", node="cameras", uses="camera.carm", name="width_px", value="0"))
        self.assertEqual(
            fault,
            "cameras.width_px = 0 is not written: option 'width_px' of camera.carm: 0 is below the least allowed, 1 px",
        )
        self.assertEqual(self.file.read_text(), PIPELINE)
        self.assertIn(
            "edges.in.view = nowhere is not written",
            self.error(self.edit(what="wire", node="edges", name="view", value="nowhere")),
        )
        self.assertIn("no such edit: 'x'", self.error(self.edit(what="x", node="edges")))

    def test_faults_are_those_of_the_command_line(self):
        self.file.write_text(PIPELINE.replace("camera.carm", "camera.carn"))
        state = self.state()
        said = subprocess.run([MARROW, "check", self.file, "--json"], capture_output=True, text=True)
        self.assertEqual(state["faults"], json.loads(said.stdout))
        self.assertEqual(state["faults"][0]["line"], 9)
        self.assertIsNone(state["graph"])

    def test_what_fits_is_what_the_command_line_says(self):
        fits = self.server.json("GET", "/api/pipeline/fits?file=small.yaml&node=edges")
        said = subprocess.run([MARROW, "list", "--fits", self.file, "edges", "--json"], capture_output=True, text=True)
        self.assertEqual(
            [{k: one[k] for k in ("node", "fits", "missing", "faults")} for one in fits], json.loads(said.stdout)
        )

    def test_files_outside_are_not_reached(self):
        (self.scratch / "other.yaml").write_text(PIPELINE)
        for file in ("../other.yaml", "/etc/passwd"):
            answer = self.server.ask("GET", "/api/pipeline?file=" + file)
            self.assertIn("leads out of the folder that is open", self.error(answer))
        answer = self.post("plan", inputs={"level": ""})
        self.assertIn("input 'level' has no value", self.error(answer))

    def test_functions_are_no_outputs_of_a_run(self):
        nodes = "nodes: {optimizer: {uses: optimizer.nelder_mead}}\noutputs: {search: optimizer}\n"
        self.file.write_text("marrow: 1\nonly_inside: true\n" + nodes)
        state = self.server.finish(json.loads(self.post("run", inputs={})[2])["job"])
        self.assertEqual(state["state"], "failed")
        self.assertIn("output 'search' is a function, which no file can hold", state["error"])
        self.assertFalse((self.folder / "runs").exists())

    def test_a_run_writes_what_marrow_run_writes(self):
        started = json.loads(self.post("run", inputs={"level": "0.5"})[2])
        self.assertEqual(started["command"], "cd %s && marrow run small.yaml level=0.5" % self.folder)
        state = self.server.finish(started["job"])
        self.assertEqual(state["state"], "done", state)
        self.assertEqual((state["result"]["folder"], state["result"]["status"]), ("runs/small", "done"))
        by_hand = self.scratch / "by_hand"
        subprocess.run([MARROW, "run", self.file, "level=0.5", "--out", by_hand, "--quiet", "--no-cache"], check=True)
        ran = self.folder / "runs" / "small"
        same = subprocess.run([MARROW, "diff", ran, by_hand], capture_output=True, text=True)
        self.assertEqual(same.returncode, 0, same.stdout)
        self.assertEqual(
            sorted(p.name for p in (ran / "outputs").rglob("*")),
            sorted(p.name for p in (by_hand / "outputs").rglob("*")),
        )
        plan = json.loads(self.post("plan", inputs={"level": "0.5"})[2])
        self.assertEqual((plan["to_run"], plan["may_run"]), (0, 0))
        for inputs, kinds in (({"level": "0.5"}, ["picture", "picture"]), ({"level": "0.500"}, None)):
            job = json.loads(self.post("look", inputs=inputs, node="edges")[2])["job"]
            looked = self.server.finish(job)
            if kinds:
                items = looked["result"][0]["items"]
                self.assertEqual([item["place"] for item in items], ["frontal", "lateral"])
                self.assertEqual([item["parts"][0]["kind"] for item in items], kinds)
                self.assertTrue(items[0]["parts"][0]["picture"].startswith("data:image/webp;base64,"))
            else:
                self.assertEqual(looked["state"], "done", "the store has it")
        job = json.loads(self.post("look", inputs={"level": "0.3"}, node="edges")[2])["job"]
        self.assertEqual(
            self.server.finish(job)["error"], "what 'edges' makes has not been computed yet; run what is stale first"
        )


if __name__ == "__main__":
    bench.main(part=1)
