# SPDX-License-Identifier: Apache-2.0
"""The statistics in a comparison's answer: intervals that know that the starts of a case are not independent."""
import json
import re

from compare_cases import Compared
from harness.program import main

PIPELINE = """marrow: 1
nodes:
  start: {uses: test.displaced}
  drawn: {uses: test.draw}
  shift: {uses: test.constant}
  more: {uses: test.add, in: {a: drawn, b: shift}}
  sum: {uses: test.add, in: {a: start, b: more}}
outputs: {number: sum}
"""
HEAD = """experiment: 1
name: e
pipeline: p.yaml
cases: {seeds: 1..8}
metrics: [number.value]
timed_cells: 0
"""
STARTS = "starts: {node: start, count: 2, translation_mm: 0.1}\n"
SHIFTS = STARTS + "variants: {a: {shift.value: 0}, b: {shift.value: 5}}\n"


class Seeded(Compared):
    pipeline, cases = PIPELINE, ()


class Statistics(Seeded):
    def of_variant(self, starts, limit):
        """The only variant's figures. Displaced by nothing, all starts of a case end alike."""
        head = HEAD + "starts: {node: start, %s}\nsuccess: {number.value: %g}\nset: {drawn.uses: test.draw}\n" % (
            starts,
            limit,
        )
        self.experiment("e", "{a: {}}", head)
        self.told = self.compare("--quiet").stdout
        return self.answer()["variants"][0]

    def values(self):
        return [row["number.value"] for row in self.json_lines("out/cells.jsonl")]

    def test_starts_that_end_alike_are_one_run(self):
        self.of_variant("count: 1", 0)
        limit = sorted(self.values())[4] - 1e-6
        once, many = (self.of_variant("count: %d" % count, limit)["success"] for count in (1, 6))
        self.assertEqual((once["count"], once["of"], once["effective_runs"]), (4, 8, 8))
        self.assertEqual((many["count"], many["of"], many["effective_runs"]), (24, 48, 8))
        self.assertEqual((many["low"], many["high"]), (once["low"], once["high"]))
        self.assertIn("50.0 % (21.5 to 78.5)", self.told)  # Wilson's of 4 of 8

    def test_medians_have_intervals(self):
        variant = self.of_variant("count: 3, translation_mm: 0.1", 0)
        figure, values = variant["metrics"]["number.value"], self.values()
        self.assertEqual(figure["count"], 24)
        order = [min(values), figure["median_low"], figure["median"], figure["median_high"], max(values)]
        self.assertEqual(order, sorted(set(order)))
        self.assertIn("median, 95 % interval", self.told)
        self.assertIn("%.0f to %.0f" % (figure["median_low"], figure["median_high"]), self.told)
        self.assertNotIn("median_low", variant["seconds"])


