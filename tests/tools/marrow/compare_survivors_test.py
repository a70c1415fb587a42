# SPDX-License-Identifier: Apache-2.0
"""Runs without a figure, because a node failed that may fail, are not left out of a comparison in silence: every table
says of how many runs its numbers are, and lost runs count in the answer."""
import math
import statistics
from fractions import Fraction

from harness.given_cases import GivenCase
from harness.program import main

# Ten easy cases, in which b is 0.2 mm better, and twenty hard ones, which b loses.
EASY = [1 + 0.01 * i for i in range(10)]
HARD = [5 + 0.1 * i for i in range(20)]
SURVIVORS = {
    "a": ["%.2f mm" % value for value in EASY + HARD],
    "b": ["%.2f mm" % (value - 0.2) for value in EASY] + ["fail"] * 20,
}


def exact_p(negative_rank, negatives, positive_rank, positives):
    """Two-sided p of the signed ranks of two groups of ties, with the smaller sum on the negative side: by counting all
    signs."""
    observed = negative_rank * negatives
    ways = sum(
        math.comb(negatives, i) * math.comb(positives, j)
        for i in range(negatives + 1)
        for j in range(positives + 1)
        if i * negative_rank + j * positive_rank <= observed
    )
    return float(min(Fraction(1), Fraction(2 * ways, 2 ** (negatives + positives))))


