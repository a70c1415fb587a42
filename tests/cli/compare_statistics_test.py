# SPDX-License-Identifier: Apache-2.0
"""The statistics in a comparison's answer: intervals that know that the starts of a case are not independent."""
import json

from marrow_cli import TEST_PLUGINS, Case, main, marrow

PIPELINE = """marrow: 1
nodes:
  start: {uses: test.displaced}
  drawn: {uses: test.draw}
  sum: {uses: test.add, in: {a: start, b: drawn}}
outputs: {number: sum}
"""
HEAD = """experiment: 1
name: e
pipeline: p.yaml
cases: {seeds: 1..8}
metrics: [number.value]
timed_cells: 0
"""


class ComparisonCase(Case):
    def marrow(self, *arguments):
        return marrow(
            *arguments,
            plugins=[TEST_PLUGINS],
            extra_environment={"MARROW_CACHE": str(self.scratch / "cache")},
            cwd=self.scratch
        )

    def answer(self, text, *arguments):
        self.write("p.yaml", PIPELINE)
        self.result = self.marrow("compare", self.write("e.yaml", HEAD + text), "--out", "out", "--quiet", *arguments)
        self.assertEqual(self.result.returncode, 0, self.result.stderr)
        return json.loads((self.scratch / "out" / "comparison.json").read_text())


class Statistics(ComparisonCase):
    def variant(self, starts, limit):
        text = "starts: {node: start, %s}\nsuccess: {number.value: %g}\nvariants: {a: {}}\nset: {drawn.uses: %s}\n"
        return self.answer(text % (starts, limit, "test.draw"))["variants"][0]

    def values(self):
        rows = (self.scratch / "out" / "cells.jsonl").read_text().splitlines()
        return [json.loads(row)["number.value"] for row in rows]

    def test_starts_that_end_alike_are_one_run(self):
        self.variant("count: 1", 0)
        limit = sorted(self.values())[4] - 1e-6
        once = self.variant("count: 1", limit)["success"]
        self.assertEqual((once["count"], once["of"], once["effective_runs"]), (4, 8, 8))
        many = self.variant("count: 6", limit)["success"]  # displaced by nothing
        self.assertEqual((many["count"], many["of"], many["effective_runs"]), (24, 48, 8))
        self.assertEqual((many["low"], many["high"]), (once["low"], once["high"]))
        self.assertIn("50.0 % (21.5 to 78.5)", self.result.stdout)  # Wilson's of 4 of 8

    def test_medians_have_intervals(self):
        variant = self.variant("count: 3, translation_mm: 0.1", 0)
        figure = variant["metrics"]["number.value"]
        values = self.values()
        self.assertEqual(figure["count"], 24)
        self.assertLess(min(values), figure["median_low"])
        self.assertLess(figure["median_low"], figure["median"])
        self.assertLess(figure["median"], figure["median_high"])
        self.assertLess(figure["median_high"], max(values))
        self.assertIn("median, 95 % interval", self.result.stdout)
        self.assertIn("%.4f to %.4f" % (figure["median_low"], figure["median_high"]), self.result.stdout)
        self.assertNotIn("median_low", variant["seconds"])


if __name__ == "__main__":
    main()
