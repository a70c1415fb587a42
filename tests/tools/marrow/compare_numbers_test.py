# SPDX-License-Identifier: Apache-2.0
"""How a comparison shows its numbers: none reads as 0 that is not 0, none runs into the next one, and what is not known
is not shown as a number. The values are of tables, so the right text follows from them by hand."""
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


if __name__ == "__main__":
    main()
