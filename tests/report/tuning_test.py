#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What an optimizer tried, on the report's page in headless Chromium.

    tests/report/tuning_test.py     exit code 77: skipped, with the reason
"""
import sys

import synthetic
from page import PageTest, run_tests

FIGURES = [0.5, 0.3, 0.4, 0.2, 0.25]


class TuningTest(PageTest):
    def page(self, **changes):
        data = synthetic.comparison()
        point = lambda i, figure: {"values": [60 + i], "figure": figure, "runs": 6, "failed": 0}
        data["tuning"] = {
            "options": [{"option": "edges.high", "range": [60, 90], "scale": "linear"}],
            "variant": "canny",
            "figure": "mTRE",
            "unit": "mm",
            "failed_as": 20,
            "higher_is_better": False,
            "optimizer": "optimizer.nelder_mead",
            "stopped_because": "steps became small",
            "training_cases": 6,
            "untuned": point(0, 0.45),
            "points": [point(i, figure) for i, figure in enumerate(FIGURES)],
            "best": 3,
            "sentence": "tuned on 6 cases",
            **changes,
        }
        self.browser.open(self.write("tuning", data))
        self.eventually(lambda: len(self.texts("#tuning polyline")), 1)

    def heights(self, selector):
        return self.browser.js(
            "return [...document.querySelector(arguments[0]).points].map((point) => point.y)", selector
        )

    def test_each_point_and_the_best_so_far(self):
        self.page()
        best = self.heights("#tuning polyline")
        self.assertEqual(len(best), 5)
        self.assertEqual(best[1], best[2], "the third point is no better")
        self.assertLess(best[0], best[1], "lower figures lie lower on the page")
        self.assertEqual(best[3], best[4])
        marks = "return [...document.querySelectorAll('#tuning [data-tip]')].map((mark) => mark.dataset.tip)"
        tips = [tip.replace("\u00a0", " ") for tip in self.browser.js(marks)]
        self.assertEqual(tips[3], "point 4: edges.high = 63.0, mTRE 0.200 mm")
        self.assertEqual(len(tips), 5)
        line = self.browser.js("return Number(document.querySelector('#tuning .untuned').getAttribute('y1'))")
        self.assertTrue(best[0] < line < best[1], "the untuned figure lies between the first two points")
        text = self.texts("#tuning p")
        self.assertIn("Tuned on 6 cases.", text)
        self.assertIn("The optimizer ended: steps became small.", text[-1])

    def test_higher_may_be_better(self):
        self.page(higher_is_better=True, best=0)
        self.assertEqual(len(set(self.heights("#tuning polyline"))), 1, "none is better than the first")

    def test_without_tuning_there_is_no_section(self):
        self.browser.open(self.comparison)
        self.assertEqual(self.texts("#tuning"), [])


if __name__ == "__main__":
    sys.exit(run_tests())
