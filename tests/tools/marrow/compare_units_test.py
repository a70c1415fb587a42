# SPDX-License-Identifier: Apache-2.0
"""Numbers of a comparison have the units in which the cells gave them, everywhere, and numbers of different units are
never put together."""
from harness.given_cases import PIPELINE, GivenCase
from harness.program import main

METRES = {"a": ["2 mm", "3 mm", "4 mm"], "b": ["2 mm", "0.003 m", "0.004 m"]}
REFUSED = (
    "marrow: error: the figure 'figures.err' has the unit 'mm' in the cell a/000/0 and %s in the cell b/001/0, so "
    "their numbers cannot be compared; let all cells give it in one unit\n"
)
STARTS = """starts: {node: s, count: 2}
initial_error: from.start_deg
"""
FROM = """  e: {uses: test.given_figures, in: {start: s}, with: {table: $case, column: start, names: [start_deg]}}
outputs: {from: e, figures: n}
"""


class Units(GivenCase):
    def test_metres_and_millimetres(self):
        self.compare(METRES, code=2)
        self.assertEqual(self.result.stderr, REFUSED % "the unit 'm'")
        self.assertEqual(self.result.stdout, "")
        for name in ("cells.csv", "comparison.json", "report.html"):
            self.assertFalse((self.scratch / "out" / name).exists(), name)

    def test_a_unit_that_is_missing(self):
        self.compare({"a": ["2 mm"] * 2, "b": ["2 mm", "0.003"]}, code=2)
        self.assertEqual(self.result.stderr, REFUSED % "no unit")

    def test_a_cell_without_the_figure_has_none(self):
        self.compare({"a": ["2 mm"] * 2, "b": ["fail", "3 mm"]})
        self.assertEqual(self.answer()["metrics"][0]["unit"], "mm")

    def test_units_within_one_variant(self):
        self.compare({"a": ["2 deg", "3 mm"]}, code=2)
        self.assertIn("'figures.err' has the unit 'deg' in the cell a/000/0 and the unit 'mm' in", self.result.stderr)

    def test_at_a_look(self):
        # The table says it of row SEED; the cases of the first look all agree.
        lines = [
            "%d,%s,0,err,%g %s" % (row, column, 1 + 0.1 * row, "m" if column == "b" and row == 9 else "mm")
            for row in range(1, 17)
            for column in "ab"
        ]
        table = self.write("figures.csv", "\n".join(lines) + "\n")
        pipeline = PIPELINE % "err" + "\n"
        pipeline = pipeline.replace("inputs: {case: {type: path}}", "inputs: {row: {type: integer}}")
        pipeline = pipeline.replace("table: $case", "table: %s, row: $row" % table)
        rule = "stop: {difference: figures.err, most_cases: 16, look_every: 8}\n"
        file = self.experiment("ab", rule, pipeline=pipeline)
        file.write_text(file.read_text().replace("{folders: [cases/*]}", "{seeds: 1..8, seed_input: [row]}"))
        self.assertEqual(self.marrow("compare", file, "--out", "out", "--quiet").returncode, 0)
        result = self.marrow("compare", file, "--out", "out", "--quiet", "--more-cases", "8")
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("has the unit 'mm' in the cell a/seed-1/0 and the unit 'm' in the cell b/seed-9/0", result.stderr)

    def test_where_a_cluster_left_the_rows(self):
        self.write_cases(METRES)
        file = self.experiment(METRES)
        planned = self.marrow("compare", file, "--out", "out", "--emit", "parallel")
        self.assertEqual(planned.returncode, 0, planned.stderr)
        for variant in METRES:
            for case in ("000", "001", "002"):
                result = self.marrow("cell", file, "%s/%s/0" % (variant, case), "--out", "out")
                self.assertEqual(result.returncode, 0, result.stderr)
        result = self.marrow("compare", file, "--out", "out", "--gather")
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertIn(REFUSED % "the unit 'm'", result.stderr)

    def test_in_a_tuning(self):
        # Only the second training case is in metres.
        self.write_cases({"a": ["2 mm", "0.003 m", "4 mm", "5 mm"]})
        tune = "tune: {options: {n.at: [0, 1]}, failed_as: 9, optimizer: {uses: optimizer.nelder_mead}, points: 4,"
        file = self.experiment(["a"], tune + " training_cases: 2}\n")
        result = self.marrow("compare", file, "--out", "out", "--quiet")
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertIn(
            "'figures.err' has the unit 'mm' in the cell a/000/0 and the unit 'm' in the cell a/001/0", result.stderr
        )


