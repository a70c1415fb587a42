#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Pipeline": graph, text, forms, faults, runs and what nodes made, by clicks and keys."""
import json
import os
import subprocess
import unittest
import unittest.mock

import bench
from bench import MARROW, BenchTest, PageTest

from harness import TEST_PLUGINS

PIPELINE = """\
marrow: 1
name: small
inputs:
  level: {type: number, help: height of the fracture}
nodes:
  bone: {uses: simulate.femur}
  fracture: {uses: simulate.fracture, in: {bone: bone}, with: {height_fraction: $level}}
  cameras:   # two views
    uses: camera.carm
    with:
      names: [frontal, lateral]   # as in the clinic
      width_px: 96
      height_px: 96
      pixel_mm: 3
  views: {uses: simulate.fluoroscopy, in: {phantom: fracture, cameras: cameras}}
  edges: {uses: edges.canny, in: {view: views}, with: {noise_high: 5}}  # quick
  truth: {uses: simulate.truth, in: {phantom: fracture}}
outputs: {cameras: cameras, edges: edges, model: truth.models}
"""


class PipelineBench(BenchTest):
    def setUp(self):
        super().setUp()
        self.file = self.folder / "small.yaml"
        self.file.write_text(PIPELINE)


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


class PipelinePageTest(PageTest, PipelineBench):
    """The page in a browser."""

    def setUp(self):
        super().setUp()
        self.js = self.browser.js

    def show_pipeline(self, more="", **size):
        self.server = self.open()
        self.show(self.server, "pipeline=small.yaml" + more, **size)
        self.browser.logs()

    def value(self, selector):
        return self.js("return document.querySelector(arguments[0]).value", selector)

    def text_of(self, selector):
        return self.js("return document.querySelector(arguments[0]).textContent", selector)

    def type(self, selector, text):
        """Puts a text into a field, and leaves it."""
        self.js(
            "const box = document.querySelector(arguments[0]); box.focus(); box.value = arguments[1];"
            "box.dispatchEvent(new Event('input', {bubbles: true}));"
            "box.dispatchEvent(new Event('change', {bubbles: true}))",
            selector,
            text,
        )

    def click(self, selector):
        self.js(
            "document.querySelector(arguments[0]).dispatchEvent(new MouseEvent('click', {bubbles: true}))", selector
        )

    def wait_for_file(self, text):
        self.browser.wait("return document.querySelector('[data-do=text]').value.includes(%s)" % json.dumps(text), 60)
        self.assertIn(text, self.file.read_text())

    def test_graph_and_text_are_beside_each_other_and_a_node_is_chosen_by_key(self):
        self.show_pipeline()
        drawn = self.js("return [...document.querySelectorAll('.graph [data-node]')].map((g) => g.dataset.node)")
        self.assertEqual(sorted(drawn), ["bone", "cameras", "edges", "fracture", "truth", "views"])
        self.assertEqual(self.value("[data-do=text]"), PIPELINE)
        boxes = self.js(
            "return ['graph', 'text'].map((s) => document.querySelector('.pipeline-' + s).getBoundingClientRect().top)"
        )
        self.assertEqual(boxes[0], boxes[1])
        self.browser.key("ENTER", "[data-node=cameras]")
        self.assertEqual(self.value("[data-option=width_px]"), "96")
        self.assertEqual(self.js("return document.querySelector('[data-option=beta_deg]').placeholder"), "[0, 90]")
        about = self.js(
            "const box = document.querySelector('[data-option=pixel_mm]');"
            "return document.getElementById(box.getAttribute('aria-describedby')).textContent"
        )
        self.assertEqual(about, "size of a pixel on the detector; number, at least 0.001 [mm]; default 0.586")

    def test_a_form_changes_the_file_and_keys_take_it_back(self):
        self.show_pipeline()
        self.click("[data-node=cameras]")
        self.type("[data-option=width_px]", "80")
        self.wait_for_file("width_px: 80")
        self.assertEqual(self.file.read_text(), PIPELINE.replace("width_px: 96", "width_px: 80"))
        self.js("document.querySelector('#page').focus()")
        self.browser.driver.execute_cdp_cmd(
            "Input.dispatchKeyEvent", {"type": "keyDown", "modifiers": 2, "key": "z", "code": "KeyZ"}
        )
        self.wait_for_file("width_px: 96")
        self.click("[data-do=redo]")
        self.wait_for_file("width_px: 80")
        self.click("[data-default=width_px]")
        self.browser.wait("return !document.querySelector('[data-do=text]').value.includes('width_px')", 60)
        self.assertIn("      height_px: 96\n", self.file.read_text())

    def test_a_fault_of_the_form_is_told_and_nothing_is_written(self):
        self.show_pipeline()
        self.click("[data-node=cameras]")
        self.type("[data-option=width_px]", "many")
        self.browser.wait("return !!document.querySelector('.notice.fault')", 60)
        self.assertIn("cameras.width_px = many is not written", self.text_of(".notice.fault"))
        self.assertEqual(self.file.read_text(), PIPELINE)
        self.assertEqual(self.value("[data-option=width_px]"), "96")

    def test_faults_are_shown_at_their_lines(self):
        self.show_pipeline()
        self.type("[data-do=text]", PIPELINE.replace("high: 5", "hihg: 5"))
        self.click("[data-do=save]")
        self.browser.wait("return !!document.querySelector('[data-fault]')", 60)
        self.assertIn("line 16:", self.text_of("[data-fault]"))
        self.assertEqual(self.text_of(".gutter .bad").strip(), "● 16")
        self.assertIn("did you mean 'noise_high'?", self.text_of(".faults"))
        self.click("[data-fault]")
        chosen = self.js(
            "const box = document.activeElement; return box.value.slice(box.selectionStart, box.selectionEnd)"
        )
        self.assertIn("hihg: 5", chosen)
        self.assertTrue(self.js("return document.querySelector('[data-do=run]').disabled"))

    def test_a_file_that_is_not_there_is_told(self):
        self.server = self.open()
        self.show(self.server, "pipeline=nowhere.yaml")
        self.assertEqual(
            self.text_of("#page"), "%s/nowhere.yaml cannot be read: No such file or directory" % self.folder
        )
        self.browser.logs()

    def test_a_change_elsewhere_shows_here(self):
        self.show_pipeline()
        self.file.write_text(PIPELINE.replace("high: 5", "high: 8"))
        self.wait_for_file("high: 8")
        self.type("[data-do=text]", "mine")
        self.file.write_text(PIPELINE.replace("high: 5", "high: 9"))
        self.browser.wait("return !!document.querySelector('.notice.fault')", 60)
        self.assertIn("The file was changed elsewhere.", self.text_of(".notice.fault"))
        self.assertEqual(self.value("[data-do=text]"), "mine")
        self.click("[data-do=discard]")
        self.wait_for_file("high: 9")

    def test_another_node_that_fits_takes_the_place(self):
        self.show_pipeline()
        self.click("[data-node=edges]")
        self.click("[data-do=fits]")
        self.browser.wait("return !!document.querySelector('[data-use=\"edges.adaptive_relaxation\"]')", 120)
        self.click("[data-use='edges.adaptive_relaxation']")
        self.wait_for_file("edges: {uses: edges.adaptive_relaxation, in: {view: views}}  # quick")

    def test_run_look_and_find_the_result(self):
        self.show_pipeline()
        self.assertEqual(self.text_of("[data-do=status]"), "give level to see what is stale")
        self.type("[data-input=level]", "0.4")
        self.browser.wait("return !document.querySelector('[data-do=run]').disabled", 60)
        self.assertEqual(self.text_of("[data-node=edges] .state"), "may be stale")
        self.assertIn("in.level=0.4", self.js("return location.hash"))
        self.click("[data-do=run]")
        self.browser.wait("return document.documentElement.dataset.run === 'done'", 300)
        self.browser.wait(
            "return document.querySelector('[data-do=status]').textContent === 'everything is up to date'", 60
        )
        self.assertEqual(self.text_of("[data-node=edges] .state"), "up to date")
        self.assertEqual(self.text_of("[data-do=result]"), "runs/small")
        self.assertIn("marrow run small.yaml level=0.4", self.text_of(".pipeline-commands"))
        self.click("[data-node=edges]")
        self.browser.wait("return document.querySelectorAll('.outputs img').length === 2", 60)
        self.assertEqual(self.js("return document.querySelector('.outputs img').naturalWidth"), 96)
        self.click("[data-node=truth]")
        self.browser.wait("return !!document.querySelector('.outputs canvas.surface')", 60)
        self.assertIn("triangles", self.text_of(".outputs [data-kind=mesh]"))
        self.assertEqual(self.browser.logs()[0], [])

    def test_a_path_is_chosen_in_the_folder(self):
        (self.folder / "bones").mkdir()
        (self.folder / "bones" / "a.stl").write_text("")
        self.file.write_text(
            "marrow: 1\ninputs:\n  surface: {type: path, help: a surface}\nnodes:\n"
            "  bone: {uses: read.mesh, with: {path: $surface}}\noutputs: {bone: bone}\n"
        )
        self.show_pipeline()
        self.browser.key("ENTER", "[data-choose-for=surface]")
        self.browser.wait("return !!document.querySelector('[data-open=bones]')", 60)
        self.browser.key("ENTER", "[data-open=bones]")
        self.browser.wait("return !!document.querySelector('[data-choose=\"bones/a.stl\"]')", 60)
        self.browser.key("ENTER", "[data-choose='bones/a.stl']")
        self.browser.wait("return document.querySelector('[data-input=surface]').value === 'bones/a.stl'", 60)
        self.browser.wait("return document.body.textContent.includes('run small.yaml surface=bones/a.stl')", 60)
        self.click("[data-node=bone]")
        self.assertEqual(self.value("[data-option=path]"), "$surface")

    def test_a_run_that_fails_says_which_node(self):
        (self.folder / "a.stl").write_text("no surface")
        self.file.write_text(
            "marrow: 1\nnodes:\n  bone: {uses: read.mesh, with: {path: a.stl}}\noutputs: {bone: bone}\n"
        )
        self.show_pipeline()
        self.browser.wait("return !document.querySelector('[data-do=run]').disabled", 60)
        self.click("[data-do=run]")
        self.browser.wait("return document.documentElement.dataset.run === 'failed'", 60)
        self.assertIn("bone: ", self.text_of(".run-result .reason"))
        self.assertEqual(self.text_of(".run-result strong"), "Failed")

    def test_a_run_can_be_stopped(self):
        # It would work for 1000 s.
        self.file.write_text("marrow: 1\nnodes:\n  w: {uses: test.work, with: {value: 1000}}\noutputs: {w: w}\n")
        with unittest.mock.patch.dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS)):
            self.show_pipeline()
        self.browser.wait("return !document.querySelector('[data-do=run]').disabled", 60)
        self.click("[data-do=run]")
        self.browser.wait("return !!document.querySelector('[data-stop]')", 60)
        self.click("[data-stop]")
        self.browser.wait("return document.documentElement.dataset.run === 'stopped'", 300)

    def test_no_width_cuts_anything_off(self):
        for width_px in (1440, 1024, 400):
            self.show_pipeline(width_px=width_px)
            self.click("[data-node=cameras]")
            self.assertEqual(
                self.js("return document.documentElement.scrollWidth <= innerWidth"), True, "at %d px" % width_px
            )
            self.server.close()


if __name__ == "__main__":
    bench.main()
