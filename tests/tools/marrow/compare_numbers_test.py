# SPDX-License-Identifier: Apache-2.0
"""How a comparison shows its numbers: none reads as 0 that is not 0, none runs into the next one, and what is not known
is not shown as a number. The values are of tables, so the right text follows from them by hand."""
import math
import statistics
from fractions import Fraction

from harness.given_cases import PIPELINE, GivenCase
from harness.program import main

JUDGED = """  v: {uses: test.given_verdict, in: {start: s}, with: {table: $case, column: a}}
outputs: {figures: n, verdict: v}
"""
# Three values of a figure, and how the table shows them. The largest has no more decimals than it needs; what these
# would hide has an exponent.
SHOWN = {
    "large": ("1e81 3e300 2e300", "a 3/3 2.000e+300 1.000e+300 2.500e+300 2.900e+300 3.000e+300 -"),
    "small": ("1e-6 3e-6 2e-6", "a 3/3 2.000e-06 1.500e-06 2.500e-06 2.900e-06 3.000e-06 -"),
    "smaller": ("1e-300 3e-300 2e-300", "a 3/3 2.000e-300 1.500e-300 2.500e-300 2.900e-300 3.000e-300 -"),
    "mixed": ("1e-7 1e-7 2000", "a 3/3 1.000e-07 1.000e-07 1000.00000 1800.00000 2000.00000 -"),
    "usual": ("0.5 1.5 31.25", "a 3/3 1.5000 1.0000 16.3750 28.2750 31.2500 -"),
    "zero": ("-0.0 -0.0 -0.0", "a 3/3 0.0000 0.0000 0.0000 0.0000 0.0000 -"),
}


def rows_of(told, title):
    """The rows below a title, split where two or more blanks are."""
    lines = told[told.index("\n" + title) :].splitlines()[2:]
    return [line.split() for line in lines[: lines.index("")]]


class Numbers(GivenCase):
    def test_numbers_of_all_sizes(self):
        texts = {name: values.split() for name, (values, _) in SHOWN.items()}
        told = self.compare(
            {"a": [{name: texts[name][case] for name in SHOWN} for case in range(3)]},
            metrics="[%s]" % ", ".join("figures." + name for name in SHOWN),
            pipeline=PIPELINE % ", ".join(SHOWN),
        )
        for name, (_, shown) in SHOWN.items():
            self.assertEqual(rows_of(told, "figures." + name + "\n")[1], shown.split(), name)

    def test_names_of_any_length_and_alphabet(self):
        names = ["é", "\u0440\u0443\u043a\u0430", "n" * 90, "\u80a9"]
        self.write_cases({"a": ["1 mm"]})
        text = self.experiment([]).read_text()
        self.write(
            "e.yaml", text.replace("variants:\n", "variants:\n" + "".join("  %s: {}\n" % name for name in names))
        )
        told = self.compare_file()
        table = told[told.index("\nvariant") + 1 :].splitlines()[: len(names) + 1]
        ends = {len(line.split("  -")[0].rstrip()) for line in table[1:]}
        self.assertEqual(len(ends), 1, "the numbers of each column end at one place: " + "\n".join(table))


