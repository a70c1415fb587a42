# SPDX-License-Identifier: Apache-2.0
"""The tables of a comparison in Python have the numbers of comparison.json, and None for what is not known."""
from harness.package import main, marrow  # it finds the modules below
from harness.given_cases import GivenCase


class Tables(GivenCase):
    def table(self, values, more="", **others):
        self.compare(values, more, **others)
        return marrow.Comparison(self.scratch / "out")

    def test_missing_runs(self):
        # b lacks the figure in four of six cases; the medians are by hand.
        comparison = self.table({"a": ["%d mm" % i for i in range(1, 7)], "b": ["1 mm", "2 mm"] + ["fail"] * 4})
        first, second = comparison.variants
        self.assertEqual([row["unit"] for row in comparison.variants], ["mm", "mm"])
        self.assertEqual([first[key] for key in ("count", "of", "median", "failed", "incomplete")], [6, 6, 3.5, 0, 0])
        self.assertEqual([second[key] for key in ("count", "of", "median", "failed", "incomplete")], [2, 6, 1.5, 0, 4])
        self.assertEqual((first["median_low"], first["median_high"]), (1, 6), "the range of six values")
        self.assertEqual((second["median_low"], second["median_high"]), (None, None), "two cases are too few")
        self.assertEqual([row["success_rate"] for row in comparison.variants], [None, None], "there are no limits")
        self.assertEqual(list(comparison.differences), self.answer()["comparisons"])
        difference = comparison.differences[0]
        self.assertEqual((difference["difference"], difference["fails_more"]), (None, "variant"))
        self.assertEqual((difference["runs_variant_lost"], difference["runs"]), (4, 6))
        self.assertEqual([row["success"] for row in comparison.cells], [None] * 12)

    def test_the_percentile_is_named_after_what_is_better(self):
        values = {"a": ["%d mm" % i for i in range(21)]}
        row = self.table(values).variants[0]
        self.assertEqual((row["p95"], row["p5"]), (19, None))
        metrics = "[{figure: figures.err, better: higher}]"
        row = self.table(values, "success: {figures.err: 9.5}\n", metrics=metrics).variants[0]
        self.assertEqual((row["p95"], row["p5"]), (None, 1))
        self.assertAlmostEqual(row["success_rate"], 11 / 21, 12)

    def test_all_rows_have_the_same_columns(self):
        variants = self.table({"a": ["fail"], "b": ["1 mm"]}).variants
        self.assertEqual(list(variants[0]), list(variants[1]))
        self.assertIsNone(variants[0]["median"])


if __name__ == "__main__":
    main()
