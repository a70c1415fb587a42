# SPDX-License-Identifier: Apache-2.0
"""Times and amounts of work in a comparison are of the same cases and starts for all variants. A node writes down each
of its calls, so most tests do not depend on the clock: they compare lists of calls that were written by hand."""
import os

from compare_cases import Compared
from harness import TEST_PLUGINS
from harness.program import main

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
HEAD = "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\ntimed_cells: %d\n"
VARIANTS = "a: {log.name: a}, b: {log.name: b}, c: {log.name: c}"


class Times(Compared):
    plugins = [TEST_PLUGINS, TEST_PLUGINS.parent / "timed_plugins"]
    pipeline, cases = PIPELINE, ()

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
            self.experiment("e", "{%s}" % variants, HEAD % count)
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
        self.write("p.yaml", PIPELINE.replace("{value: 100}}", "{value: 100}, may_fail: true}"))
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
        head = HEAD.replace("{folders: [cases/*]}", "{seeds: 1..2}") % 2
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
