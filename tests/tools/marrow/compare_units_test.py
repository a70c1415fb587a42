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


if __name__ == "__main__":
    main()
