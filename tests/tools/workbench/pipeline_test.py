#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Pipeline", by clicks and keys: graph, text, forms, faults, runs and what nodes made. The graph is moved and
zoomed, the text is completed and follows the chosen node, inputs are kept, and marrow's own pipelines are copied."""
import os
import unittest.mock

from bench import PIPELINE, PageTest, PipelineBench
from harness import TEST_PLUGINS
from harness.page import main

EDITOR = "document.querySelector('.CodeMirror').CodeMirror"


class PipelinePage(PipelineBench, PageTest):
    def show_pipeline(self):
        self.show("pipeline=small.yaml")

    def value(self, selector):
        return self.the(selector, "one.value")

    def editor(self):
        return self.js("return %s.getValue()" % EDITOR)

    def write(self, text):
        """Puts a text into the editor."""
        self.js("%s.setValue(arguments[0])" % EDITOR, text)

    def press_on(self, selector):
        self.the(selector, "one.dispatchEvent(new MouseEvent('click', {bubbles: true}))")

    def wait_for_file(self, text):
        self.until(lambda: text in self.editor(), text)
        self.assertIn(text, self.file.read_text())

    def wait_for_run(self, state):
        self.find("[data-do=run]:not(:disabled)")
        self.do("run")
        self.wait("document.documentElement.dataset.run === '%s'" % state)