class NotKnown(GivenCase):
    def judged(self, more=""):
        values = {"a": {"err": "1 mm", "verdict": "trusted 2"}, "b": {"err": "3 mm", "verdict": "doubtful 8"}}
        self.write_cases({name: [value] * 3 for name, value in values.items()})
        pipeline = (PIPELINE % "err").replace("outputs: {figures: n}\n", JUDGED)
        text = self.experiment("ab", "initial_error: figures.err\n" + more, pipeline=pipeline).read_text()
        self.write("e.yaml", text.replace("{n.column: b}", "{n.column: b, v.column: b}"))
        return self.compare_file()

    def test_without_limits_there_is_no_success(self):
        told = self.judged()
        self.assertIn(
            "variant  runs  failed  incomplete  success (95 % interval)  s  evaluations\n"
            "a *         3       0           0  -                        -            0\n"
            "b           3       0           0  -                        -            0\n"
            "The experiment has no limits under 'success', so no run is a success or a miss, and there is no capture "
            "range.\n",
            told,
        )
        self.assertIn(
            "   cells  silent failures  caught  false alarms\n"
            "a      3  -                     -  -\n"
            "b      3  -                     -  -\n",
            told,
        )
        self.assertNotIn("Capture range", told)
        for variant in self.answer()["variants"]:
            verdicts = {"cells": 3, "silent_failures": None, "caught": None, "false_alarms": None}
            found = variant["success"], variant["capture"], variant["verdicts"]
            self.assertEqual(found, (None, None, verdicts))
        self.assertEqual({row["success"] for row in self.rows().values()}, {""})
        page = self.page_data()
        place = page["cell_table"]["fields"].index("success")
        self.assertEqual({row[place] for row in page["cell_table"]["rows"]}, {None})
        rule = "The experiment sets no limits, so no run is a success or a miss."
        self.assertEqual(page["experiment"]["success_rule"], rule)

    def test_with_limits_there_is(self):
        told = self.judged("success: {figures.err: 2}\n")
        for line in (
            "a *         3       0           0  100.0 % (43.9 to 100.0)  -",
            "a      3  -                         0  0/3 (0.0 to 56.1 %)\n",
            "b      3  0/3 (0.0 to 56.1 %)       3  -\n",
            "Capture range",
        ):
            self.assertIn(line, told)

    def test_seconds_that_were_not_measured(self):
        not_known = r"\na \* +2 +0 +0  - +-  +0\n"
        self.assertRegex(self.compare({"a": ["1 mm"] * 2}), not_known)
        self.assertEqual(self.answer()["variants"][0]["seconds"], {"count": 0, "of": 2})
        self.assertNotRegex(self.compare({"a": ["1 mm"] * 2}, "timed_cells: 1\n"), not_known)
        self.assertEqual(self.answer()["variants"][0]["seconds"]["count"], 1)

    def test_intervals_of_few_cases(self):
        # The range of n values holds their median with 1 - 2^(1 - n): 93.75 % with 5, 96.875 % with 6.
        figure = lambda: self.answer()["variants"][0]["metrics"]["figures.err"]
        told = self.compare({"a": ["%d mm" % i for i in range(1, 6)]})
        self.assertEqual(rows_of(told, "figures.err")[1][-1], "-")
        self.assertNotIn("median_low", figure())
        told = self.compare({"a": ["%d mm" % i for i in range(1, 7)]})
        self.assertEqual(rows_of(told, "figures.err")[1][-3:], ["1.0000", "to", "6.0000"])
        self.assertEqual((figure()["median_low"], figure()["median_high"]), (1, 6))


# Numbers of a comparison have the units in which the cells gave them, everywhere, and numbers of different units are
# never put together.
METRES = {"a": ["2 mm", "3 mm", "4 mm"], "b": ["2 mm", "0.003 m", "0.004 m"]}
REFUSED = (
    "marrow: error: the figure 'figures.err' has the unit 'mm' in the cell a/000/0 and %s in the cell b/001/0, so "
    "their numbers cannot be compared; let all cells give it in one unit\n"
)
STARTS = """starts: {node: s, count: 2}
initial_error: from.start_deg
success: {figures.err: 2}
"""
FROM = """  e: {uses: test.given_figures, in: {start: s}, with: {table: $case, column: start, names: [start_deg]}}
outputs: {from: e, figures: n}
"""
STOP = "stop: {difference: figures.err, most_cases: 16, look_every: 8}\n"
TUNE = """tune: {options: {n.at: [0, 1]}, failed_as: 9, optimizer: {uses: optimizer.nelder_mead}, points: 4,
  training_cases: 2}
"""


