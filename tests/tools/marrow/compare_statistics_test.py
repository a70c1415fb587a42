# SPDX-License-Identifier: Apache-2.0
"""The statistics in a comparison's answer: intervals that know that the starts of a case are not independent."""
import json
import re

from harness.program import Case, main

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
    def answer(self, text, *arguments):
        self.write("p.yaml", PIPELINE)
        self.result = self.marrow("compare", self.write("e.yaml", HEAD + text), "--out", "out", "--quiet", *arguments)
        self.assertEqual(self.result.returncode, 0, self.result.stderr)
        return super().answer()


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
        self.assertIn("%.0f to %.0f" % (figure["median_low"], figure["median_high"]), self.result.stdout)
        self.assertNotIn("median_low", variant["seconds"])


SEEDS = "starts: {node: start, count: 2, translation_mm: 0.1}\nvariants: {a: {shift.value: 0}, b: {shift.value: 5}}\n"
SHIFTED = PIPELINE.replace("{a: start, b: drawn}", "{a: start, b: more}").replace(
    "outputs", "  shift: {uses: test.constant}\n  more: {uses: test.add, in: {a: drawn, b: shift}}\noutputs"
)


class StoppedCase(ComparisonCase):
    def compare(self, rule, *arguments, variants=SEEDS):
        self.write("p.yaml", SHIFTED)
        text = HEAD + variants + ("stop: {%s, most_cases: 40, look_every: 8}\n" % rule if rule else "")
        return self.marrow("compare", self.write("e.yaml", text), "--out", "out", *arguments)


class MoreCases(StoppedCase):
    def stop(self):
        return Case.answer(self)["stop"]

    def test_a_difference_is_shown_early(self):
        first = self.compare("difference: number.value")
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertIn(
            "look 1 of 5, 8 cases: b is not shown to differ from a in number.value: p = 0.00781", first.stdout
        )
        self.assertIn("; --more-cases goes on, with 8 cases a look", first.stdout)
        rows = sorted((self.scratch / "out" / "cells").rglob("cell.json"))
        times = [row.stat().st_mtime_ns for row in rows]
        self.assertEqual(len(rows), 32)
        more = self.compare("difference: number.value", "--more-cases", "32")
        self.assertEqual(more.returncode, 0, more.stderr)
        self.assertIn("64 cells: 2 variants, 16 cases, 2 starts; 32 were there already", more.stdout)
        self.assertEqual([row.stat().st_mtime_ns for row in rows], times, "no row is made again")
        self.assertIn("marrow: look 1 of 5, 8 cases: b is not shown", more.stderr)
        self.assertIn(
            "look 2 of 5, 16 cases: b differs from a in number.value: p = 3.05e-05, below 0.000788", more.stdout
        )
        self.assertIn("The median difference is 5, within 5 to 5, which holds with 95 % confidence", more.stdout)
        self.assertIn("The other intervals and p do not count the looks.", more.stdout)
        stop = self.stop()
        self.assertEqual((stop["look"], stop["looks"], stop["cases"], stop["most_cases"]), (2, 5, 16, 40))
        self.assertEqual((stop["is_met"], stop["variant"], stop["figure"]), (True, "b", "number.value"))
        self.assertEqual((stop["low"], stop["high"], stop["difference"], stop["alpha"]), (5, 5, 5, 0.05))
        again = self.compare("difference: number.value", "--more-cases", "32")
        self.assertIn("64 cells: 2 variants, 16 cases, 2 starts; 64 were there already", again.stdout)

    def test_without_a_difference_it_goes_to_the_end(self):
        result = self.compare("difference: number.value", "--more-cases", "100", variants=SEEDS.replace("5}", "0}"))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("look 5 of 5, 40 cases: b is not shown to differ from a in number.value: p = 1", result.stdout)
        self.assertIn("; this was the last look", result.stdout)
        self.assertFalse(self.stop()["is_met"])

    def test_a_failed_cell_is_tried_once_a_command(self):
        broken = "  broken: {uses: test.fail_above, in: {a: more}, with: {value: 300000}}\noutputs: {number: broken"
        pipeline = SHIFTED.replace("outputs: {number: sum", broken)
        self.write("broken.yaml", pipeline)
        text = (HEAD + SEEDS).replace("p.yaml", "broken.yaml")
        rule = "stop: {difference: number.value, alpha: 0.001, most_cases: 32, look_every: 8}\n"
        result = self.marrow("compare", self.write("b.yaml", text + rule), "--out", "b", "--more-cases", "24")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("failed cells", result.stdout)
        looks = result.stderr.count("marrow: look")
        self.assertGreaterEqual(looks, 1)
        jobs = re.findall(r"(\d+) of (\d+), .* to go: [ab]/seed-", result.stderr)
        self.assertGreaterEqual(len(jobs), looks)
        self.assertEqual({int(of) for _, of in jobs}, {32}, "at each look only the 8 new cases")

    def test_it_adds_no_more_than_it_was_asked_for(self):
        result = self.compare("figure: number.value, width: 1", "--more-cases", "17")
        self.assertEqual(result.returncode, 0, result.stderr)
        stop = self.stop()
        self.assertEqual((stop["look"], stop["cases"], stop["is_met"], stop["width"]), (3, 24, False, 1))
        self.assertIn("look 3 of 5, 24 cases: the widest interval of number.value is ", result.stdout)

    def test_a_success_rate_is_narrow_enough(self):
        variants = SEEDS + "success: {number.value: 1e9}\n"
        result = self.compare("figure: success, width: 0.4", "--more-cases", "32", variants=variants)
        self.assertEqual(result.returncode, 0, result.stderr)
        stop = self.stop()
        self.assertEqual((stop["figure"], stop["is_met"], stop["high"]), ("success", True, 1))
        self.assertLessEqual(stop["high"] - stop["low"], 0.4)
        self.assertIn("the widest interval of the success rate is ", result.stdout)

    def test_a_further_cell_by_itself(self):
        self.compare("difference: number.value")
        file = self.scratch / "e.yaml"
        unknown = self.marrow("cell", file, "a/seed-16/0", "--out", "out")
        self.assertEqual(unknown.returncode, 2)
        self.assertIn("no case 'seed-16'", unknown.stderr)
        known = self.marrow("cell", file, "a/seed-16/0", "--more-cases", "8", "--out", "out")
        self.assertEqual(known.returncode, 0, known.stderr)
        self.assertEqual(json.loads(known.stdout)["case"], "seed-16")

    def test_how_much_there_is_to_do(self):
        result = self.compare("difference: number.value", "--more-cases", "32", "--dry-run")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("160 cells: 2 variants, 40 cases, 2 starts", result.stdout)

    def test_faults(self):
        for rule, arguments, message in (
            ("", ["8"], "e.yaml does not say when to stop adding cases; add for example  stop: {figure: number.value"),
            (
                "difference: number.value",
                ["7"],
                "--more-cases 7 is less than the 8 cases from one look to the next; give at least as many",
            ),
            (
                "difference: number.value",
                ["8", "--emit", "parallel"],
                "--more-cases looks at each batch of cases before the next one, so it runs here;",
            ),
        ):
            result = self.compare(rule, "--more-cases", *arguments)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn(message, result.stderr)