class Survivors(GivenCase):
    def test_a_variant_that_loses_the_hard_cases(self):
        told = self.compare(SURVIVORS, arguments=["--shown", "4"])
        # Ten ties have the mean rank 5.5, twenty lost cases 20.5.
        p = exact_p(Fraction(11, 2), 10, Fraction(41, 2), 20)
        self.assertLess(p, 0.001)
        self.assertRegex(told, r"\n    runs  median +25 % +75 % +95 % +worst  median, 95 % interval\n")
        self.assertRegex(told, r"\na  30/30  %.4f " % statistics.median(EASY + HARD))
        self.assertRegex(told, r"\nb  10/30  %.4f " % (statistics.median(EASY) - 0.2))
        for words in (
            "variant  runs  failed  incomplete  success (95 % interval)  s  evaluations\n"
            "a *        30       0           0  -                        -            0\n"
            "b          30       0          20  -                        -            0\n",
            "\nThe variants have this figure in different runs, so these numbers are not of the same cases and "
            "starts.\n",
            "fails more often than the baseline, in 20 of 30 cases",
            "p < 0.001; of 30 runs, only b failed in 20, only the baseline in 0, both in 0",
            "where both have a value, in 10 cases, the median is 0.20 mm better",
        ):
            self.assertIn(words, told)
        answer = self.answer()
        one = dict(answer["comparisons"][0])
        self.assertAlmostEqual(one.pop("p"), p, 12)
        self.assertAlmostEqual(one.pop("p_holm"), p, 12)
        self.assertAlmostEqual(one.pop("difference_of_pairs"), -0.2, 9)
        # Order statistics: 1 - 2 P(X < 10) with X of 30 fair coins is 95.7 %: from the 10th to the 21st
        self.assertAlmostEqual(one.pop("low"), -0.2, 9)
        self.assertIn("in 20 of 30 cases", one.pop("sentence"))
        self.assertEqual(
            one,
            {
                **{"variant": "b", "metric": "figures.err", "unit": "mm", "has_interval": True, "is_shown": True},
                **{"cases": 30, "of_cases": 30, "cases_variant_lost": 20, "cases_baseline_lost": 0},
                **{"runs": 30, "pairs": 10, "runs_variant_lost": 20, "runs_baseline_lost": 0, "runs_both_lost": 0},
                **{"difference": None, "fails_more": "variant", "high": None},  # it is a failure
            },
        )
        self.assertEqual(answer["metrics"][0]["same_runs"], False)
        self.assertEqual([(v["failed"], v["incomplete"]) for v in answer["variants"]], [(0, 0), (0, 20)])
        figure = answer["variants"][1]["metrics"]["figures.err"]
        self.assertEqual((figure["count"], figure["of"]), (10, 30))
        # The page and the table have the same.
        page = self.page_data()
        self.assertEqual(page["summary"], answer["variants"])
        for part in ("metrics", "comparisons"):
            self.assertEqual(page[part], answer[part])
        rows = self.rows().values()
        self.assertEqual(sum(row["figures.err"] == "" for row in rows), 20)
        self.assertEqual({row["success"] for row in rows}, {""}, "there are no limits")
        # Pictures are of runs without the figure, too.
        shown = {path.parent.name for path in (self.scratch / "out" / "pictures").glob("b/*/0")}
        self.assertIn("010", shown, "the first case that b loses")

    def test_with_both_lost_and_both_there(self):
        # b loses case 0, a loses case 1, both lose case 2; in the other six b is 1 mm worse.
        values = {"a": ["1 mm", "fail", "fail"] + ["2 mm"] * 6, "b": ["fail", "1 mm", "fail"] + ["3 mm"] * 6}
        told = self.compare(values)
        one = self.answer()["comparisons"][0]
        self.assertEqual((one["cases"], one["of_cases"], one["runs"], one["pairs"]), (8, 9, 9, 6))
        counts = [one["runs_" + name] for name in ("variant_lost", "baseline_lost", "both_lost")]
        self.assertEqual(counts, [1, 1, 1])
        # Ranks: six ties 3.5 and two failures 7.5 of opposite signs: the negative sum is 7.5. Of 2^8 signs, a sum of
        # 7.5 or less: no or one or two of the six with no failure (1 + 6 + 15), or one failure alone (2).
        self.assertAlmostEqual(one["p"], 2 * (1 + 6 + 15 + 2) / 256, 12)
        self.assertEqual((one["difference"], one["fails_more"]), (1, None))
        self.assertIn("\na  7/9  ", told.replace("   ", "  "))
        self.assertEqual(self.answer()["metrics"][0]["same_runs"], False)

    def test_without_any_case_in_common_and_where_all_have_all(self):
        told = self.compare({"a": ["1 mm"] * 3, "b": ["fail"] * 3, "c": ["2 mm"] * 3})
        self.assertIn("\nb   0/3       -  ", told)
        answer = self.answer()
        self.assertEqual(answer["variants"][1]["metrics"]["figures.err"], {"count": 0, "of": 3})
        self.assertEqual([one["fails_more"] for one in answer["comparisons"]], ["variant", None])
        told = self.compare({"a": ["1 mm"] * 3, "c": ["2 mm"] * 3})
        self.assertNotIn("in different runs", told)
        self.assertTrue(self.answer()["metrics"][0]["same_runs"])

    def test_with_nothing_at_all(self):
        told = self.compare({"a": ["fail"] * 3, "b": ["fail"] * 3})
        self.assertIn("b, figures.err: no case can be compared", told)
        one = self.answer()["comparisons"][0]
        self.assertEqual([one[key] for key in ("cases", "difference", "low", "high", "p")], [0, None, None, None, 1])

    def test_response_curves_say_of_how_many(self):
        self.write_cases({"a": ["1 mm", "2 mm", "3 mm"], "b": ["5 mm", "fail", "fail"]})
        self.experiment(["a", "b"], "sweep: {options: {n.at: [0, 1]}, grid: 2}\nbaseline: a+0\n")
        self.compare_file()
        curves = {curve["variant"]: curve["points"] for curve in self.answer()["curves"]}
        self.assertEqual([(point["runs"], point["of"]) for point in curves["a"]], [(3, 3)] * 2)
        self.assertEqual([(point["runs"], point["of"]) for point in curves["b"]], [(1, 3)] * 2)
        self.assertEqual([point["middle"] for point in curves["b"]], [5, 6])
        self.assertNotIn("low", curves["a"][0], "three cases cannot have a 95 % interval")


if __name__ == "__main__":
    main()
