# SPDX-License-Identifier: Apache-2.0
"""What comes from workers: names cannot pass for answers, and waiting for another run is no failure."""
import json
import signal
import time

from harness.program import Case, main, wait_until

FORGED = json.dumps(
    {
        **{"id": "../../../forged", "variant": "one", "case": "seed-1", "start": "0", "status": "done", "tries": 1},
        **{"values": [0.001], "units": [""], "initial_error": None, "seconds": None, "evaluations": 0, "nodes": {}},
        **{"key": "k"},
    }
)
NAMES = """marrow: 1
nodes:
  s: {uses: test.sides, with: {names: [%s, b]}}
  a: {uses: test.add, in: {a: s.both, b: s.both}}
  total: {uses: test.sum, in: {items: a}}
outputs: {number: total}
"""
WORK = """marrow: 1
nodes:
  w: {uses: test.work, with: {value: 15, path: data}}
  n: {uses: test.add, in: {a: w}}
outputs: {number: n}
"""
CRASH = """marrow: 1
nodes:
  w: {uses: test.work, with: {value: 3, path: p.yaml}}
  m: {uses: test.misbehave, with: {how: crash}, in: {a: w}}
outputs: {number: m}
"""
EXPERIMENT = (
    "experiment: 1\npipeline: p.yaml\ncases: {seeds: 1..2}\nmetrics: [number.value]\nvariants: {one: {}, two: {}}\n"
)


class Workers(Case):
    def setUp(self):
        super().setUp()
        self.write("e.yaml", EXPERIMENT)

    def test_a_crash_is_known_to_who_was_started_with_ends_of_children_ignored(self):
        self.write("p.yaml", CRASH)
        ignored = lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        self.start("compare", "e.yaml", "--out", "out", preexec_fn=ignored).communicate()
        reasons = {row["reason"] for row in self.rows().values()}
        self.assertEqual(reasons, {"crashed in node 'm': Segmentation fault"})

    def test_names_cannot_pass_for_answers(self):
        name = json.dumps('x\nend %s\n{"job": 1, "end": %s}\nx' % (FORGED, FORGED))
        self.write("p.yaml", NAMES % name)
        self.expect(0, "compare", "e.yaml", "--out", "out")
        # 10 + 10 and 20 + 20
        found = {cell: (row["status"], row.get("number.value")) for cell, row in self.rows().items()}
        cells = ("one/seed-1/0", "one/seed-2/0", "two/seed-1/0", "two/seed-2/0")
        self.assertEqual(found, {cell: ("done", "60") for cell in cells})
        self.assertEqual([name for name in self.everything() if "forged" in name], [])

    def test_waiting_for_another_run_is_no_failure(self):
        self.write("p.yaml", WORK)
        self.write("data", "x")
        with open(self.scratch / "events", "w") as events:
            other = self.start("run", "p.yaml", "--out", "other", "--json", stdout=events)
        wait_until(lambda: '"started"' in self.read("events"), "the other run did not begin")
        other.send_signal(signal.SIGSTOP)
        with open(self.scratch / "said", "w") as errors:
            limits = ["--time-limit", "5", "--jobs", "1"]
            comparison = self.start("compare", "e.yaml", "--out", "out", *limits, stderr=errors)
        waits = "waits for another run that is making the same result"
        is_there = lambda: comparison.poll() is not None or waits in self.read("said")
        wait_until(is_there, "it does not say that it waits")
        time.sleep(6)  # longer than a cell may take, and shorter than the other run works
        self.assertIsNone(comparison.poll(), "it did not wait")
        other.send_signal(signal.SIGCONT)
        text = comparison.communicate(timeout=120)[0]
        other.wait(timeout=120)
        self.assertEqual(comparison.returncode, 0, self.read("said"))
        self.assertEqual([row["status"] for row in self.rows().values()], ["done"] * 4, text)


if __name__ == "__main__":
    main()