class StartErrors(GivenCase):
    def starts_of(self, unit, more=""):
        values = {
            "a": ["1 mm"] * 3,
            "b": ["3 mm"] * 3,
            "start": [{"start_deg": "1.5 " + unit}] * 2 + [{"start_deg": "5 deg"}],
        }
        self.write_cases(values)
        pipeline = (PIPELINE % "err").replace("outputs: {figures: n}\n", FROM)
        return self.experiment("ab", STARTS + more, pipeline=pipeline)

    def test_a_capture_range_in_degrees(self):
        file = self.starts_of("deg", "success: {figures.err: 2}\n")
        result = self.marrow("compare", file, "--out", "out", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        table = result.stdout[result.stdout.index("Capture range") :]
        self.assertTrue(
            table.startswith(
                "Capture range: success over from.start_deg [deg], in bins of 2 deg, with 95 % intervals\n"
                "start            a                  b\n"
                "0 to 2           4/4 (34 to 100 %)  0/4 (0 to 66 %)\n"  # of two cases: Wilson's of 2
            ),
            table,
        )
        self.assertIn("\n95 % or more to  at least 5         0\n", table)
        answer = self.answer()
        self.assertEqual(answer["initial_error"], {"name": "from.start_deg", "unit": "deg"})
        self.assertEqual(self.page_data()["initial_error"], answer["initial_error"])
        self.assertEqual([variant["capture"]["range"] for variant in answer["variants"]], [5, 0])
        self.assertEqual(
            answer["variants"][0]["capture"]["bins"][1],
            {"from": 2, "to": 4, "count": 0, "of": 0, "rate": None, "low": None, "high": None},
        )

    def test_start_errors_in_two_units(self):
        file = self.starts_of("rad", "success: {figures.err: 2}\n")
        result = self.marrow("compare", file, "--out", "out", "--quiet")
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn(
            "the figure 'from.start_deg' has the unit 'rad' in the cell a/000/0 and the unit 'deg' in the cell a/002/0",
            result.stderr,
        )


class HigherIsBetter(GivenCase):
    def test_it_is_the_fifth_percentile(self):
        # 0 to 20: numpy.percentile(range(21), 5) is 1, and the worst is 0.
        values = {"a": ["%d %%" % i for i in range(21)]}
        told = self.compare(values, metrics="[{figure: figures.err, better: higher, label: overlap}]")
        self.assertIn(
            "\noverlap [%], figures.err\n"
            "    runs   median    25 %     75 %     5 %   worst  median, 95 % interval\n"
            "a  21/21  10.0000  5.0000  15.0000  1.0000  0.0000  ",
            told,
        )
        figure = self.answer()["variants"][0]["metrics"]["figures.err"]
        self.assertEqual((figure["p5"], figure["worst"]), (1, 0))
        self.assertNotIn("p95", figure)

    def test_else_it_is_the_95th(self):
        told = self.compare({"a": ["%d mm" % i for i in range(21)]})
        self.assertIn("     75 %     95 %    worst  ", told)
        figure = self.answer()["variants"][0]["metrics"]["figures.err"]
        self.assertEqual((figure["p95"], figure["worst"]), (19, 20))
        self.assertNotIn("p5", figure)


if __name__ == "__main__":
    main()
