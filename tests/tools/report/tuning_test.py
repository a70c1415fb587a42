#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What an optimizer tried, on the report's page in headless Chromium.

    tests/tools/report/tuning_test.py     exit code 77: skipped, with the reason
"""
import re
import sys

from harness import synthetic
from harness.page import PageTest, run_tests

SCORES = [0.5, 0.3, 0.4, 0.2, 0.25]


def point(i, score, **changes):
    return {"values": [60 + i], "score": score, "mean": score, "runs": 6, "failed": 0, "capped": 0, **changes}


class TuningTest(PageTest):
    def page(self, **changes):
        data = synthetic.comparison()
        data["tuning"] = {
            "options": [{"option": "edges.high", "range": [60, 90], "scale": "linear"}],
            "variant": "canny",
            "figure": "mTRE",
            "unit": "mm",
            "failed_as": 20,
            "score_rule": "mean mTRE with failed and worse runs counted as 20 mm",
            "higher_is_better": False,
            "optimizer": "optimizer.nelder_mead",
            "stopped_because": "steps became small",
            "training_cases": 6,
            "untuned": point(0, 0.45),
            "points": [point(i, score) for i, score in enumerate(SCORES)],
            "best": 3,
            "sentence": "tuned on 6 cases",
            **changes,
        }
        self.browser.open(self.write("tuning", data))
        self.eventually(lambda: len(self.texts("#tuning path.line")), 1)

    def heights(self, selector):
        path = self.browser.js("return document.querySelector(arguments[0]).getAttribute('d')", selector)
        return [float(y) for y in re.findall(r"[ML][\d.]+,([\d.]+)", path)]

    def tips(self):
        marks = "return [...document.querySelectorAll('#tuning svg [data-tip]')].map((mark) => mark.dataset.tip)"
        return [tip.replace("\u00a0", " ") for tip in self.browser.js(marks)]

    def axis_titles(self):
        return [text for text in self.texts("#tuning svg text") if text == "points tried" or text.startswith("score")]

    def test_each_point_and_the_best_so_far(self):
        self.page()
        best = self.heights("#tuning path.line")
        self.assertEqual(len(best), 5)
        self.assertEqual(best[1], best[2], "the third point is no better")
        self.assertLess(best[0], best[1], "lower figures lie lower on the page")
        self.assertEqual(best[3], best[4])
        tips = self.tips()
        self.assertEqual(tips[3], "point 4: edges.high = 63.0; score 0.200 mm; mean mTRE 0.200 mm of 6 runs")
        self.assertEqual(len(tips), 5)
        line = self.browser.js("return Number(document.querySelector('#tuning .untuned').getAttribute('y1'))")
        self.assertTrue(best[0] < line < best[1], "the untuned score lies between the first two points")
        text = self.texts("#tuning p")
        self.assertIn("Tuned on 6 cases.", text)
        self.assertIn(
            "The optimizer ended: steps became small. Score: mean mTRE with failed and worse runs counted as 20 mm.",
            text,
        )
        self.assertIn("the large mark is the chosen one", self.texts("#tuning")[0])
        self.assertEqual(self.axis_titles(), ["points tried", "score (mm)"], "a capped mean is not called a mean")

    def test_a_point_says_what_its_score_is_made_of(self):
        """Six runs: 1, 5, 30 and 140 mm, and two that failed. By hand: (1 + 5 + 4 * 20) / 6 = 14.33 is the score, and
        (1 + 5 + 30 + 140) / 4 = 44 the mean."""
        refused = {"runs": 0, "mean": None, "refused": "'low' must not be above 'high'"}
        self.page(
            points=[
                point(0, 86 / 6, mean=44, failed=2, capped=2),
                point(1, 20, mean=None, failed=6),
                point(2, 20, **refused),
            ],
            best=0,
        )
        self.assertEqual(
            [tip.split("; ", 1)[1] for tip in self.tips()],
            [
                "score 14.3 mm; mean mTRE 44.0 mm of 4 of 6 runs, 2 failed or without the figure, "
                "2 worse than 20.0 mm",
                "score 20.0 mm; no figure in any of 6 runs",
                "score 20.0 mm; refused by the pipeline: 'low' must not be above 'high'",
            ],
        )

    def test_no_mark_is_large_if_no_point_was_chosen(self):
        self.page(points=[point(i, 20, mean=None, failed=6) for i in range(3)], best=None)
        self.assertIn("none was chosen", self.texts("#tuning")[0])
        self.assertEqual(len(self.tips()), 3)
        sizes = self.browser.js(
            "return [...document.querySelectorAll('#tuning svg [data-tip]')].map((mark) => mark.getBBox().width)"
        )
        self.assertEqual(len(set(sizes)), 1)

    def test_higher_may_be_better(self):
        self.page(higher_is_better=True, best=0)
        self.assertEqual(len(set(self.heights("#tuning path.line"))), 1, "none is better than the first")

    def test_without_tuning_there_is_no_section(self):
        self.browser.open(self.comparison)
        self.assertEqual(self.texts("#tuning"), [])


if __name__ == "__main__":
    sys.exit(run_tests())