class PipelineTest(PipelinePage):
    def test_graph_text_and_form_are_beside_each_other_and_a_node_is_chosen_by_key(self):
        self.show_pipeline()
        drawn = self.all(".graph [data-node]", "one.dataset.node")
        self.assertEqual(sorted(drawn), ["bone", "cameras", "edges", "fracture", "truth", "views"])
        self.assertEqual(self.editor(), PIPELINE)
        tops = [self.browser.box(".pipeline-" + part)[1] for part in ("graph", "text", "node")]
        self.assertEqual(tops, 3 * tops[:1], "beside each other")
        self.browser.key("ENTER", "[data-node=cameras]")
        self.assertEqual(self.value("[data-option=width_px]"), "96")
        self.assertEqual(self.the("[data-option=beta_deg]", "one.placeholder"), "[0, 90]")
        described = "document.getElementById(one.getAttribute('aria-describedby')).textContent"
        about = "size of a pixel on the detector; number, at least 0.001 [mm]; default 0.586"
        self.assertEqual(self.the("[data-option=pixel_mm]", described), about)
        lines = ".CodeMirror-linebackground.chosen-node:not(.CodeMirror-gutter-background)"
        self.assertEqual(self.count(lines), 7, "the lines of the node are marked in the text")
        label = lambda: self.the("[data-node=edges]", "one.getAttribute('aria-label')")
        self.assertEqual(label(), "edges, edges.canny")
        self.set("[data-input=level]", "0.4")
        self.find("[data-do=run]:not(:disabled)")
        self.assertEqual(label(), "edges, edges.canny, may be stale", "names are what is seen")
        self.assertIsNone(self.the("#theme", "one.getAttribute('aria-label')"))
        self.no_faults()

    def test_a_form_changes_the_file_and_keys_take_it_back(self):
        self.show_pipeline()
        self.press_on("[data-node=cameras]")
        self.set("[data-option=width_px]", "80")
        self.wait_for_file("width_px: 80")
        self.assertEqual(self.file.read_text(), PIPELINE.replace("width_px: 96", "width_px: 80"))
        self.the("#page", "one.focus()")
        self.browser.press("z", "KeyZ", 2)
        self.wait_for_file("width_px: 96")
        self.do("redo")
        self.wait_for_file("width_px: 80")
        self.press_on("[data-default=width_px]")
        self.until(lambda: "width_px" not in self.editor())
        self.assertIn("      height_px: 96\n", self.file.read_text())

    def test_faults_are_told(self):
        self.show_pipeline()
        self.press_on("[data-node=cameras]")
        self.set("[data-option=width_px]", "many")
        self.says(".notice.fault", "cameras.width_px = many is not written")
        self.assertEqual(self.file.read_text(), PIPELINE)
        self.assertEqual(self.value("[data-option=width_px]"), "96")
        self.write(PIPELINE.replace("high: 5", "hihg: 5"))
        self.do("save")
        self.find("[data-fault]")
        self.assertIn("line 16:", self.text("[data-fault]"))
        marker = self.the(".CodeMirror-lint-marker", "one.closest('.CodeMirror-gutter-wrapper').textContent")
        self.assertEqual(marker, "16")
        self.assertIn("did you mean 'noise_high'?", self.text(".faults"))
        self.press_on("[data-fault]")
        self.assertIn("hihg: 5", self.js("return %s.getSelection()" % EDITOR))
        self.assertTrue(self.the("[data-do=run]", "one.disabled"))
        self.show("pipeline=nowhere.yaml")
        told = "%s/nowhere.yaml cannot be read: No such file or directory" % self.folder
        self.assertEqual(self.text("#page"), told)

    def test_a_change_elsewhere_shows_here(self):
        self.show_pipeline()
        self.file.write_text(PIPELINE.replace("high: 5", "high: 8"))
        self.wait_for_file("high: 8")
        self.write("mine")
        self.file.write_text(PIPELINE.replace("high: 5", "high: 9"))
        self.says(".notice.fault", "The file was changed elsewhere.")
        self.assertEqual(self.editor(), "mine")
        self.do("discard")
        self.wait_for_file("high: 9")

    def test_another_node_that_fits_takes_the_place(self):
        self.show_pipeline()
        self.press_on("[data-node=edges]")
        self.do("fits")
        self.find("[data-use='edges.adaptive_relaxation']")
        self.press_on("[data-use='edges.adaptive_relaxation']")
        self.wait_for_file("edges: {uses: edges.adaptive_relaxation, in: {view: views}}  # quick")

    def test_run_look_and_find_the_result(self):
        self.show_pipeline()
        self.assertEqual(self.text("[data-do=status]"), "give level to see what is stale")
        self.assertTrue(self.the(".pipeline-inputs", "one.open"), "one is missing")
        self.set("[data-input=level]", "0.4")
        self.find("[data-do=run]:not(:disabled)")
        self.assertEqual(self.text("[data-node=edges] .state"), "may be stale")
        self.assertIn("in.level=0.4", self.js("return location.hash"))
        self.wait_for_run("done")
        self.says("[data-do=status]", "everything is up to date")
        self.assertEqual(self.text("[data-node=edges] .state"), "up to date")
        self.assertEqual(self.text("[data-do=result]"), "runs/small")
        self.assertIn("marrow run small.yaml level=0.4", self.text(".pipeline-commands"))
        self.press_on("[data-node=edges]")
        self.until(lambda: self.count(".outputs img") == 2)
        self.assertEqual(self.the(".outputs img", "one.naturalWidth"), 96)
        self.press_on("[data-node=truth]")
        self.find(".outputs canvas.surface")
        self.assertIn("triangles", self.text(".outputs [data-kind=mesh]"))
        self.no_faults()
        self.server.close()
        self.open()  # another server, at another port
        self.show_pipeline()
        self.assertEqual(self.value("[data-input=level]"), "0.4", "inputs are there again at the next visit")
        self.assertFalse(self.the(".pipeline-inputs", "one.open"))
        self.assertIn("level=0.4", self.text(".pipeline-inputs summary"))

    def test_a_path_is_chosen_in_the_folder_and_a_run_that_fails_says_which_node(self):
        (self.folder / "bones").mkdir()
        (self.folder / "bones" / "a.stl").write_text("no surface")
        self.file.write_text(
            "marrow: 1\ninputs:\n  surface: {type: path, help: a surface}\nnodes:\n"
            "  bone: {uses: read.mesh, with: {path: $surface}}\noutputs: {bone: bone}\n"
        )
        self.show_pipeline()
        self.browser.key("ENTER", "[data-choose-for=surface]")
        for chosen in ("[data-open=bones]", "[data-choose='bones/a.stl']"):
            self.find(chosen)
            self.browser.key("ENTER", chosen)
        self.eventually(lambda: self.value("[data-input=surface]"), "bones/a.stl")
        self.says("body", "run small.yaml surface=bones/a.stl")
        self.press_on("[data-node=bone]")
        self.assertEqual(self.value("[data-option=path]"), "$surface")
        self.wait_for_run("failed")
        self.assertIn("bone: ", self.text(".run-result .reason"))
        self.assertEqual(self.text(".run-result strong"), "Failed")

    def test_a_run_can_be_stopped(self):
        # It would work for 1000 s.
        self.file.write_text("marrow: 1\nnodes:\n  w: {uses: test.work, with: {value: 1000}}\noutputs: {w: w}\n")
        with unittest.mock.patch.dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS)):
            self.show_pipeline()
        self.find("[data-do=run]:not(:disabled)")
        self.do("run")
        self.click("[data-stop]")
        self.wait("document.documentElement.dataset.run === 'stopped'")


