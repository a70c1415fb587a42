# SPDX-License-Identifier: Apache-2.0
"""Three hosts share results in a folder that refuses locks, shows files late and fails now and then; their clocks
differ, and some of their processes are killed.

    hosts_test.py

A host is a namespace of processes, of names and, where that is possible, of times. Skipped where none can be made.
"""
import collections
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from harness import BUILD, MARROW

SHIM = BUILD / "tests" / "cluster" / "libshared_folder_shim.so"
HOSTS = {"alpha": -30, "beta": 0, "gamma": 30}  # seconds by which their clocks are wrong
CASES, VARIANTS = 6, 3
IDENTITY = r"[A-Za-z0-9]+\.[0-9a-f]{16}\.\d{8}\.\d{12}"

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  shared: {uses: test.work, with: {value: 1.1, path: $case}}
  chance: {uses: test.draw}
  sum: {uses: test.add, in: {a: shared, b: chance}}
  own: {uses: test.fail_above, in: {a: sum}, with: {value: 1000000}}
outputs: {number: own}
"""
SIMULATION = """marrow: 1
nodes:
  chance: {uses: test.draw}
  letters: {uses: test.letters}
  s: {uses: test.add, in: {a: letters, b: chance}}
outputs: {case: s}
"""
EXPERIMENT = """experiment: 1
pipeline: p.yaml
cases: {simulate: {pipeline: s.yaml, seeds: 1..%d}}
metrics: [number.value]
timed_cells: 0
variants: {%s}
""" % (
    CASES,
    ", ".join("v%d: {own.value: %d}" % (i, 1000000 - i) for i in range(VARIANTS)),
)


def namespaces():
    """The options of unshare that make a host; nothing where it is not allowed."""
    options = ["--pid", "--fork", "--mount-proc", "--kill-child", "--uts"]
    for user in [], ["--user", "--map-root-user"]:
        for times in ["--time", "--boottime", "100000"], []:
            command = ["unshare", *user, *options, *times, "true"]
            if shutil.which("unshare") and subprocess.run(command, capture_output=True).returncode == 0:
                return [*user, *options, *times]
    return None


class Host:
    def __init__(self, name, scratch, shared, options):
        self.name, self.scratch, self.shared = name, scratch, shared
        self.command = ["unshare", *options, "sh", "-c", 'hostname "$0"; exec "$@"', name]
        self.environment = dict(
            os.environ,
            MARROW_PLUGIN_PATH=str(BUILD / "tests" / "plugins"),
            MARROW_CACHE=str(scratch / name / "cache"),
            MARROW_SHARED_CACHE=str(shared),
            MARROW_CLAIM_SECONDS="8",
            LD_PRELOAD=str(SHIM),
            SHIM_FOLDER=str(shared),
            SHIM_HIDDEN_MS="3000",
            SHIM_STALE_EVERY="11",
            SHIM_CLOCK_S=str(HOSTS[name]),
        )
        self.faults, self.rows, self.killed = [], [], 0

    def holds_a_claim(self):
        for path in (self.shared / "claims").glob("*"):
            try:
                if path.read_text().startswith(self.name + "."):
                    return True
            except OSError:  # it was given back just now
                pass
        return False

    def cell(self, name, is_killed):
        """Runs a cell. If it is to be killed, this happens while it makes what others wait for."""
        process = subprocess.Popen(
            [*self.command, str(MARROW), "cell", "e.yaml", name, "--out", str(self.scratch / self.name / "out")],
            env=self.environment,
            cwd=self.scratch,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        while is_killed and process.poll() is None:
            if self.holds_a_claim():
                process.kill()  # unshare kills what it started
                break
            time.sleep(0.01)
        out, complaints = process.communicate(timeout=400)
        if process.returncode == -signal.SIGKILL and is_killed:
            self.killed += 1
            return False
        if process.returncode != 0 or complaints:
            self.faults.append("%s on %s: %s %s" % (name, self.name, process.returncode, complaints))
        else:
            self.rows.append(json.loads(out))
        return True

    def cells(self, names, first):
        """Runs cells. From the first that may be killed on, one is: the first that makes something for others."""
        for number, name in enumerate(names):
            if not self.cell(name, number >= first and not self.killed):
                self.cell(name, False)


class HostsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.options = namespaces()

    def setUp(self):
        self.scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-hosts-"))
        self.addCleanup(shutil.rmtree, self.scratch, ignore_errors=True)
        for name, text in {"p.yaml": PIPELINE, "s.yaml": SIMULATION, "e.yaml": EXPERIMENT}.items():
            (self.scratch / name).write_text(text)
        self.shared = self.scratch / "shared"
        self.shared.mkdir(mode=0o700)

    def alone(self):
        """The rows of one machine that shares nothing."""
        environment = dict(os.environ, MARROW_PLUGIN_PATH=str(BUILD / "tests" / "plugins"))
        environment.update(MARROW_CACHE=str(self.scratch / "alone"))
        environment.pop("MARROW_SHARED_CACHE", None)
        done = subprocess.run(
            [str(MARROW), "compare", "e.yaml", "--out", "alone-out", "--quiet"],
            env=environment,
            cwd=self.scratch,
            capture_output=True,
            text=True,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(path.read_text()) for path in (self.scratch / "alone-out" / "cells").rglob("cell.json")]

    def test_cells_of_three_hosts(self):
        names = ["v%d/seed-%d/0" % (v, c) for c in range(1, CASES + 1) for v in range(VARIANTS)]
        hosts = [Host(name, self.scratch, self.shared, self.options) for name in HOSTS]
        # The variants of one case are on different hosts, and start together.
        threads = [threading.Thread(target=one.cells, args=(names[i :: len(hosts)], i)) for i, one in enumerate(hosts)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual([fault for host in hosts for fault in host.faults], [])
        rows = [row for host in hosts for row in host.rows]
        killed = sum(host.killed for host in hosts)
        self.assertEqual(sorted(row["id"] for row in rows), sorted(names))
        self.assertGreaterEqual(killed, 0.1 * len(names) - 1, "some were killed while others waited for them")

        figures = {row["id"]: json.dumps(row["values"]) for row in rows}
        self.assertEqual(figures, {row["id"]: json.dumps(row["values"]) for row in self.alone()})
        self.assertEqual(len(set(figures.values())), 1, "the same chance for all")

        made = sum(row["nodes"]["shared"]["made"] for row in rows)
        print("shared work: made %d times for %d results, %d processes killed" % (made, CASES, killed))
        self.assertLessEqual(made, 1.05 * CASES)
        files = [path for path in self.shared.rglob("*") if path.is_file()]
        kinds = collections.Counter(
            "temporary" if ".tmp-" in path.name else path.parent.name if path.parent.name == "claims" else "result"
            for path in files
            if path.name != "marrow-store"
        )
        print("files of %d cells: %s" % (len(names), dict(kinds)))
        self.assertEqual(kinds["result"], 2 * CASES, "the work and the case")
        # A process that is killed between its result and the end of its claim leaves a claim that nobody waits for.
        results = {path.name for path in files if path.parent.name != "claims"}
        waiting = [path.name for path in files if path.parent.name == "claims" and path.name not in results]
        self.assertEqual(waiting, [], "each claim without a result was taken over")
        self.assertLessEqual(kinds["claims"], killed)
        self.assertLessEqual(kinds["temporary"], killed)
        for path in files:
            if ".tmp-" in path.name:
                self.assertRegex(path.name, r"\.tmp-%s-\d+$" % IDENTITY)

    def test_what_a_killed_process_of_another_host_left_stays_for_a_day(self):
        hosts = [Host(name, self.scratch, self.shared, self.options) for name in HOSTS]
        collect = ["cache", "gc", "--shared", "--keep-gb", "1"]

        def collected_by(host):
            command = [*host.command, str(MARROW), *collect]
            return subprocess.run(command, env=host.environment, capture_output=True, text=True)

        self.assertEqual(collected_by(hosts[0]).returncode, 0)
        hosts[0].cell("v0/seed-1/0", False)
        folder = next(path for path in self.shared.iterdir() if re.fullmatch("[0-9a-f]{2}", path.name))
        result = next(path for path in folder.iterdir() if ".tmp-" not in path.name)
        left = result.with_name(result.name + ".tmp-alpha.0123456789abcdef.00000001.000000000001-0")
        for age_s, remains in (86400 - 20, True), (86400 + 20, False):  # less than the clocks are wrong by
            for host in hosts:
                left.write_text("half a result")
                os.utime(left, (time.time() - age_s,) * 2)
                done = collected_by(host)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(left.exists(), remains, "%s, %d s old" % (host.name, age_s))
        self.assertTrue(result.exists())


if __name__ == "__main__":
    if not namespaces():
        print("no host can be made: unshare is missing or not allowed")
        sys.exit(77)
    unittest.main(verbosity=2)
