#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the report of a comparison says in numbers, in headless Chromium: of how many runs each number is, in which
unit, and no number for what is not known; ranking, all pairs and effects of factors; response curves of a sweep; and
what an optimizer tried.

    tests/tools/report/comparisons_test.py     exit code 77: skipped, with the reason
"""
import re

from harness import synthetic_figures
from harness.modules import modules
from harness.page import ReportTest, made, main


class SurvivorsTest(ReportTest):
    """Runs that are missing."""

    def row(self, number, section="summary", table=0):
        rows = self.all("#%s table" % section, "one.querySelector('tbody tr[data-row=\"%s\"]')?.innerText" % number)
        return re.sub("[\n\t\u00a0]", " ", rows[table])

    def test_runs_that_are_missing(self):
        def change(data):
            data["metrics"] = [dict(metric, same_runs=False) for metric in data["metrics"]]
            data["summary"][1].update(incomplete=20, evaluations={"count": 2, "of": 60, "median": 12.5})
            data["summary"][1]["metrics"]["mtre_mm"].update(count=40, of=60)
            lost = {"pairs": 40, "runs": 60, "cases": 10, "of_cases": 12, "runs_variant_lost": 20}
            data["comparisons"][0].update(lost, difference=None, fails_more="variant", low=-0.25, high=None)
            data["comparisons"][0].update(runs_baseline_lost=0)

        self.show_changed(change)
        self.assertIn("40 of 60", self.row(1))
        self.assertTrue(self.row(1).endswith(" 12.5"), "evaluations are counted: " + self.row(1))
        self.assertIn(" + 20 incomplete", self.row(1))
        note = "The variants have this figure in different runs, so these numbers are not of the same cases and starts."
        self.assertIn(note, self.texts("#summary .note"))
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

        self.show_changed(change)
        rows = [self.row(i, "paired") for i in range(3)]
        self.assertIn("0.300 mm worse –", rows[0], "the table gives none either")
        self.assertIn("0.250 mm better 0.125 to 0.500 mm better", rows[1])
        self.assertIn("0.008 mm better 0.011 mm worse to 0.500 mm better", rows[2])
        self.eventually(lambda: self.count("#paired .estimate"), 3)
        self.assertEqual(self.count("#paired .estimate line"), 2, "nor does the figure")

    def test_a_figure_of_which_higher_is_better(self):
        def change(data):
            data["metrics"][0]["higher_is_better"] = True
            for i, item in enumerate(data["summary"]):
                del item["metrics"]["mtre_mm"]["p95"]
                item["metrics"]["mtre_mm"]["p5"] = 0.125 * (i + 1)
            data["comparisons"][0].update(low=None, high=0.5)
            data["comparisons"][1].update(low=0.5, high=None)

        self.show_changed(change)
        self.assertIn("5th percentile mm", self.texts("#summary th"))
        self.assertNotIn("95th percentile mm", self.texts("#summary th"))
        self.assertIn("0.125", self.row(0))
        self.assertIn("0.250", self.row(1))
        self.assertIn("a failure to 0.500 mm better", self.row(0, "paired"))
        self.assertIn("0.500 mm better to the baseline’s failure", self.row(1, "paired"))

    def test_start_errors_in_degrees(self):
        self.show_changed(lambda data: data.update(initial_error={"name": "start.axial_deg", "unit": "deg"}))
        self.assertIn("start.axial_deg (deg), bins of 2 deg", self.texts("#capture .title"))
        shown = self.the("#capture", "one.innerText")
        self.assertNotIn("mm", shown)
        self.assertNotIn("mTRE", shown)
        self.assertTrue(all(text.endswith("\u00a0deg") for text in self.texts("#capture .verdicts li")))
        self.assertIn("Start’s error deg", self.texts("#cells th"))

    def test_nothing_is_a_success_without_limits(self):
        def change(data):
            for metric in data["metrics"]:
                metric["success_below"] = None
            for item in data["summary"]:
                verdicts = {"cells": 60, "silent_failures": None, "caught": None, "false_alarms": None}
                item.update(success=None, capture=None, verdicts=verdicts, seconds={"count": 0, "of": 60})
            for cell in data["cells"]:
                cell["success"] = None

        self.show_changed(change)
        self.assertEqual(self.count("#capture"), 0)
        self.assertNotIn("%", self.row(0))
        heads = self.texts("#summary .leaderboard th")
        self.assertFalse([head for head in heads if head.startswith(("Success", "Time"))], "no column without a value")
        self.assertEqual(self.row(0, table=1).split(), ["adaptive", "relaxation", "–", "–", "–", "60"])
        self.choose("Outcome", "done", "#cells")
        self.assertNotIn("missed", self.texts("#cells option"))
        tips = self.all("#by-case td [data-tip]", "one.dataset.tip")
        self.assertTrue(all(tip.endswith(" starts have the figure") for tip in tips))

    def test_one_of_many_is_not_0_percent(self):
        counts = [(1, 301, "0.3 % 1/301"), (2999, 3000, "99.97 % 2999/3000"), (0, 301, " 0 % 0/301")]
        counts.append((60, 60, "100 % 60/60"))

        def change(data):
            for item, (count, of, _) in zip(data["summary"], counts):
                item["success"] = synthetic_figures.wilson(count, of)

        self.show_changed(change)
        for number, (*_, text) in enumerate(counts):
            self.assertIn(text, self.row(number))
        script = modules(Verdict="report/page/verdict.js") + "return arguments[0].map((p) => Verdict.failure(p))"
        self.assertEqual(
            self.js(script, [0.0004, 0.9996, 0, 1, 0.03, 1e-20]),
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

        self.show_changed(change)
        self.assertIn("1.0e−300 (4.9e−324 to 1.0e+300)", self.row(0))
        self.assertIn("1.7e+300", self.row(0))
        self.assertIn("1.0e−300", self.row(0, "paired"))
        for section in ("distributions", "paired"):
            for text in self.texts("#%s .toolbar button" % section):
                self.press(text, "#" + section)
            found = "[...one.attributes].some((mark) => /NaN|Infinity/.test(mark.value)) && one.outerHTML"
            lost = [mark for mark in self.all("#%s svg.plot *" % section, found) if mark]
            self.assertEqual(lost[:3], [], "marks without a place in " + section)


def pair(reference, variant, **changes):
    numbers = {"cases": 12, "of_cases": 12, "runs": 60, "pairs": 60, "runs_variant_lost": 0, "runs_reference_lost": 0}
    one = {"reference": reference, "variant": variant, "metric": "mtre_mm", "unit": "mm", "difference": 0.25}
    one.update(numbers, low=0.125, high=0.5, p=0.001, p_holm=0.006, is_shown=True, fails_more=None)
    return {**one, "sentence": "%s against %s: 0.25 mm worse" % (variant, reference), **changes}


class RankingTest(ReportTest):
    def rows(self, section):
        cells = "[...one.cells].map((cell) => cell.innerText.trim())"
        return self.all(section + " .sortable tbody tr", cells)

    def test_ranking_all_pairs_and_effects(self):
        data = made()
        a, b, c, d = [variant["name"] for variant in data["variants"]]
        first = data["metrics"][0]["name"]
        lost = {"difference": None, "fails_more": "reference", "low": None, "high": -0.5, "runs_reference_lost": 7}
        data["all_pairs"] = [
            {**one, "metric": first} for one in (pair(a, b), pair(b, c, **lost), pair(c, d, is_shown=False))
        ]
        keys = ("variant", "rank", "median", "lost", "group")
        places = [(c, 1, 0.5, 0, "a"), (a, 2, 0.75, 1, "ab"), (b, 3, 0.8, 2, "b"), (d, 4, None, 60, None)]
        places = [dict(zip(keys, place)) for place in places]
        data["rankings"] = [
            {"metric": one["name"], "unit": one["unit"], "places": places, "sentence": "best in " + one["name"]}
            for one in data["metrics"]
        ]
        effect = {**pair("ncc", "nmi"), "factor": "cost.uses", "metric": first}
        data["effects"] = [{key: value for key, value in effect.items() if key not in ("p", "p_holm")}]
        self.show(data)
        self.eventually(lambda: len(self.rows("#summary")), 4)
        rows = self.rows("#summary .leaderboard")
        self.assertEqual([row[:2] for row in rows], [["1", "a"], ["2", "ab"], ["3", "b"], ["4", "–"]])
        self.assertEqual([row[2].split("\n")[0].removesuffix("baseline") for row in rows], [c, a, b, d])
        heads = [head.split(" mm")[0] for head in self.texts("#summary .leaderboard th")]
        of = lambda title: [row[heads.index(title)] for row in rows]
        self.assertEqual(of("Median of all runs"), ["0.500", "0.750", "0.800", "a failure"])
        self.assertEqual(of("Lost"), ["0", "1", "2", "60"])
        self.assertEqual(self.texts("#summary .ranking"), ["best in " + first])
        table, sentences = (self.the("#summary " + one, "one.offsetTop") for one in (".leaderboard", ".verdicts"))
        self.assertLess(table, sentences, "the table comes first")
        heads = self.texts("#effects th")
        self.assertEqual([head.split()[0] for head in heads[:4]], ["Factor", "Level", "Against", "Metric"])
        self.assertNotIn("p (Holm)", heads)
        self.assertEqual(self.rows("#effects")[0][:3], ["cost.uses", "nmi", "ncc"])
        self.assertFalse(self.the(".all-pairs", "one.open"), "only where asked")
        self.the(".all-pairs", "one.open = true")
        rows = self.rows("#paired .all-pairs")
        self.assertEqual([row[:2] for row in rows], [[b, a], [c, b], [d, c]])
        self.assertEqual(rows[1][3:5], [b + " fails more often", "0.500\u00a0mm better to %s’s failure" % b])
        self.assertIn("lost 0 / 7", rows[1][8])

    def test_without_a_ranking_the_best_comes_first(self):
        data = made()
        self.show(data)
        rates = [one["success"]["rate"] for one in data["summary"]]
        names = [data["variants"][i]["name"] for i in sorted(range(len(rates)), key=lambda i: -rates[i])]
        rows = self.rows("#summary .leaderboard")
        self.assertEqual([row[0].split("\n")[0].removesuffix("baseline") for row in rows], names)
        for row in rows:
            item = [one for one in data["comparisons"] if row[0].startswith(one["variant"])][:1]
            wanted = "baseline" if not item else "worse" if item[0]["is_shown"] else "no difference shown"
            self.assertIn(wanted, row[3])


class ResponseTest(ReportTest):
    def sweep(self, data, variants):
        """Curves of five points, of which the last has no runs and the one before has no interval."""
        runs = {"runs": 8, "of": 8}
        points = [{"value": 10 + 10 * i, **runs, "middle": i, "low": i - 1, "high": i + 1} for i in range(3)]
        points += [{"value": 40, "runs": 2, "of": 8, "middle": 3}, {"value": 50, "runs": 0, "of": 8}]
        data["curves"] = [
            {"variant": variant, "option": option, "figure": figure, "scale": scale, "points": points}
            for variant in variants
            for option, scale in (("edges.high", "linear"), ("edges.low", "log"))
            for figure in (data["metrics"][0]["name"], "success")
        ]

    def test_curves_have_bands(self):
        self.show_changed(lambda data: self.sweep(data, ["canny", "sobel"]))
        self.eventually(lambda: self.count("#response path.band"), 2)
        self.assertEqual(self.count("#response path.line"), 2)
        self.assertEqual(self.texts("#response .legend li"), ["canny", "sobel"])
        corners = lambda one: len(re.findall("[ML]", self.the("#response path." + one, "one.getAttribute('d')")))
        self.assertEqual(corners("band"), 6, "only points with an interval have a band")
        self.assertEqual(corners("line"), 4)

    def test_option_and_figure_are_chosen(self):
        self.show_changed(lambda data: self.sweep(data, [""]))
        title = lambda: self.texts("#response .title")
        self.eventually(lambda: title()[:1], ["edges.high"])
        self.choose("Option", "edges.low", "#response")
        self.eventually(lambda: title()[:1], ["edges.low"])
        self.choose("Figure", "success", "#response")
        self.eventually(lambda: title()[1:], ["success rate"])
        self.assertEqual(self.count("#response .legend li"), 0, "one curve needs no legend")

    def test_points_say_of_how_many_runs(self):
        points = [
            {"value": 10, "runs": 8, "of": 8, "middle": 1.0, "low": 0.5, "high": 1.5},
            {"value": 20, "runs": 3, "of": 8, "middle": 2.0},
        ]
        curve = {"variant": "", "option": "edges.high", "figure": "mtre_mm", "scale": "linear", "points": points}
        self.show_changed(lambda data: data.update(curves=[curve]))
        self.eventually(
            lambda: self.all("#response svg [data-tip]", "one.dataset.tip"),
            [
                "edges.high = 10.0\nmTRE (mm): 1.00, 95 % interval 0.500 to 1.50\n8 of 8 runs",
                "edges.high = 20.0\nmTRE (mm): 2.00\n3 of 8 runs",
            ],
        )
        note = "11 of 16 runs have this figure; points without some of theirs are not of the same cases as the others."
        self.assertEqual(self.texts("#response .note"), [note])

    def test_without_a_sweep_or_tuning_there_is_no_section(self):
        self.show()
        self.assertEqual(self.count("#response, #tuning"), 0)
        self.eventually(lambda: bool(self.texts("#capture .tick text")), True)
        ticks = self.texts("#capture .tick text")
        self.assertIn("100 %", ticks)
        self.assertIn("20 %", ticks)
        self.assertEqual([tick for tick in ticks if "." in tick], [], "no more digits than they need")


def point(i, score, **changes):
    return {"values": [60 + i], "score": score, "mean": score, "runs": 6, "failed": 0, "capped": 0, **changes}


class TuningTest(ReportTest):
    def page(self, **changes):
        data = made()
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
            "points": [point(i, score) for i, score in enumerate([0.5, 0.3, 0.4, 0.2, 0.25])],
            "best": 3,
            "sentence": "tuned on 6 cases",
            **changes,
        }
        self.show(data)
        self.eventually(lambda: self.count("#tuning path.line"), 1)

    def heights(self):
        path = self.the("#tuning path.line", "one.getAttribute('d')")
        return [float(y) for y in re.findall(r"[ML][\d.]+,([\d.]+)", path)]

    def tips(self):
        return [tip.replace("\u00a0", " ") for tip in self.all("#tuning svg [data-tip]", "one.dataset.tip")]

    def test_each_point_and_the_best_so_far(self):
        self.page()
        best = self.heights()
        self.assertEqual(len(best), 5)
        self.assertEqual(best[1], best[2], "the third point is no better")
        self.assertLess(best[0], best[1], "lower figures lie lower on the page")
        self.assertEqual(best[3], best[4])
        tips = self.tips()
        self.assertEqual(tips[3], "point 4: edges.high = 63.0; score 0.200 mm; mean mTRE 0.200 mm of 6 runs")
        self.assertEqual(len(tips), 5)
        line = self.the("#tuning .untuned", "Number(one.getAttribute('y1'))")
        self.assertTrue(best[0] < line < best[1], "the untuned score lies between the first two points")
        text = self.texts("#tuning p")
        self.assertIn("Tuned on 6 cases.", text)
        rule = "Score: mean mTRE with failed and worse runs counted as 20 mm."
        self.assertIn("The optimizer ended: steps became small. " + rule, text)
        self.assertIn("the large mark is the chosen one", self.text("#tuning"))
        titles = [one for one in self.texts("#tuning svg text") if one == "points tried" or one.startswith("score")]
        self.assertEqual(titles, ["points tried", "score (mm)"], "a capped mean is not called a mean")
        self.page(higher_is_better=True, best=0)
        self.assertEqual(len(set(self.heights())), 1, "none is better than the first")

    def test_a_point_says_what_its_score_is_made_of(self):
        """Six runs: 1, 5, 30 and 140 mm, and two that failed. By hand: (1 + 5 + 4 * 20) / 6 = 14.33 is the score, and
        (1 + 5 + 30 + 140) / 4 = 44 the mean."""
        refused = {"runs": 0, "mean": None, "refused": "'low' must not be above 'high'"}
        points = [point(0, 86 / 6, mean=44, failed=2, capped=2), point(1, 20, mean=None, failed=6)]
        self.page(points=[*points, point(2, 20, **refused)], best=0)
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
        self.assertIn("none was chosen", self.text("#tuning"))
        sizes = self.all("#tuning svg [data-tip]", "one.getBBox().width")
        self.assertEqual((len(sizes), len(set(sizes))), (3, 1))


if __name__ == "__main__":
    main()
