#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The pages that the program writes, in headless Chromium: of a run and of a comparison with a failed cell.

    tests/tools/report/program_test.py     exit code 77: skipped, with the reason
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

from harness import browser

from harness import BUILD, SOURCE

EXPERIMENT = """experiment: 1
name: small
pipeline: %(source)s/pipelines/femur/femur.yaml
cases: {folders: [%(case)s], input: case}
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


class Program(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow-report-"))
        cls.environment = dict(os.environ, MARROW_CACHE=str(cls.folder / "cache"))
        cls.marrow(
            "run",
            SOURCE / "pipelines" / "simulate" / "simulate.yaml",
            "--set",
            "ct.spacing_mm=[1.2, 1.2, 1.5]",
            "--set",
            "ct.range_mm=[0, 300]",
            "--out",
            cls.folder / "made",
            "--quiet",
        )
        cls.case = cls.folder / "made" / "outputs" / "case"
        cls.browser = browser.Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        shutil.rmtree(cls.folder, ignore_errors=True)

    @classmethod
    def marrow(cls, *arguments):
        result = subprocess.run(
            [str(BUILD / "bin" / "marrow"), *map(str, arguments)], capture_output=True, text=True, env=cls.environment
        )
        assert result.returncode == 0, result.stderr
        return result.stdout

    def open(self, page):
        self.browser.open(page)
        faults, asked = self.browser.logs()
        self.assertEqual(faults, [])
        self.assertEqual([url for url in asked if not url.startswith("file://")], [])
        return self.browser.js(
            "return Array.from(document.querySelectorAll('main > section')).map(section => section.id)"
        )

    def check_scene(self):
        """The 3D view opens when it is near, and has what the node gave it: the result, the start and the truth."""
        self.browser.show("scene")
        self.browser.wait("return !!marrow.scene")
        self.assertEqual(
            self.browser.js(
                "return Object.values(JSON.parse(document.getElementById('data').textContent).scenes)[0].poses.map(pose"
                " => pose.name)"
            ),
            ["result", "start", "truth"],
        )
        self.assertEqual(self.browser.logs()[0], [])

    def test_a_run(self):
        run = self.folder / "run"
        self.marrow(
            "run", SOURCE / "pipelines" / "femur" / "femur.yaml", "case=%s" % self.case, "--out", run, "--quiet"
        )
        page = self.marrow("show", run).strip()
        self.assertEqual(page, str(run / "report.html"))
        sections = ["verdict", "summary", "pictures", "scene", "convergence", "landscape", "graph", "repeat"]
        self.assertEqual(self.open(page), sections)
        headings = self.browser.js(
            "return Array.from(document.querySelectorAll('table.figures thead th')).map(cell => cell.textContent)"
        )
        self.assertEqual(headings[:5], ["Figure", "start", "axial", "final", "Unit"])
        self.check_scene()
        self.check_recipe(0, self.marrow("recipe", run))

    def check_recipe(self, variant, recipe):
        """The link opens it."""
        shown = "const shown = document.getElementById('recipe-%d');" % variant
        self.assertFalse(self.browser.js(shown + "return shown.open"))
        self.browser.js("document.querySelectorAll('a.recipe')[%d].click()" % variant)
        self.assertTrue(self.browser.js(shown + "return shown.open"))
        self.assertEqual(self.browser.js(shown + "return shown.querySelector('pre').textContent"), recipe)

    def test_a_comparison(self):
        experiment = self.folder / "small.yaml"
        experiment.write_text(EXPERIMENT % {"source": SOURCE, "case": self.case})
        answer = self.marrow("compare", experiment, "--out", self.folder / "out", "--quiet")
        page = self.folder / "out" / "report.html"
        self.assertIn("report: %s" % page, answer)
        sections = self.open(page)
        for section in (
            "summary",
            "distributions",
            "paired",
            "pictures",
            "scene",
            "convergence",
            "landscape",
            "graph",
            "cells",
            "failures",
            "repeat",
        ):
            self.assertIn(section, sections)
        self.assertIn("no_edges", self.browser.js("return document.getElementById('failures').textContent"))
        self.assertIn(
            "the edge map is empty", self.browser.js("return document.getElementById('failures').textContent")
        )
        self.assertEqual(
            self.browser.js(
                "return Array.from(document.querySelectorAll('#graph .node.differs')).map(node => node.dataset.node)"
            ),
            ["edges"],
        )
        self.check_scene()
        self.check_recipe(1, self.marrow("recipe", page, "--variant", "canny"))
        self.browser.js("document.querySelector('[data-id^=canny]').click()")
        folder = "return document.querySelector('#cell a[href^=cells]').href"
        cell = (self.folder / "out" / "cells" / "canny").resolve()
        self.assertEqual(pathlib.Path(self.browser.js(folder).replace("file://", "")).resolve().parents[1], cell)


if __name__ == "__main__":
    if browser.missing():
        print("skipped: " + browser.missing())
        sys.exit(77)
    unittest.main(verbosity=2)
