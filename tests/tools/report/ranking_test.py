#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The ranking, all pairs and the effects of factors on the report's page in headless Chromium.

    tests/tools/report/ranking_test.py     exit code 77: skipped, with the reason
"""
import sys

from harness import synthetic
from harness.page import PageTest, run_tests


def pair(reference, variant, **changes):
    numbers = {"cases": 12, "of_cases": 12, "runs": 60, "pairs": 60, "runs_variant_lost": 0, "runs_reference_lost": 0}
    one = {"reference": reference, "variant": variant, "metric": "mtre_mm", "unit": "mm", "difference": 0.25}
    one.update(numbers, low=0.125, high=0.5, p=0.001, p_holm=0.006, is_shown=True, fails_more=None)
    return {**one, "sentence": "%s against %s: 0.25 mm worse" % (variant, reference), **changes}


def place(variant, rank, median, lost, group):
    return {"variant": variant, "rank": rank, "median": median, "lost": lost, "group": group}


class RankingTest(PageTest):
    def page(self):
        data = synthetic.comparison()
        a, b, c, d = self.names = [variant["name"] for variant in data["variants"]]
        first = data["metrics"][0]["name"]
        pairs = [
            pair(a, b),
            pair(b, c, difference=None, fails_more="reference", low=None, high=-0.5, runs_reference_lost=7),
            pair(c, d, is_shown=False),
        ]
        places = [
            place(c, 1, 0.5, 0, "a"),
            place(a, 2, 0.75, 1, "ab"),
            place(b, 3, 0.8, 2, "b"),
            place(d, 4, None, 60, None),
        ]
        data["all_pairs"] = [{**one, "metric": first} for one in pairs]
        data["rankings"] = [
            {
                "metric": metric["name"],
                "unit": metric["unit"],
                "places": places,
                "sentence": "best in " + metric["name"],
            }
            for metric in data["metrics"]
        ]
        effect = {**pair("ncc", "nmi"), "factor": "cost.uses", "metric": first}
        data["effects"] = [{key: value for key, value in effect.items() if key not in ("p", "p_holm")}]
        self.first = first
        self.browser.open(self.write("ranking", data))
        self.eventually(lambda: len(self.rows("#summary")), 4)

    def rows(self, section):
        cells = "(row) => [...row.cells].map((cell) => cell.innerText.trim())"
        rows = "return [...document.querySelectorAll(arguments[0] + ' .sortable tbody tr')].map(%s)" % cells
        return self.browser.js(rows, section)

    def test_best_first_with_groups_and_failures(self):
        self.page()
        a, b, c, d = self.names
        rows = self.rows("#summary .leaderboard")
        self.assertEqual([row[:2] for row in rows], [["1", "a"], ["2", "ab"], ["3", "b"], ["4", "–"]])
        self.assertEqual([row[2].split("\n")[0].removesuffix("baseline") for row in rows], [c, a, b, d])
        heads = [head.split(" mm")[0] for head in self.texts("#summary .leaderboard th")]
        of = lambda title: [row[heads.index(title)] for row in rows]
        self.assertEqual(of("Median of all runs"), ["0.500", "0.750", "0.800", "a failure"])
        self.assertEqual(of("Lost"), ["0", "1", "2", "60"])
        self.assertEqual(self.texts("#summary .ranking"), ["best in " + self.first])
        table, sentences = self.browser.js(
            "return ['.leaderboard', '.verdicts'].map((one) => document.querySelector('#summary ' + one).offsetTop)"
        )
        self.assertLess(table, sentences, "the table comes first")

    def test_without_a_ranking_the_best_comes_first(self):
        data = synthetic.comparison()
        self.browser.open(self.write("board", data))
        rates = [one["success"]["rate"] for one in data["summary"]]
        names = [data["variants"][i]["name"] for i in sorted(range(len(rates)), key=lambda i: -rates[i])]
        shown = [row[0].split("\n")[0].removesuffix("baseline") for row in self.rows("#summary .leaderboard")]
        self.assertEqual(shown, names)
        for row in self.rows("#summary .leaderboard"):
            item = [one for one in data["comparisons"] if row[0].startswith(one["variant"])][:1]
            wanted = "baseline" if not item else "worse" if item[0]["is_shown"] else "no difference shown"
            self.assertIn(wanted, row[3])

    def test_all_pairs_name_both(self):
        self.page()
        a, b, c, d = self.names
        self.assertFalse(self.browser.js("return document.querySelector('.all-pairs').open"), "only where asked")
        self.browser.js("document.querySelector('.all-pairs').open = true")
        rows = self.rows("#paired .all-pairs")
        self.assertEqual([row[:2] for row in rows], [[b, a], [c, b], [d, c]])
        self.assertEqual(rows[1][3], b + " fails more often")
        self.assertEqual(rows[1][4], "0.500\u00a0mm better to %s’s failure" % b)
        self.assertIn("lost 0 / 7", rows[1][8])

    def test_effects_have_no_p(self):
        self.page()
        heads = self.texts("#effects th")
        self.assertEqual([head.split()[0] for head in heads[:4]], ["Factor", "Level", "Against", "Metric"])
        self.assertNotIn("p (Holm)", heads)
        self.assertEqual(self.rows("#effects")[0][:3], ["cost.uses", "nmi", "ncc"])


if __name__ == "__main__":
    sys.exit(run_tests())