class StageTest(PipelinePage):
    """The graph and the text as places to work."""

    def shown(self, node):
        """Whether a node of the graph is in its window."""
        _, top, _, height = self.browser.box(".graph-view")
        _, node_top, _, node_height = self.browser.box("[data-node=%s] rect" % node)
        return top <= node_top and node_top + node_height <= top + height

    def scale(self):
        return self.the("svg.graph", "Number(/scale\\(([^)]+)\\)/.exec(one.style.transform)[1])")

    def test_the_graph_fits_is_zoomed_and_follows_the_focus(self):
        lines = ["marrow: 1", "nodes:"]
        for i in range(40):  # a chain, longer than any screen
            lines.append("  n%d: {uses: volume.bridge_metal, in: {volume: %s}}" % (i, "n%d" % (i - 1) if i else "ct"))
        lines += ["  ct: {uses: read.volume, with: {path: ct.mha}}", "outputs: {n: n39}"]
        self.file.write_text("\n".join(lines) + "\n")
        self.show_pipeline()
        map_is_off = lambda: self.the(".minimap", "one.classList.contains('off')")
        self.assertGreaterEqual(self.scale(), 0.5, "what is shown first can be read")
        self.assertFalse(self.shown("n39"))
        self.assertFalse(map_is_off())
        self.browser.key("ENTER", "[data-node=n39]")
        self.assertTrue(self.shown("n39"), "the graph moves to the node that has the focus")
        self.click("[data-do=fit]")
        self.assertTrue(self.shown("n39") and self.shown("n0"))
        self.assertTrue(map_is_off())
        before = self.scale()
        self.click("[aria-label='Zoom in']")
        self.assertGreater(self.scale(), before)

    def test_the_text_follows_the_chosen_node(self):
        self.file.write_text(PIPELINE.replace("nodes:\n", "nodes:\n" + "  # a long comment\n" * 200))
        self.show_pipeline()
        self.browser.key("ENTER", "[data-node=truth]")
        self.assertGreater(self.count(".chosen-node ~ pre, .chosen-node"), 0)
        self.assertIn("truth:", self.text(".CodeMirror-code"))
        focus = self.js("return document.activeElement.dataset.node")
        self.assertEqual(focus, "truth", "the focus stays at the node in the graph")

    def complete(self, line, text):
        """Puts the text at the end of a line, and returns what is offered there."""
        self.js(
            "const editor = %s, [line, text] = arguments; editor.replaceRange(text, {line, ch: 999}); editor.focus();"
            "editor.setCursor(line + text.split('\\n').length - 1, 999); editor.execCommand('autocomplete')" % EDITOR,
            line,
            text,
        )
        self.find(".CodeMirror-hint")
        offered = self.all(".CodeMirror-hint", "one.firstChild.textContent")
        self.js("%s.closeHint()" % EDITOR)
        return offered

    def test_keys_in_the_text(self):
        self.show_pipeline()
        self.js("%s.focus()" % EDITOR)
        self.browser.press("s", "KeyS", 2)
        self.says("#notices", "nothing to save")
        self.write(PIPELINE.replace("high: 5", "high: 6"))
        self.browser.press("s", "KeyS", 2)
        self.until(lambda: "high: 6" in self.file.read_text())
        self.js("%s.focus(); %s.setCursor(0, 0)" % (EDITOR, EDITOR))
        self.browser.key("?", ":focus")
        self.assertFalse(self.the("#dialog", "one.open"))
        self.assertTrue(self.editor().startswith("?marrow"), "a question mark is typed")
        self.write("mine")
        for _ in range(2):  # the first may end at a scrollbar
            self.browser.key("TAB", ":focus")
        self.assertIn(self.js("return document.activeElement.dataset.do || ''")[:4], ("save", "disc"))
        self.assertEqual(self.editor(), "mine", "Tab leads out of the text")
        self.click("[data-do=discard]")
        self.wait_for_file("high: 6")
        last = PIPELINE.split("\n").index("  truth: {uses: simulate.truth, in: {phantom: fracture}}")
        self.assertEqual(self.complete(last, "\n  more: {uses: edges.ca"), ["edges.canny"])
        self.assertEqual(self.complete(last + 1, "nny, with: {noise_h"), ["noise_high:"])
        self.assertEqual(self.complete(last + 1, "igh: 3}, in: {view: v"), ["views"])
        self.no_faults()

    def test_a_pipeline_of_marrow_is_copied_and_gets_the_case(self):
        (self.folder / "cases" / "7").mkdir(parents=True)
        (self.folder / "cases" / "7" / "case.yaml").write_text("marrow-case: 1\n")
        self.show("case=cases/7")
        self.assertEqual(self.text("#present-case"), "cases/7")
        self.click("#pages [data-page=pipeline]")
        self.wait_for_page("pipeline")
        self.click("[data-copy='femur/femur-best']")
        self.wait("location.hash === '#pipeline=femur-best.yaml'")
        self.find("[data-input=case]")
        self.assertEqual((self.text(".faults"), self.value("[data-input=case]")), ("", "cases/7"))
        self.assertIn("extends:", (self.folder / "femur-best.yaml").read_text())
        self.click("#pages [data-page=pipeline]")
        self.find("[data-own='femur/femur-best'] a")
        for name, told in (
            ("femur/femur-best", "femur-best.yaml exists in this folder already; open it, or rename it first"),
            ("../x", "marrow has no pipeline '../x' of its own"),
        ):
            self.assertEqual(self.server.fault("/api/pipeline/copy", {"name": name}), told)


if __name__ == "__main__":
    main(part=5)
