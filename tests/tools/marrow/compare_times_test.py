# SPDX-License-Identifier: Apache-2.0
"""Times and amounts of work in a comparison are of the same cases and starts for all variants. A node writes down each
of its calls, so most tests do not depend on the clock: they compare lists of calls that were written by hand."""
import json
import os

from harness import TEST_PLUGINS
from harness.program import Case, main

PIPELINE = """marrow: 1
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
HEAD = "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\n"
VARIANTS = "a: {log.name: a}, b: {log.name: b}, c: {log.name: c}"


class Times(Case):
    plugins = [TEST_PLUGINS, TEST_PLUGINS.parent / "timed_plugins"]

    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)

    def cases(self, *names):
        for name in names:
            (self.scratch / "cases" / name).mkdir(parents=True)
            self.write("cases/%s/data" % name, name)  # else they would be the same case

    def compare(self, timed_cells, variants=VARIANTS, *arguments):
        """Runs the cells. Then, as a second command, times them. Returns what that said and the calls it made."""
        calls = self.scratch / "calls"
        environment = {"MARROW_TEST_CALLS": str(calls), "MARROW_TEST_FAILS": str(self.scratch / "fails")}
        said = []
        fails = self.scratch / "fails"
        for count in (0, timed_cells):
            calls.write_text("")
            if count:
                fails.write_text(getattr(self, "fails_when_timed", ""))
            file = self.write("e.yaml", HEAD + "timed_cells: %d\nvariants: {%s}\n" % (count, variants))
            result = self.marrow("compare", file, "--out", "out", *arguments, extra_environment=environment)
            self.assertEqual(result.returncode, 0, result.stderr + result.stdout)
            said.append(result.stdout)
            if fails.exists():
                fails.unlink()
        self.said_first = said[0]
        return said[1], calls.read_text().splitlines()

    def timed(self):
        rows = [json.loads(line) for line in (self.scratch / "out/cells.jsonl").read_text().splitlines()]
        return sorted(row["variant"] + row["case"] for row in rows if row["seconds"] is not None)

    def of_variants(self, key):
        return {one["name"]: one[key] for one in self.answer()["variants"]}

    def test_each_cell_runs_once_before_and_the_variants_take_turns(self):
        self.cases("10", "20", "30", "40", "50")
        said, calls = self.compare(2)
        turns = ["a 10", "b 10", "c 10", "c 30", "b 30", "a 30"]  # the first and the middle one of five cases
        self.assertEqual(calls, [call for call in turns for _ in range(2)])
        self.assertEqual(self.timed(), ["a10", "a30", "b10", "b30", "c10", "c30"])
        sentence = (
            "Times: 2 runs of each variant, the same cases and starts for all, in turns, one at a time on %d thread%s "
            "with nothing else running. Each cell runs once before, which does not count. What all variants share is "
            "read back, everything else is made anew." % (os.cpu_count(), "" if os.cpu_count() == 1 else "s")
        )
        self.assertIn("\n" + sentence + "\n", said)
        self.assertEqual(self.answer()["times"], sentence)
        self.assertIn(sentence, (self.scratch / "out/report.html").read_text())

    def test_no_variant_is_timed_on_easier_cases(self):
        self.cases("10", "20", "30", "40")
        variants = "a: {log.name: a}, b: {log.name: b, log.not_for: '10'}, d: {log.name: d, f.value: 0}"
        said, calls = self.compare(3, variants)
        self.assertEqual(calls[0], "b 10", "the failed cell is tried again")
        self.assertEqual(self.timed(), ["a20", "a30", "a40", "b20", "b30", "b40"])
        self.assertEqual(calls[1:9], ["a 20", "a 20", "b 20", "b 20", "b 30", "b 30", "a 30", "a 30"])
        self.assertIn(" Without times: d, which was done nowhere without a failure.\n", said)
        self.assertEqual(
            {name: one["count"] for name, one in self.of_variants("seconds").items()}, {"a": 3, "b": 3, "d": 0}
        )
        self.assertRegex(said, r"\nd +4 +4 .* - +-\n")

        said, calls = self.compare(4, variants)
        self.assertEqual(self.timed(), ["a20", "a30", "a40", "b20", "b30", "b40"])
        self.assertIn(" In no other case and start was every variant done without a failure.", said)

    def test_nothing_is_timed_where_no_case_was_done_by_all(self):
        self.cases("10", "20")
        said, calls = self.compare(2, "a: {log.name: a, log.not_for: '20'}, b: {log.name: b, log.not_for: '10'}")
        self.assertEqual(sorted(calls), ["a 20", "b 10"], "only the failed cells are tried again")
        self.assertIn(
            "\nTimes were not measured: there is no case and start in which every variant was done without a "
            "failure.\n",
            said,
        )
        self.assertEqual(self.timed(), [])

    def test_the_time_until_a_node_fails_that_may_fail_is_no_time_of_the_work(self):
        self.cases("10", "20")
        self.write("p.yaml", PIPELINE.replace("{value: 100}}", "{value: 100}, may_fail: true}"))
        said, calls = self.compare(2, "a: {log.name: a}, bb: {log.name: bb, f.value: 1}")
        self.assertEqual(self.timed(), ["a10", "a20"])
        self.assertIn(" Without times: bb, which was done nowhere without a failure.", said)

    def test_a_run_that_fails_while_it_is_timed_costs_the_others_their_time_of_that_case(self):
        self.cases("10", "20")
        self.fails_when_timed = "b 10"
        said, calls = self.compare(2)
        self.assertEqual(self.timed(), ["a20", "b20", "c20"])
        self.assertIn("Times: 1 run of each variant, the same cases", said)
        self.assertIn(" Left out: 1 case and start in which a run failed while it was timed.", said)

        self.cases("05")  # the first one is the one that is timed
        self.fails_when_timed = "b 05"
        said, calls = self.compare(1)
        self.assertEqual(self.timed(), [])
        self.assertIn("Times were not measured. Left out: 1 case and start in which a run failed", said)

    def test_more_than_there_is_and_none(self):
        self.cases("10", "20")
        said, calls = self.compare(1000)
        self.assertEqual(len(calls), 12)
        self.assertIn("Times: 2 runs of each variant", said)
        self.assertNotIn("In no other case", said)
        said, calls = self.compare(0)
        self.assertEqual((calls, self.timed()), ([], []))
        self.assertNotIn("Times", said)
        self.assertEqual(self.answer()["times"], "Times were not measured.")

    def test_times_are_kept_until_a_variant_changes(self):
        self.cases("10")
        self.compare(1)
        first = self.of_variants("seconds")
        said, calls = self.compare(1)
        self.assertEqual(calls, [])
        self.assertEqual(self.of_variants("seconds"), first)
        # Beside a new variant, times of an earlier day would be those of another state of the machine.
        said, calls = self.compare(1, VARIANTS + ", d: {log.name: d}")
        self.assertEqual(calls, [call for name in "abcd" for call in [name + " 10"] * 2])

    def test_who_comes_first_does_not_pay_for_the_cold_start(self):
        """The first call in a process sleeps for a second; all others do nothing."""
        self.write("p.yaml", COLD)
        self.cases("10")
        head = HEAD.replace("{folders: [cases/*]}", "{seeds: 1..2}")
        file = self.write("e.yaml", head + "timed_cells: 2\nvariants: {a: {c.number: 1}, b: {c.number: 2}}\n")
        result = self.marrow("compare", file, "--out", "out")
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = [json.loads(line) for line in (self.scratch / "out/cells.jsonl").read_text().splitlines()]
        self.assertEqual(len(rows), 4)
        for row in rows:
            self.assertLess(row["seconds"], 1, row["id"])

    def test_without_a_store_all_is_made_anew(self):
        self.cases("10")
        said, calls = self.compare(1, VARIANTS, "--no-cache")
        self.assertEqual(calls, [call for name in "abc" for call in [name + " 10"] * 2])
        self.assertIn(" Everything is made anew, also what all variants share.\n", said)

    def test_evaluations_are_of_the_same_cases(self):
        """The search takes as many evaluations as the case's name says, for both variants. One fails in the hard case,
        so 300 (of 100, 300 and 900) against 200 (of 100 and 300) would be a difference that is none."""
        self.cases("100", "300", "900")
        self.compare(0, "a: {log.name: a}, b: {log.name: b, log.not_for: '900'}, d: {log.name: d, f.value: 0}")
        evaluations = self.of_variants("evaluations")
        self.assertEqual([evaluations[name]["median"] for name in "ab"], [200, 200])
        self.assertEqual([evaluations[name]["count"] for name in "abd"], [2, 2, 0])

    def test_calls_are_those_that_this_command_made(self):
        """In each of two cases 'log' runs for each of three variants, and 'p' once; 'f' once, as it always gets a 1."""
        self.cases("10", "20")
        said, _ = self.compare(0)
        self.assertIn("0 were there already\ncalls of nodes: 9 made, 9 shared or read back\n", self.said_first)
        self.assertIn("6 were there already\ncalls of nodes: 0 made, 0 shared or read back\n", said)


if __name__ == "__main__":
    main()
