#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page "Pipeline" as a place to work: the graph is moved and zoomed, the text is completed and follows the chosen
node, inputs are kept, and marrow's own pipelines are copied into the folder."""
import time

import bench

from pipeline_bench import PIPELINE, PipelinePage

EDITOR = "document.querySelector('.CodeMirror').CodeMirror"
SCALE = "return Number(/scale\\(([^)]+)\\)/.exec(document.querySelector('svg.graph').style.transform)[1])"


class PipelineStageTest(PipelinePage):
    def tearDown(self):
        self.assertEqual([one for one in self.browser.logs()[0] if "/api/pipeline/copy" not in one], [])

    def ctrl(self, key, code):
        self.browser.driver.execute_cdp_cmd(
            "Input.dispatchKeyEvent", {"type": "keyDown", "modifiers": 2, "key": key, "code": code}
        )

    def test_the_graph_fits_is_zoomed_and_follows_the_focus(self):
        lines = ["marrow: 1", "nodes:"]
        for i in range(40):  # a chain, longer than any screen
            lines.append("  n%d: {uses: volume.bridge_metal, in: {volume: %s}}" % (i, "n%d" % (i - 1) if i else "ct"))
        lines += ["  ct: {uses: read.volume, with: {path: ct.mha}}", "outputs: {n: n39}"]
        self.file.write_text("\n".join(lines) + "\n")
        self.show_pipeline()
        inside = (
            "const box = document.querySelector('.graph-view').getBoundingClientRect();"
            "const one = document.querySelector('[data-node=%s] rect').getBoundingClientRect();"
            "return one.top >= box.top && one.bottom <= box.bottom"
        )
        self.assertGreaterEqual(self.js(SCALE), 0.5, "what is shown first can be read")
        self.assertFalse(self.js(inside % "n39"))
        self.assertFalse(self.js("return document.querySelector('.minimap').classList.contains('off')"))
        self.browser.key("ENTER", "[data-node=n39]")
        self.assertTrue(self.js(inside % "n39"), "the graph moves to the node that has the focus")
        self.click("[data-do=fit]")
        self.assertTrue(self.js(inside % "n39") and self.js(inside % "n0"))
        self.assertTrue(self.js("return document.querySelector('.minimap').classList.contains('off')"))
        before = self.js(SCALE)
        self.click("[aria-label='Zoom in']")
        self.assertGreater(self.js(SCALE), before)

    def test_the_text_follows_the_chosen_node(self):
        self.file.write_text(PIPELINE.replace("nodes:\n", "nodes:\n" + "  # a long comment\n" * 200))
        self.show_pipeline()
        self.browser.key("ENTER", "[data-node=truth]")
        shown = self.js("return [...document.querySelectorAll('.chosen-node ~ pre, .chosen-node')].length")
        self.assertGreater(shown, 0)
        self.assertIn("truth:", self.js("return document.querySelector('.CodeMirror-code').textContent"))
        self.assertEqual(
            self.js("return document.activeElement.dataset.node"), "truth", "the focus stays at the node in the graph"
        )

    def complete(self, line, text):
        """Puts the text at the end of a line, and returns what is offered there."""
        self.js(
            "%s.replaceRange(arguments[1], {line: arguments[0], ch: 999}); %s.focus();"
            "%s.setCursor(arguments[0] + arguments[1].split('\\n').length - 1, 999);"
            "%s.execCommand('autocomplete')" % ((EDITOR,) * 4),
            line,
            text,
        )
        self.browser.wait("return !!document.querySelector('.CodeMirror-hint')", 30)
        return self.js(
            "return [...document.querySelectorAll('.CodeMirror-hint')].map((one) => one.firstChild.textContent)"
        )

    def test_words_are_completed_from_the_catalogue(self):
        self.show_pipeline()
        lines = PIPELINE.split("\n")
        last = next(i for i, line in enumerate(lines) if line.startswith("  truth:"))
        offered = self.complete(last, "\n  more: {uses: edges.ca")
        self.assertEqual(offered, ["edges.canny"])
        self.js("%s.closeHint()" % EDITOR)
        offered = self.complete(last + 1, "nny, with: {noise_h")
        self.assertEqual(offered, ["noise_high:"])
        self.js("%s.closeHint()" % EDITOR)
        offered = self.complete(last + 1, "igh: 3}, in: {view: v")
        self.assertEqual(offered, ["views"])

    def test_ctrl_s_saves_the_text_and_says_when_there_is_nothing_to_save(self):
        self.show_pipeline()
        self.js("%s.focus()" % EDITOR)
        self.ctrl("s", "KeyS")
        self.browser.wait("return document.getElementById('notices').textContent.includes('nothing to save')", 30)
        self.js("%s.setValue(arguments[0])" % EDITOR, PIPELINE.replace("high: 5", "high: 6"))
        self.ctrl("s", "KeyS")
        end = time.monotonic() + 60
        while "high: 6" not in self.file.read_text() and time.monotonic() < end:
            time.sleep(0.05)
        self.assertIn("high: 6", self.file.read_text())

    def test_names_are_what_is_seen(self):
        self.show_pipeline()
        label = "return document.querySelector('[data-node=edges]').getAttribute('aria-label')"
        self.assertEqual(self.js(label), "edges, edges.canny")
        self.find("[data-input=level]").send_keys("0.4\t")
        self.browser.wait("return !document.querySelector('[data-do=run]').disabled", 60)
        self.assertEqual(self.js(label), "edges, edges.canny, may be stale")
        self.assertIsNone(self.js("return document.getElementById('theme').getAttribute('aria-label')"))

    def test_a_question_mark_in_the_text_is_typed(self):
        self.show_pipeline()
        self.js("%s.focus()" % EDITOR)
        self.browser.key("?", ":focus")
        self.assertEqual(self.js("return document.getElementById('dialog').open"), False)
        self.assertTrue(self.js("return %s.getValue()" % EDITOR).startswith("?marrow"))
        self.click("[data-do=discard]")

    def test_tab_leads_out_of_the_text(self):
        self.show_pipeline()
        self.js("%s.setValue('mine'); %s.focus()" % (EDITOR, EDITOR))
        for _ in range(2):  # the first may end at a scrollbar
            self.browser.key("TAB", ":focus")
        self.assertEqual(self.js("return document.activeElement.dataset.do || ''")[:4] in ("save", "disc"), True)
        self.assertEqual(self.js("return %s.getValue()" % EDITOR), "mine")
        self.click("[data-do=discard]")

    def test_inputs_are_there_again_at_the_next_visit(self):
        self.show_pipeline()
        self.assertEqual(self.js("return document.querySelector('.pipeline-inputs').open"), True, "one is missing")
        self.find("[data-input=level]").send_keys("0.4\t")
        self.browser.wait("return !document.querySelector('[data-do=run]').disabled", 60)
        self.server.close()
        self.show_pipeline()  # another server, at another port
        self.assertEqual(self.js("return document.querySelector('[data-input=level]').value"), "0.4")
        self.assertEqual(self.js("return document.querySelector('.pipeline-inputs').open"), False)
        self.assertIn("level=0.4", self.js("return document.querySelector('.pipeline-inputs summary').textContent"))

    def test_a_pipeline_of_marrow_is_copied_and_gets_the_case(self):
        (self.folder / "cases" / "7").mkdir(parents=True)
        (self.folder / "cases" / "7" / "case.yaml").write_text("marrow-case: 1\n")
        self.server = self.open()
        self.show(self.server, "case=cases/7")
        self.assertEqual(self.js("return document.getElementById('present-case').textContent"), "cases/7")
        self.browser.logs()
        self.click("#pages [data-page=pipeline]")
        self.wait_for_page("pipeline")
        self.click("[data-copy='femur/femur-best']")
        self.browser.wait("return location.hash === '#pipeline=femur-best.yaml'", 60)
        self.browser.wait("return !!document.querySelector('[data-input=case]')", 60)
        self.assertEqual(self.js("return document.querySelector('.faults').textContent"), "")
        self.assertEqual(self.js("return document.querySelector('[data-input=case]').value"), "cases/7")
        self.assertIn("extends:", (self.folder / "femur-best.yaml").read_text())
        self.click("#pages [data-page=pipeline]")
        self.browser.wait("return !!document.querySelector('[data-own=\"femur/femur-best\"] a')", 60)
        answer = self.server_error("femur/femur-best")
        self.assertEqual(answer, "femur-best.yaml exists in this folder already; open it, or rename it first")
        self.assertEqual(self.server_error("../x"), "marrow has no pipeline '../x' of its own")

    def server_error(self, name):
        return self.browser.driver.execute_async_script(
            "fetch('api/pipeline/copy', {method: 'POST', body: JSON.stringify({name: arguments[0]}),"
            "headers: {'Content-Type': 'application/json', 'X-Marrow': '1'}})"
            ".then((answer) => answer.json()).then((answer) => { arguments[1](answer.error); })",
            name,
        )


if __name__ == "__main__":
    bench.main()
