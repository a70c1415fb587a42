#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The pages that the program writes, in headless Chromium: of a run and of a comparison with a failed cell.

    tests/tools/report/program_test.py     exit code 77: skipped, with the reason
"""
import pathlib
import shutil
import tempfile

from harness import SOURCE
from harness.cases import FEMUR, SMALL, simulate
from harness.page import BrowserTest, main
from harness.program import marrow

EXPERIMENT = """experiment: 1
name: small
pipeline: %s/pipelines/femur/femur.yaml
cases: {folders: [%s], input: case}
variants:
  as_it_is: {}
  canny: {edges.uses: edges.canny}
  no_edges: {edges.low: 99.9, edges.high: 99.99}
metrics: [errors.distal.final.mtre_mm, errors.distal.final.rotation_deg]
success: {errors.distal.final.mtre_mm: 2}
initial_error: errors.distal.start.mtre_mm
pictures: [overlay]
timed_cells: 1
"""
OF_BOTH = ["summary", "pictures", "scene", "convergence", "landscape", "graph", "repeat"]


class Program(BrowserTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow-report-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.case = simulate(cls.folder / "made", *SMALL)

    def marrow(self, *arguments):
        result = marrow(*arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def open(self, page):
        """The sections of the page."""
        self.browser.open(page)
        faults, asked = self.browser.logs()
        self.assertEqual(faults, [])
        self.assertEqual([url for url in asked if not url.startswith("file://")], [])
        return self.all("main > section", "one.id")

    def check_scene(self):
        """The 3D view opens when it is near, and has what the node gave it: the result, the start and the truth."""
        self.browser.show("scene")
        self.wait("!!marrow.scene")
        poses = self.the("#data", "Object.values(JSON.parse(one.textContent).scenes)[0].poses.map(({name}) => name)")
        self.assertEqual(poses, ["result", "start", "truth"])
        self.assertEqual(self.browser.logs()[0], [])

    def check_recipe(self, variant, recipe):
        """The link opens it."""
        shown = "#recipe-%d" % variant
        self.assertFalse(self.the(shown, "one.open"))
        self.js("document.querySelectorAll('a.recipe')[arguments[0]].click()", variant)
        self.assertTrue(self.the(shown, "one.open"))
        self.assertEqual(self.text(shown + " pre"), recipe)

    def test_a_run(self):
        run = self.folder / "run"
        self.marrow("run", FEMUR, "case=%s" % self.case, "--out", run, "--quiet")
        page = self.marrow("show", run).strip()
        self.assertEqual(page, str(run / "report.html"))
        self.assertEqual(self.open(page), ["verdict", *OF_BOTH])
        headings = self.texts("table.figures thead th")
        self.assertEqual(headings[:5], ["Figure", "start", "axial", "final", "Unit"])
        self.check_scene()
        self.check_recipe(0, self.marrow("recipe", run))

    def test_a_comparison(self):
        experiment = self.folder / "small.yaml"
        experiment.write_text(EXPERIMENT % (SOURCE, self.case))
        answer = self.marrow("compare", experiment, "--out", self.folder / "out", "--quiet")
        page = self.folder / "out" / "report.html"
        self.assertIn("report: %s" % page, answer)
        sections = {*OF_BOTH, "distributions", "paired", "cells", "failures"}
        self.assertEqual(sections - set(self.open(page)), set())
        self.assertIn("no_edges", self.text("#failures"))
        self.assertIn("the edge map is empty", self.text("#failures"))
        self.assertEqual(self.all("#graph .node.differs", "one.dataset.node"), ["edges"])
        self.check_scene()
        self.check_recipe(1, self.marrow("recipe", page, "--variant", "canny"))
        self.the("[data-id^=canny]", "one.click()")
        folder = pathlib.Path(self.the("#cell a[href^=cells]", "one.href").replace("file://", "")).resolve()
        self.assertEqual(folder.parents[1], (self.folder / "out" / "cells" / "canny").resolve())


if __name__ == "__main__":
    main()