class MoreCases(Seeded):
    def stopped(self, rule, *arguments, variants=SHIFTS, **more):
        stop = "stop: {%s, most_cases: 40, look_every: 8}\n" % rule if rule else ""
        self.write("e.yaml", HEAD + variants + stop)
        return self.compare(*arguments, **more)

    def stop(self, *names):
        stop = self.answer()["stop"]
        return tuple(stop[name] for name in names)

    def test_a_difference_is_shown_early(self):
        difference, further = "difference: number.value", ["--more-cases", "32"]
        told = self.stopped(difference, *further, "--dry-run").stdout
        self.assertIn("160 cells: 2 variants, 40 cases, 2 starts", told)
        told = self.stopped(difference).stdout
        self.assertIn("look 1 of 5, 8 cases: b is not shown to differ from a in number.value: p = 0.00781", told)
        self.assertIn("; --more-cases goes on, with 8 cases a look", told)
        rows = sorted((self.out / "cells").rglob("cell.json"))
        times = [row.stat().st_mtime_ns for row in rows]
        self.assertEqual(len(rows), 32)
        self.refused("no case 'seed-16'", "cell", self.file, "a/seed-16/0", "--out", "out")
        more = self.stopped(difference, *further)
        self.assertEqual([row.stat().st_mtime_ns for row in rows], times, "no row is made again")
        self.assertIn("marrow: look 1 of 5, 8 cases: b is not shown", more.stderr)
        for said in (
            "64 cells: 2 variants, 16 cases, 2 starts; 32 were there already",
            "look 2 of 5, 16 cases: b differs from a in number.value: p = 3.05e-05, below 0.000788",
            "The median difference is 5, within 5 to 5, which holds with 95 % confidence",
            "The other intervals and p do not count the looks.",
        ):
            self.assertIn(said, more.stdout)
        self.assertEqual(self.stop("look", "looks", "cases", "most_cases"), (2, 5, 16, 40))
        self.assertEqual(self.stop("is_met", "variant", "figure"), (True, "b", "number.value"))
        self.assertEqual(self.stop("low", "high", "difference", "alpha"), (5, 5, 5, 0.05))
        again = self.stopped(difference, *further).stdout
        self.assertIn("64 cells: 2 variants, 16 cases, 2 starts; 64 were there already", again)
        # A further cell by itself
        cell = self.printed("cell", self.file, "a/seed-16/0", "--more-cases", "8", "--out", "out")
        self.assertEqual(json.loads(cell)["case"], "seed-16")

    def test_without_a_difference_it_goes_to_the_end(self):
        variants = SHIFTS.replace("5}", "0}")
        told = self.stopped("difference: number.value", "--more-cases", "100", variants=variants).stdout
        self.assertIn("look 5 of 5, 40 cases: b is not shown to differ from a in number.value: p = 1", told)
        self.assertIn("; this was the last look", told)
        self.assertEqual(self.stop("is_met"), (False,))

    def test_a_failed_cell_is_tried_once_a_command(self):
        broken = "  broken: {uses: test.fail_above, in: {a: more}, with: {value: 300000}}\noutputs: {number: broken"
        self.write("p.yaml", PIPELINE.replace("outputs: {number: sum", broken))
        rule = "stop: {difference: number.value, alpha: 0.001, most_cases: 32, look_every: 8}\n"
        self.write("e.yaml", HEAD + SHIFTS + rule)
        result = self.compare("--more-cases", "24")
        self.assertIn("failed cells", result.stdout)
        looks = result.stderr.count("marrow: look")
        self.assertGreaterEqual(looks, 1)
        jobs = re.findall(r"(\d+) of (\d+), .* to go: [ab]/seed-", result.stderr)
        self.assertGreaterEqual(len(jobs), looks)
        self.assertEqual({int(of) for _, of in jobs}, {32}, "at each look only the 8 new cases")

    def test_an_interval_is_narrow_enough(self):
        told = self.stopped("figure: number.value, width: 1", "--more-cases", "17").stdout
        self.assertEqual(self.stop("look", "cases", "is_met", "width"), (3, 24, False, 1), "no more than asked for")
        self.assertIn("look 3 of 5, 24 cases: the widest interval of number.value is ", told)
        variants = SHIFTS + "success: {number.value: 1e9}\n"
        told = self.stopped("figure: success, width: 0.4", "--more-cases", "32", variants=variants).stdout
        self.assertEqual(self.stop("figure", "is_met", "high"), ("success", True, 1))
        self.assertLessEqual(1 - self.stop("low")[0], 0.4)
        self.assertIn("the widest interval of the success rate is ", told)

    def test_faults(self):
        for rule, arguments, message in (
            ("", ["8"], "e.yaml does not say when to stop adding cases; add for example  stop: {figure: number.value"),
            (
                *("difference: number.value", ["7"]),
                "--more-cases 7 is less than the 8 cases from one look to the next; give at least as many",
            ),
            (
                *("difference: number.value", ["8", "--emit", "parallel"]),
                "--more-cases looks at each batch of cases before the next one, so it runs here;",
            ),
        ):
            self.assertIn(message, self.stopped(rule, "--more-cases", *arguments, status=2).stderr)


class Sweep(Seeded):
    def curves(self, options, points, more=""):
        self.write("e.yaml", HEAD + STARTS + "sweep: {options: {%s}, %s}\n%s" % (options, points, more))
        self.compare()
        self.assertIn('"curves":', self.read("out/report.html"))
        return self.answer()["curves"]

    def test_a_grid_has_a_point_for_each_value(self):
        options = "shift.value: [0, 100], shift.count: {range: [1, 4], whole: true, scale: log}"
        curves = self.curves(options, "grid: 3", "success: {number.value: 1000000000}\n")
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
        curves = self.curves("shift.value: [0, 80], shift.count: {range: [1, 9], whole: true}", "sobol: 16")
        self.assertEqual([curve["option"] for curve in curves], ["shift.value", "shift.count"])
        self.assertEqual([point["value"] for point in curves[0]["points"]], [2.5 + 10 * i for i in range(8)])
        self.assertEqual([point["runs"] for point in curves[0]["points"]], [32] * 8)

    def test_each_variant_has_its_own(self):
        variants = "variants: {a: {}, b: {start.uses: test.displaced}}\nbaseline: b+0\n"
        curves = self.curves("shift.value: [0, 100]", "grid: 2", variants)
        self.assertEqual([curve["variant"] for curve in curves], ["a", "b"])


if __name__ == "__main__":
    main()
