#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page of a comparison in which runs are missing, and what it shows where nothing is known, in headless Chromium:
of how many runs each number is, in which unit, and no number for what is not known.

    tests/tools/report/survivors_test.py     exit code 77: skipped, with the reason
"""
import copy
import sys

from harness import synthetic_figures
from harness.modules import modules
from harness.page import PageTest, run_tests


class SurvivorsTest(PageTest):
    def page(self, change):
        data = copy.deepcopy(self.comparison_data)
        change(data)
        self.browser.open(self.write("changed", data))

    def row(self, number, section="summary", table=0):
        return (
            self.browser.js(
                "return [...document.querySelectorAll('#' + arguments[0] + ' table')][arguments[2]]"
                ".querySelector('tbody tr[data-row=\"' + arguments[1] + '\"]').innerText",
                section,
                number,
                table,
            )
            .replace("\n", " ")
            .replace("\t", " ")
            .replace("\u00a0", " ")
        )

    def test_runs_that_are_missing(self):
        def change(data):
            data["metrics"] = [dict(metric, same_runs=False) for metric in data["metrics"]]
            data["summary"][1].update(incomplete=20, evaluations={"count": 2, "of": 60, "median": 12.5})
            data["summary"][1]["metrics"]["mtre_mm"].update(count=40, of=60)
            data["comparisons"][0].update(
                difference=None, fails_more="variant", low=-0.25, high=None, pairs=40, runs=60, cases=10, of_cases=12
            )
            data["comparisons"][0].update(runs_variant_lost=20, runs_baseline_lost=0)

        self.page(change)
        self.assertIn("40 of 60", self.row(1))
        self.assertTrue(self.row(1).endswith(" 12.5"), "evaluations are counted: " + self.row(1))
        self.assertIn(" + 20 incomplete", self.row(1))
        self.assertIn(
            "The variants have this figure in different runs, so these numbers are not of the same cases and starts.",
            self.texts("#summary .note"),
        )
        words = self.row(0, "paired")
        for part in ("fails more often", "0.250 mm better to a failure", "10 of 12", "40 of 60 lost 20 / 0"):
            self.assertIn(part, words)

    def test_no_interval_where_the_sentence_gives_none(self):
        few = "canny, mTRE: no difference shown: 0.30 mm worse, 5 cases, p = 0.062; fewer than 6 cases cannot reach "
        few += "p < 0.05, and no interval is given"

        def change(data):
            data["comparisons"][0].update(difference=0.3, low=0.125, high=0.5, has_interval=False, sentence=few)
            data["comparisons"][1].update(difference=-0.25, low=-0.5, high=-0.125, has_interval=True)
            data["comparisons"][2].update(difference=-0.008, low=-0.5, high=0.011, has_interval=True)

        self.page(change)
        rows = [self.row(i, "paired") for i in range(3)]
        self.assertIn("0.300 mm worse –", rows[0], "the table gives none either")
        self.assertIn("0.250 mm better 0.125 to 0.500 mm better", rows[1])
        self.assertIn("0.008 mm better 0.011 mm worse to 0.500 mm better", rows[2])
        self.eventually(lambda: len(self.texts("#paired .estimate")), 3)
        self.assertEqual(len(self.texts("#paired .estimate line")), 2, "nor does the figure")

    def test_a_figure_of_which_higher_is_better(self):
        def change(data):
            data["metrics"] = [dict(data["metrics"][0], higher_is_better=True), *data["metrics"][1:]]
            for i, item in enumerate(data["summary"]):
                del item["metrics"]["mtre_mm"]["p95"]
                item["metrics"]["mtre_mm"]["p5"] = 0.125 * (i + 1)
            data["comparisons"][0].update(low=None, high=0.5)
            data["comparisons"][1].update(low=0.5, high=None)

        self.page(change)
        self.assertIn("5th percentile mm", self.texts("#summary th"))
        self.assertNotIn("95th percentile mm", self.texts("#summary th"))
        self.assertIn("0.125", self.row(0))
        self.assertIn("0.250", self.row(1))
        self.assertIn("a failure to 0.500 mm better", self.row(0, "paired"))
        self.assertIn("0.500 mm better to the baseline’s failure", self.row(1, "paired"))

    def test_start_errors_in_degrees(self):
        self.page(lambda data: data.update(initial_error={"name": "start.axial_deg", "unit": "deg"}))
        self.assertIn("start.axial_deg (deg), bins of 2 deg", self.texts("#capture .title"))
        shown = self.browser.js("return document.getElementById('capture').innerText")
        self.assertNotIn("mm", shown)
        self.assertNotIn("mTRE", shown)
        self.assertTrue(all(text.endswith("\u00a0deg") for text in self.texts("#capture .verdicts li")))
        self.assertIn("Start’s error deg", self.texts("#cells th"))

    def test_nothing_is_a_success_without_limits(self):
        def change(data):
            data["metrics"] = [dict(metric, success_below=None) for metric in data["metrics"]]
            for item in data["summary"]:
                item.update(success=None, capture=None)
                item["verdicts"] = {"cells": 60, "silent_failures": None, "caught": None, "false_alarms": None}
                item["seconds"] = {"count": 0, "of": 60}
            for cell in data["cells"]:
                cell["success"] = None

        self.page(change)
        self.assertEqual(self.texts("#capture"), [])
        self.assertNotIn("%", self.row(0))
        heads = self.texts("#summary .leaderboard th")
        self.assertFalse([head for head in heads if head.startswith(("Success", "Time"))], "no column without a value")
        self.assertEqual(self.row(0, table=1).split(), ["adaptive", "relaxation", "–", "–", "–", "60"])
        self.choose("Outcome", "done", "#cells")
        self.assertNotIn("missed", self.texts("#cells option"))
        tips = self.browser.js(
            "return [...document.querySelectorAll('#by-case td [data-tip]')].map((item) => item.dataset.tip)"
        )
        self.assertTrue(all(tip.endswith(" starts have the figure") for tip in tips))

    def test_one_of_many_is_not_0_percent(self):
        def change(data):
            data["summary"][0]["success"] = synthetic_figures.wilson(1, 301)
            data["summary"][1]["success"] = synthetic_figures.wilson(2999, 3000)
            data["summary"][2]["success"] = synthetic_figures.wilson(0, 301)
            data["summary"][3]["success"] = synthetic_figures.wilson(60, 60)

        self.page(change)
        for number, text in enumerate(("0.3 % 1/301", "99.97 % 2999/3000", " 0 % 0/301", "100 % 60/60")):
            self.assertIn(text, self.row(number))
        texts = self.browser.js(
            modules(Verdict="report/page/verdict.js")
            + "return [0.0004, 0.9996, 0, 1, 0.03, 1e-20].map((p) => Verdict.failure(p))"
        )
        self.assertEqual(
            texts,
            ["failure 0.04 %", "failure 99.96 %", "failure 0.0 %", "failure 100 %"]
            + ["failure 3.0 %", "failure 1.0e-18 %"],
        )

    def test_numbers_of_any_size(self):
        sizes = [5e-324, 1e-300, 1e-6, 0, 1e6, 1e300, -1e300]

        def change(data):
            for i, cell in enumerate(cell for cell in data["cells"] if cell["status"] == "done"):
                cell["values"] = [sizes[(i + m) % len(sizes)] for m in range(3)]
            data["summary"][0]["metrics"]["mtre_mm"].update(median=1e-300, q1=5e-324, q3=1e300, p95=1.7e300, worst=0)
            data["comparisons"][0].update(difference=1e-300, low=-1e300, high=1e300)

        self.page(change)
        self.assertIn("1.0e−300 (4.9e−324 to 1.0e+300)", self.row(0))
        self.assertIn("1.7e+300", self.row(0))
        self.assertIn("1.0e−300", self.row(0, "paired"))
        for section in ("distributions", "paired"):
            for text in self.texts("#%s .toolbar button" % section):
                self.press(text, "#" + section)
            lost = self.browser.js(
                "return [...document.querySelectorAll('#' + arguments[0] + ' svg.plot *')].filter((mark) =>"
                " [...mark.attributes].some((one) => /NaN|Infinity/.test(one.value))).map((mark) => mark.outerHTML)",
                section,
            )
            self.assertEqual(lost[:3], [], "marks without a place in " + section)

    def test_points_of_response_curves_say_of_how_many_runs(self):
        def change(data):
            points = [
                {"value": 10, "runs": 8, "of": 8, "middle": 1.0, "low": 0.5, "high": 1.5},
                {"value": 20, "runs": 3, "of": 8, "middle": 2.0},
            ]
            common = {"variant": "", "option": "edges.high", "figure": "mtre_mm", "scale": "linear"}
            data["curves"] = [dict(common, points=points)]

        self.page(change)
        tips = lambda: self.browser.js(
            "return [...document.querySelectorAll('#response svg [data-tip]')].map((item) => item.dataset.tip)"
        )
        self.eventually(
            tips,
            [
                "edges.high = 10.0\nmTRE (mm): 1.00, 95 % interval 0.500 to 1.50\n8 of 8 runs",
                "edges.high = 20.0\nmTRE (mm): 2.00\n3 of 8 runs",
            ],
        )
        self.assertEqual(
            self.texts("#response .note"),
            ["11 of 16 runs have this figure; points without some of theirs are not of the same cases as the others."],
        )


if __name__ == "__main__":
    sys.exit(run_tests(sys.argv[1:]))
