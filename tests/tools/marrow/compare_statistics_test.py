# SPDX-License-Identifier: Apache-2.0
"""The statistics in a comparison's answer: intervals that know that the starts of a case are not independent."""
import json
import os
import re

from compare_cases import Compared
from harness import TEST_PLUGINS
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


# Times and amounts of work in a comparison are of the same cases and starts for all variants. A node writes down each
# of its calls, so most tests do not depend on the clock: they compare lists of calls that were written by hand.
PIPELINE_OF_TIMES = """marrow: 1
inputs: {case: {type: path}}
nodes:
  log: {uses: test.logged, with: {path: $case}}
  f: {uses: test.fail_above, in: {a: log}, with: {value: 100}}
  p: {uses: test.searched, with: {path: $case}}
outputs: {number: f, pose: p}
"""
COLD = """marrow: 1
nodes:
  c: {uses: test.cold, with: {first_s: 1}}
outputs: {number: c}
"""
HEAD_OF_TIMES = (
    "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\ntimed_cells: %d\n"
)
VARIANTS = "a: {log.name: a}, b: {log.name: b}, c: {log.name: c}"


class Times(Compared):
    plugins = [TEST_PLUGINS, TEST_PLUGINS.parent / "timed_plugins"]
    pipeline, cases = PIPELINE_OF_TIMES, ()

    def timed(self, timed_cells, cases="", variants=VARIANTS, *arguments, failing=""):
        """Runs the cells. Then, as a second command, times them, where the call `failing` fails. Keeps what that said
        and the calls it made, and gives the cells that have a time."""
        for name in cases.split():
            self.add_case(name)
        calls, fails = self.scratch / "calls", self.scratch / "fails"
        self.environment = {"MARROW_TEST_CALLS": str(calls), "MARROW_TEST_FAILS": str(fails)}
        said = []
        for count in (0, timed_cells):
            calls.write_text("")
            if count:
                fails.write_text(failing)
            self.experiment("e", "{%s}" % variants, HEAD_OF_TIMES % count)
            said.append(self.compare(*arguments).stdout)
            fails.unlink(missing_ok=True)
        self.said_first, self.said = said
        self.calls = calls.read_text().splitlines()
        rows = self.json_lines("out/cells.jsonl")
        return " ".join(sorted(row["variant"] + row["case"] for row in rows if row["seconds"] is not None))

    def of_variants(self, key):
        return {one["name"]: one[key] for one in self.answer()["variants"]}

    def test_each_cell_runs_once_before_and_the_variants_take_turns(self):
        self.assertEqual(self.timed(2, "10 20 30 40 50"), "a10 a30 b10 b30 c10 c30")
        turns = ["a 10", "b 10", "c 10", "c 30", "b 30", "a 30"]  # the first and the middle one of five cases
        self.assertEqual(self.calls, [call for call in turns for _ in range(2)])
        sentence = (
            "Times: 2 runs of each variant, the same cases and starts for all, in turns, one at a time on %d thread%s "
            "with nothing else running. Each cell runs once before, which does not count. What all variants share is "
            "read back, everything else is made anew." % (os.cpu_count(), "" if os.cpu_count() == 1 else "s")
        )
        self.assertIn("\n" + sentence + "\n", self.said)
        self.assertEqual(self.answer()["times"], sentence)
        self.assertIn(sentence, self.read("out/report.html"))

    def test_no_variant_is_timed_on_easier_cases(self):
        variants = "a: {log.name: a}, b: {log.name: b, log.not_for: '10'}, d: {log.name: d, f.value: 0}"
        self.assertEqual(self.timed(3, "10 20 30 40", variants), "a20 a30 a40 b20 b30 b40")
        self.assertEqual(self.calls[0], "b 10", "the failed cell is tried again")
        self.assertEqual(self.calls[1:9], ["a 20", "a 20", "b 20", "b 20", "b 30", "b 30", "a 30", "a 30"])
        self.assertIn(" Without times: d, which was done nowhere without a failure.\n", self.said)
        counts = {name: one["count"] for name, one in self.of_variants("seconds").items()}
        self.assertEqual(counts, {"a": 3, "b": 3, "d": 0})
        self.assertRegex(self.said, r"\nd +4 +4 .* - +-\n")
        self.assertEqual(self.timed(4, "", variants), "a20 a30 a40 b20 b30 b40")
        self.assertIn(" In no other case and start was every variant done without a failure.", self.said)

    def test_nothing_is_timed_where_no_case_was_done_by_all(self):
        variants = "a: {log.name: a, log.not_for: '20'}, b: {log.name: b, log.not_for: '10'}"
        self.assertEqual(self.timed(2, "10 20", variants), "")
        self.assertEqual(sorted(self.calls), ["a 20", "b 10"], "only the failed cells are tried again")
        said = (
            "\nTimes were not measured: there is no case and start in which every variant was done without a failure.\n"
        )
        self.assertIn(said, self.said)

    def test_the_time_until_a_node_fails_that_may_fail_is_no_time_of_the_work(self):
        self.write("p.yaml", PIPELINE_OF_TIMES.replace("{value: 100}}", "{value: 100}, may_fail: true}"))
        variants = "a: {log.name: a}, bb: {log.name: bb, f.value: 1}"
        self.assertEqual(self.timed(2, "10 20", variants), "a10 a20")
        self.assertIn(" Without times: bb, which was done nowhere without a failure.", self.said)

    def test_a_run_that_fails_while_it_is_timed_costs_the_others_their_time_of_that_case(self):
        left_out = "Left out: 1 case and start in which a run failed"
        self.assertEqual(self.timed(2, "10 20", failing="b 10"), "a20 b20 c20")
        self.assertIn("Times: 1 run of each variant, the same cases", self.said)
        self.assertIn(" %s while it was timed." % left_out, self.said)
        self.assertEqual(self.timed(1, "05", failing="b 05"), "")  # the first one is the one that is timed
        self.assertIn("Times were not measured. " + left_out, self.said)

    def test_more_than_there_is_and_none(self):
        self.timed(1000, "10 20")
        self.assertEqual(len(self.calls), 12)
        self.assertIn("Times: 2 runs of each variant", self.said)
        self.assertNotIn("In no other case", self.said)
        self.assertEqual((self.timed(0), self.calls), ("", []))
        self.assertNotIn("Times", self.said)
        self.assertEqual(self.answer()["times"], "Times were not measured.")

    def test_times_are_kept_until_a_variant_changes(self):
        self.timed(1, "10")
        first = self.of_variants("seconds")
        self.timed(1)
        self.assertEqual(self.calls, [])
        self.assertEqual(self.of_variants("seconds"), first)
        # Beside a new variant, times of an earlier day would be those of another state of the machine.
        self.timed(1, "", VARIANTS + ", d: {log.name: d}")
        self.assertEqual(self.calls, [call for name in "abcd" for call in [name + " 10"] * 2])

    def test_who_comes_first_does_not_pay_for_the_cold_start(self):
        """The first call in a process sleeps for a second; all others do nothing."""
        self.write("p.yaml", COLD)
        head = HEAD_OF_TIMES.replace("{folders: [cases/*]}", "{seeds: 1..2}") % 2
        self.experiment("e", "{a: {c.number: 1}, b: {c.number: 2}}", head)
        self.compare()
        rows = self.json_lines("out/cells.jsonl")
        self.assertEqual(len(rows), 4)
        for row in rows:
            self.assertLess(row["seconds"], 1, row["id"])

    def test_without_a_store_all_is_made_anew(self):
        self.timed(1, "10", VARIANTS, "--no-cache")
        self.assertEqual(self.calls, [call for name in "abc" for call in [name + " 10"] * 2])
        self.assertIn(" Everything is made anew, also what all variants share.\n", self.said)

    def test_evaluations_are_of_the_same_cases(self):
        """The search takes as many evaluations as the case's name says, for both variants. One fails in the hard case,
        so 300 (of 100, 300 and 900) against 200 (of 100 and 300) would be a difference that is none."""
        variants = "a: {log.name: a}, b: {log.name: b, log.not_for: '900'}, d: {log.name: d, f.value: 0}"
        self.timed(0, "100 300 900", variants)
        evaluations = self.of_variants("evaluations")
        self.assertEqual([evaluations[name]["median"] for name in "ab"], [200, 200])
        self.assertEqual([evaluations[name]["count"] for name in "abd"], [2, 2, 0])

    def test_calls_are_those_that_this_command_made(self):
        """In each of two cases 'log' runs for each of three variants, and 'p' once; 'f' once, as it always gets a 1."""
        self.timed(0, "10 20")
        self.assertIn("0 were there already\ncalls of nodes: 9 made, 9 shared or read back\n", self.said_first)
        self.assertIn("6 were there already\ncalls of nodes: 0 made, 0 shared or read back\n", self.said)


if __name__ == "__main__":
    main()