class Units(GivenCase):
    def assert_refused(self, *said):
        for text in said:
            self.assertIn(text, self.result.stderr)

    def test_different_units_are_refused_and_a_lost_cell_has_none(self):
        for values, said in (
            (METRES, REFUSED % "the unit 'm'"),
            ({"a": ["2 mm"] * 3, "b": ["2 mm", "0.003", "4 mm"]}, REFUSED % "no unit"),
        ):
            self.assertEqual(self.compare(values, code=2), "")
            self.assertEqual(self.result.stderr, said)
            for name in ("cells.csv", "comparison.json", "report.html"):
                self.assertFalse((self.scratch / "out" / name).exists(), name)
        self.compare({"a": ["2 deg", "3 mm", "4 mm"]}, code=2)
        self.assert_refused("'figures.err' has the unit 'deg' in the cell a/000/0 and the unit 'mm' in")
        self.compare({"a": ["2 mm"] * 3, "b": ["fail", "3 mm", "4 mm"]})
        self.assertEqual(self.answer()["metrics"][0]["unit"], "mm")

    def test_at_a_look(self):
        # The table says it of row SEED; the cases of the first look all agree.
        lines = [
            "%d,%s,0,err,%g %s" % (row, column, 1 + 0.1 * row, "m" if column == "b" and row == 9 else "mm")
            for row in range(1, 17)
            for column in "ab"
        ]
        table = self.write("figures.csv", "\n".join(lines) + "\n")
        pipeline = PIPELINE.replace("inputs: {case: {type: path}}", "inputs: {row: {type: integer}}") % "err"
        pipeline = pipeline.replace("table: $case", "table: %s, row: $row" % table)
        text = self.experiment("ab", STOP, pipeline=pipeline).read_text()
        self.write("e.yaml", text.replace("{folders: [cases/*]}", "{seeds: 1..8, seed_input: [row]}"))
        self.compare_file()
        self.compare_file("--more-cases", "8", code=2)
        self.assert_refused("has the unit 'mm' in the cell a/seed-1/0 and the unit 'm' in the cell b/seed-9/0")

    def test_where_a_cluster_left_the_rows(self):
        self.write_cases(METRES)
        file = self.experiment(METRES)
        self.expect(0, "compare", file, "--out", "out", "--emit", "parallel")
        for cell in ("%s/%03d/0" % (variant, case) for variant in METRES for case in range(3)):
            self.expect(0, "cell", file, cell, "--out", "out")
        self.refused(REFUSED % "the unit 'm'", "compare", file, "--out", "out", "--gather")

    def test_in_a_tuning(self):
        self.compare({"a": ["2 mm", "0.003 m", "4 mm", "5 mm"]}, TUNE, code=2)  # the second training case is in metres
        self.assert_refused("'figures.err' has the unit 'mm' in the cell a/000/0 and the unit 'm' in the cell a/001/0")


class StartErrors(GivenCase):
    def compare_starts(self, unit, code=0):
        """Of three cases, one from 5 deg and two from 1.5 in the unit."""
        of_start = [{"start_deg": "1.5 " + unit}] * 2 + [{"start_deg": "5 deg"}]
        self.write_cases({"a": ["1 mm"] * 3, "b": ["3 mm"] * 3, "start": of_start})
        self.experiment("ab", STARTS, pipeline=(PIPELINE % "err").replace("outputs: {figures: n}\n", FROM))
        return self.compare_file(code=code)

    def test_a_capture_range_in_degrees(self):
        told = self.compare_starts("deg")
        self.assertIn(
            "\nCapture range: success over from.start_deg [deg], in bins of 2 deg, with 95 % intervals\n"
            "start            a                  b\n"
            "0 to 2           4/4 (34 to 100 %)  0/4 (0 to 66 %)\n",  # of two cases: Wilson's of 2
            told,
        )
        self.assertIn("\n95 % or more to  at least 5         0\n", told)
        answer = self.answer()
        self.assertEqual(answer["initial_error"], {"name": "from.start_deg", "unit": "deg"})
        self.assertEqual(self.page_data()["initial_error"], answer["initial_error"])
        self.assertEqual([variant["capture"]["range"] for variant in answer["variants"]], [5, 0])
        empty = {"from": 2, "to": 4, "count": 0, "of": 0, "rate": None, "low": None, "high": None}
        self.assertEqual(answer["variants"][0]["capture"]["bins"][1], empty)

    def test_start_errors_in_two_units(self):
        self.compare_starts("rad", code=2)
        said = (
            "the figure 'from.start_deg' has the unit 'rad' in the cell a/000/0 and the unit 'deg' in the cell a/002/0"
        )
        self.assertIn(said, self.result.stderr)


class HigherIsBetter(GivenCase):
    def test_it_is_the_fifth_percentile_else_the_95th(self):
        # 0 to 20: numpy.percentile(range(21), 5) is 1, and the worst is 0.
        names = ["overlap", "err"]
        told = self.compare(
            {"a": [{"overlap": "%d %%" % i, "err": "%d mm" % i} for i in range(21)]},
            metrics="[{figure: figures.overlap, better: higher, label: share}, figures.err]",
            pipeline=PIPELINE % ", ".join(names),
        )
        self.assertIn(
            "\nshare [%], figures.overlap\n"
            "    runs   median    25 %     75 %     5 %   worst  median, 95 % interval\n"
            "a  21/21  10.0000  5.0000  15.0000  1.0000  0.0000  ",
            told,
        )
        self.assertIn("     75 %     95 %    worst  ", told)
        higher, lower = (self.answer()["variants"][0]["metrics"]["figures." + name] for name in names)
        self.assertEqual((higher["p5"], higher["worst"], lower["p95"], lower["worst"]), (1, 0, 19, 20))
        self.assertNotIn("p95", higher)
        self.assertNotIn("p5", lower)


# Runs without a figure, because a node failed that may fail, are not left out of a comparison in silence: every table
# says of how many runs its numbers are, and lost runs count in the answer.

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
