# SPDX-License-Identifier: Apache-2.0
"""What comes from workers: names cannot pass for answers, and waiting for another run is no failure."""
import csv
import json
import os
import signal
import subprocess
import time

from harness import MARROW, TEST_PLUGINS
from harness.program import Case, main, marrow, wait_until

FORGED = json.dumps(
    {
        "id": "../../../forged",
        "variant": "one",
        "case": "seed-1",
        "start": "0",
        "status": "done",
        "tries": 1,
        "values": [0.001],
        "units": [""],
        "initial_error": None,
        "seconds": None,
        "evaluations": 0,
        "nodes": {},
        "key": "k",
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
    def compare(self, *arguments):
        return marrow(
            "compare",
            self.write("e.yaml", EXPERIMENT),
            "--out",
            self.scratch / "out",
            *arguments,
            plugins=[TEST_PLUGINS],
            extra_environment={"MARROW_CACHE": str(self.scratch / "cache")}
        )

    def rows(self):
        with open(self.scratch / "out" / "cells.csv", newline="") as stream:
            return [(row["cell"], row["status"], row.get("number.value")) for row in csv.DictReader(stream)]

    def test_a_crash_is_known_to_who_was_started_with_ends_of_children_ignored(self):
        self.write("p.yaml", CRASH)
        subprocess.run(
            [MARROW, "compare", self.write("e.yaml", EXPERIMENT), "--out", self.scratch / "out"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "MARROW_PLUGIN_PATH": str(TEST_PLUGINS)},
            preexec_fn=lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN),
        )
        with open(self.scratch / "out" / "cells.csv", newline="") as stream:
            reasons = {row["reason"] for row in csv.DictReader(stream)}
        self.assertEqual(reasons, {"crashed in node 'm': Segmentation fault"})

    def test_names_cannot_pass_for_answers(self):
        name = json.dumps('x\nend %s\n{"job": 1, "end": %s}\nx' % (FORGED, FORGED))
        self.write("p.yaml", NAMES % name)
        result = self.compare()
        self.assertEqual(result.returncode, 0, result.stderr)
        # 10 + 10 and 20 + 20
        self.assertEqual(
            sorted(self.rows()),
            [(cell, "done", "60") for cell in ("one/seed-1/0", "one/seed-2/0", "two/seed-1/0", "two/seed-2/0")],
        )
        self.assertEqual([str(path) for path in self.scratch.rglob("*forged*")], [])

    def test_waiting_for_another_run_is_no_failure(self):
        self.write("p.yaml", WORK)
        self.write("data", "x")
        environment = dict(os.environ, MARROW_CACHE=str(self.scratch / "cache"), MARROW_PLUGIN_PATH=str(TEST_PLUGINS))
        with open(self.scratch / "events", "w") as events:
            other = subprocess.Popen(
                [str(MARROW), "run", "p.yaml", "--out", "other", "--json"],
                cwd=self.scratch,
                env=environment,
                stdout=events,
            )
        self.addCleanup(other.kill)
        events = self.scratch / "events"
        wait_until(lambda: '"started"' in events.read_text(), "the other run did not begin")
        other.send_signal(signal.SIGSTOP)
        said = self.scratch / "said"
        with open(said, "w") as errors:
            command = [
                str(MARROW),
                "compare",
                str(self.write("e.yaml", EXPERIMENT)),
                "--out",
                "out",
                "--time-limit",
                "5",
            ]
            comparison = subprocess.Popen(
                [*command, "--jobs", "1"],
                cwd=self.scratch,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
            )
        self.addCleanup(comparison.kill)
        wait_until(
            lambda: comparison.poll() is not None or "waits for another run" in said.read_text(),
            "it does not say that it waits",
        )
        time.sleep(6)  # longer than a cell may take, and shorter than the other run works
        self.assertIsNone(comparison.poll(), "it did not wait")
        other.send_signal(signal.SIGCONT)
        text = comparison.communicate(timeout=120)[0]
        other.wait(timeout=120)
        errors = said.read_text()
        self.assertEqual(comparison.returncode, 0, errors)
        self.assertEqual([status for _, status, _ in self.rows()], ["done"] * 4, text)
        self.assertIn("waits for another run that is making the same result", errors)


if __name__ == "__main__":
    main()
