#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Pipeline": graph, text, forms, faults, runs and what nodes made, by clicks and keys."""
import json
import os
import unittest
import unittest.mock

import bench

from harness import TEST_PLUGINS

from pipeline_bench import PIPELINE, PipelinePage


class PipelinePageTest(PipelinePage):
    """The page in a browser."""

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

    def text(self):
        """The text in the editor."""
        return self.js("return document.querySelector('.CodeMirror').CodeMirror.getValue()")

    def edit(self, text):
        """Puts a text into the editor."""
        self.js("document.querySelector('.CodeMirror').CodeMirror.setValue(arguments[0])", text)

    def click(self, selector):
        self.js(
            "document.querySelector(arguments[0]).dispatchEvent(new MouseEvent('click', {bubbles: true}))", selector
        )

    def wait_for_file(self, text):
        self.browser.wait(
            "return document.querySelector('.CodeMirror').CodeMirror.getValue().includes(%s)" % json.dumps(text), 60
        )
        self.assertIn(text, self.file.read_text())

    def test_graph_text_and_form_are_beside_each_other_and_a_node_is_chosen_by_key(self):
        self.show_pipeline()
        drawn = self.js("return [...document.querySelectorAll('.graph [data-node]')].map((g) => g.dataset.node)")
        self.assertEqual(sorted(drawn), ["bone", "cameras", "edges", "fracture", "truth", "views"])
        self.assertEqual(self.text(), PIPELINE)
        tops = self.js(
            "return ['graph', 'text', 'node'].map("
            "(s) => document.querySelector('.pipeline-' + s).getBoundingClientRect().top)"
        )
        self.assertEqual(tops, 3 * tops[:1], "beside each other")
        self.browser.key("ENTER", "[data-node=cameras]")
        self.assertEqual(self.value("[data-option=width_px]"), "96")
        self.assertEqual(self.js("return document.querySelector('[data-option=beta_deg]').placeholder"), "[0, 90]")
        about = self.js(
            "const box = document.querySelector('[data-option=pixel_mm]');"
            "return document.getElementById(box.getAttribute('aria-describedby')).textContent"
        )
        self.assertEqual(about, "size of a pixel on the detector; number, at least 0.001 [mm]; default 0.586")
        marked = self.js(
            "return document.querySelectorAll('.CodeMirror-linebackground.chosen-node"
            ":not(.CodeMirror-gutter-background)').length"
        )
        self.assertEqual(marked, 7, "the lines of the node are marked in the text")

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
        self.browser.wait(
            "return !document.querySelector('.CodeMirror').CodeMirror.getValue().includes('width_px')", 60
        )
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
        self.edit(PIPELINE.replace("high: 5", "hihg: 5"))
        self.click("[data-do=save]")
        self.browser.wait("return !!document.querySelector('[data-fault]')", 60)
        self.assertIn("line 16:", self.text_of("[data-fault]"))
        marker = (
            "return document.querySelector('.CodeMirror-lint-marker').closest('.CodeMirror-gutter-wrapper').textContent"
        )
        self.assertEqual(self.js(marker), "16")
        self.assertIn("did you mean 'noise_high'?", self.text_of(".faults"))
        self.click("[data-fault]")
        self.assertIn("hihg: 5", self.js("return document.querySelector('.CodeMirror').CodeMirror.getSelection()"))
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
        self.edit("mine")
        self.file.write_text(PIPELINE.replace("high: 5", "high: 9"))
        self.browser.wait("return !!document.querySelector('.notice.fault')", 60)
        self.assertIn("The file was changed elsewhere.", self.text_of(".notice.fault"))
        self.assertEqual(self.text(), "mine")
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
