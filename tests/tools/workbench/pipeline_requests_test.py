#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the server answers to the page "Pipeline": states, edits, faults, runs and plans."""
import json
import unittest

from harness.program import marrow
from bench import PIPELINE, PipelineBench

CAMERAS = {"what": "option", "node": "cameras", "uses": "camera.carm", "name": "width_px"}
EDGES = {"what": "option", "node": "edges", "uses": "edges.canny", "name": "noise_high"}


class RequestTest(PipelineBench):
    def setUp(self):
        super().setUp()
        self.enter()

    def state(self):
        return self.server.get("/api/pipeline?file=small.yaml")

    def post(self, path, **body):
        return self.server.post("/api/pipeline/" + path, file="small.yaml", **body)

    def edit(self, **change):
        return self.post("edit", revision=self.state()["revision"], **change)

    def fault(self, path="edit", status=400, **body):
        body = {"file": "small.yaml", "revision": self.state()["revision"], **body}
        return self.server.fault("/api/pipeline/" + path, body, status)

    def look(self, level):
        """The state of the job that looks at the edges."""
        return self.server.finish(self.post("look", inputs={"level": level}, node="edges")["job"])

    def test_an_edit_changes_its_line_only_and_can_be_taken_back(self):
        state = self.edit(**CAMERAS, value="64")
        self.assertEqual(self.file.read_text(), PIPELINE.replace("width_px: 96", "width_px: 64"))
        self.assertEqual((state["undo"], state["redo"]), ("cameras.width_px = 64", None))
        state = self.post("undo", revision=state["revision"])
        self.assertEqual(self.file.read_text(), PIPELINE)
        self.assertEqual((state["undo"], state["redo"]), (None, "cameras.width_px = 64"))
        state = self.post("redo", revision=state["revision"])
        self.assertIn("width_px: 64", self.file.read_text())
        self.post("undo", revision=state["revision"])
        self.edit(what="wire", node="edges", name="view", value="views.frontal")
        self.assertEqual(self.file.read_text(), PIPELINE.replace("{view: views}", "{view: views.frontal}"))

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
        self.edit(**CAMERAS, value="32")
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
            self.edit(what="option", node="bone", uses="read.mesh", name="path", value=typed)
            self.assertEqual(self.file.read_text(), text.replace("a.stl", written))

    def test_an_edit_of_an_old_revision_or_with_a_fault_is_refused(self):
        old = self.state()["revision"]
        for change, part in (
            (
                {**CAMERAS, "value": "0"},
                "cameras.width_px = 0 is not written: option 'width_px' of camera.carm: 0 is below the least allowed, "
                "1 px",
            ),
            (
                {"what": "wire", "node": "edges", "name": "view", "value": "nowhere"},
                "edges.in.view = nowhere is not written",
            ),
            ({"what": "x", "node": "edges"}, "no such edit: 'x'"),
        ):
            fault = self.fault(**change)
            self.assertTrue(fault == part or (change["what"] != "option" and part in fault), fault)
        self.assertEqual(self.file.read_text(), PIPELINE)
        self.file.write_text(PIPELINE.replace("high: 5", "high: 6"))
        told = "small.yaml was changed elsewhere; the page now shows what is newest"
        self.assertEqual(self.fault(status=409, **{**EDGES, "value": "7", "revision": old}), told)
        state = self.state()
        self.assertIn("high: 6", state["text"])
        self.assertEqual(state["undo"], "a change by another program")

    def test_what_the_command_line_says(self):
        fits = self.server.get("/api/pipeline/fits?file=small.yaml&node=edges")
        said = marrow("list", "--fits", self.file, "edges", "--json").stdout
        fits = [{key: one[key] for key in ("node", "fits", "missing", "faults")} for one in fits]
        self.assertEqual(fits, json.loads(said))
        self.file.write_text(PIPELINE.replace("camera.carm", "camera.carn"))
        state = self.state()
        self.assertEqual(state["faults"], json.loads(marrow("check", self.file, "--json").stdout))
        self.assertEqual(state["faults"][0]["line"], 9)
        self.assertIsNone(state["graph"])

    def test_what_cannot_be_run_or_reached(self):
        (self.scratch / "other.yaml").write_text(PIPELINE)
        for file in ("../other.yaml", "/etc/passwd"):
            fault = self.server.fault("/api/pipeline?file=" + file)
            self.assertIn("leads out of the folder that is open", fault)
        self.assertIn("input 'level' has no value", self.fault("plan", inputs={"level": ""}))
        nodes = "nodes: {optimizer: {uses: optimizer.nelder_mead}}\noutputs: {search: optimizer}\n"
        self.file.write_text("marrow: 1\nonly_inside: true\n" + nodes)
        state = self.server.finish(self.post("run", inputs={})["job"])
        self.assertEqual(state["state"], "failed")
        self.assertIn("output 'search' is a function, which no file can hold", state["error"])
        self.assertFalse((self.folder / "runs").exists())

    def test_a_run_writes_what_marrow_run_writes(self):
        started = self.post("run", inputs={"level": "0.5"})
        self.assertEqual(started["command"], "cd %s && marrow run small.yaml level=0.5" % self.folder)
        state = self.server.finish(started["job"])
        self.assertEqual(state["state"], "done", state)
        self.assertEqual((state["result"]["folder"], state["result"]["status"]), ("runs/small", "done"))
        ran, by_hand = self.folder / "runs" / "small", self.scratch / "by_hand"
        self.marrow("run", self.file, "level=0.5", "--out", by_hand, "--quiet", "--no-cache")
        self.marrow("diff", ran, by_hand)
        names = lambda run: sorted(path.name for path in (run / "outputs").rglob("*"))
        self.assertEqual(names(ran), names(by_hand))
        plan = self.post("plan", inputs={"level": "0.5"})
        self.assertEqual((plan["to_run"], plan["may_run"]), (0, 0))
        items = self.look("0.5")["result"][0]["items"]
        self.assertEqual([item["place"] for item in items], ["frontal", "lateral"])
        self.assertEqual([item["parts"][0]["kind"] for item in items], ["picture", "picture"])
        self.assertTrue(items[0]["parts"][0]["picture"].startswith("data:image/webp;base64,"))
        self.assertEqual(self.look("0.500")["state"], "done", "the store has it")
        told = "what 'edges' makes has not been computed yet; run what is stale first"
        self.assertEqual(self.look("0.3")["error"], told)


if __name__ == "__main__":
    unittest.main(verbosity=2)