class Sweep(StoppedCase):
    def curves(self, sweep, more=""):
        variants = "starts: {node: start, count: 2, translation_mm: 0.1}\nsweep: {options: {%s}, %s}\n%s"
        result = self.compare("", variants=variants % (*sweep, more))
        self.assertEqual(result.returncode, 0, result.stderr)
        answer = Case.answer(self)
        page = (self.scratch / "out" / "report.html").read_text()
        self.assertIn('"curves":', page)
        return answer["curves"]

    def test_a_grid_has_a_point_for_each_value(self):
        curves = self.curves(
            ("shift.value: [0, 100], shift.count: {range: [1, 4], whole: true, scale: log}", "grid: 3"),
            "success: {number.value: 1000000000}\n",
        )
        self.assertEqual(
            [(curve["option"], curve["figure"], curve["scale"]) for curve in curves],
            [
                ("shift.value", "number.value", "linear"),
                ("shift.value", "success", "linear"),
                ("shift.count", "number.value", "log"),
                ("shift.count", "success", "log"),
            ],
        )
        points = curves[0]["points"]
        self.assertEqual([point["value"] for point in points], [0, 50, 100])
        self.assertEqual([point["runs"] for point in points], [48, 48, 48])  # 3 counts, 8 cases, 2 starts
        for i, point in enumerate(points):
            self.assertAlmostEqual(point["middle"] - points[0]["middle"], 50 * i, 6)
            self.assertLess(point["low"], point["middle"])
            self.assertLess(point["middle"], point["high"])
        self.assertEqual([point["value"] for point in curves[2]["points"]], [1, 2, 4])
        self.assertEqual([(point["middle"], point["high"]) for point in curves[1]["points"]], [(1, 1)] * 3)
        self.assertAlmostEqual(curves[1]["points"][0]["low"], 0.6756, 4)  # Wilson's of 8 of 8

    def test_sobols_points_are_put_into_bins(self):
        curves = self.curves(("shift.value: [0, 80], shift.count: {range: [1, 9], whole: true}", "sobol: 16"))
        self.assertEqual([curve["option"] for curve in curves], ["shift.value", "shift.count"])
        self.assertEqual([point["value"] for point in curves[0]["points"]], [2.5 + 10 * i for i in range(8)])
        self.assertEqual([point["runs"] for point in curves[0]["points"]], [32] * 8)

    def test_each_variant_has_its_own(self):
        curves = self.curves(
            ("shift.value: [0, 100]", "grid: 2"), "variants: {a: {}, b: {start.uses: test.displaced}}\nbaseline: b+0\n"
        )
        self.assertEqual([curve["variant"] for curve in curves], ["a", "b"])


if __name__ == "__main__":
    main()
