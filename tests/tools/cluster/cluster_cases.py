# SPDX-License-Identifier: Apache-2.0
"""A comparison of 18 cheap cells, for tests of chunks and clusters, and the Slurm cluster in which some of them run."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from harness import MARROW, SOURCE, TEST_PLUGINS  # noqa: F401
from harness.program import Case, another_run_makes_all, main, wait_until  # noqa: F401

IN_A_CLUSTER = "CLUSTER_FOLDER" in os.environ
CAN_START_CLUSTER = os.geteuid() == 0 and shutil.which("sbatch") is not None
CASES, VARIANTS = 3, 6
PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  shared: {uses: test.work, with: {value: %s, path: $case}}
  m: {uses: test.misbehave, in: {a: shared}}
outputs: {number: m}
"""


def run_in_cluster():
    """Runs this test again inside a cluster of one host. Returns its exit code."""
    if all(pathlib.Path("/sys/fs/cgroup", one, "tasks").exists() for one in ("memory", "freezer")):
        os.environ["CLUSTER_MEMORY"] = "1"
    folder = tempfile.mkdtemp(prefix="marrow-cluster-")
    try:
        return subprocess.run([SOURCE / "tools/checks/cluster_test", folder, sys.executable, *sys.argv]).returncode
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def is_idle():
    """Whether no job waits, runs or ends."""
    listed = subprocess.run(["squeue", "-h"], capture_output=True, text=True)
    return listed.returncode == 0 and not listed.stdout


class Cluster(Case):
    def setUp(self):
        super().setUp()
        plugins = {"MARROW_PLUGIN_PATH": str(TEST_PLUGINS)}
        self.environment = {**os.environ, **plugins, "MARROW_CACHE": str(self.scratch / "cache")}
        self.file = self.experiment()

    def experiment(self, value="0.01", more="", cases=CASES, variants=VARIANTS):
        self.write("p.yaml", PIPELINE % value)
        shutil.rmtree(self.scratch / "cases", ignore_errors=True)
        for i in range(cases):
            self.write("cases/%d/data" % i, "case %d" % i)
        variants = ", ".join("v%d: {m.value: %d}" % (i, i) for i in range(variants))
        return self.write(
            "e.yaml",
            "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\ntimed_cells: 0\n"
            "success: {number.value: 4}\nvariants: {%s%s}\n" % (variants, more),
        )

    def run_program(self, *command, code=0, timeout=300, **environment):
        result = subprocess.run(
            [*map(str, command)],
            env={**self.environment, **environment},
            cwd=self.scratch,
            capture_output=True,
            text=True,
            timeout=timeout,
        )
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def compare(self, out, *arguments, code=0, **environment):
        command = [MARROW, "compare", self.file, "--out", self.scratch / out, *arguments]
        return self.run_program(*command, code=code, **environment)

    def gather(self, out, code=0):
        return self.compare(out, "--gather", "--quiet", "--shown", "0", code=code)

    def figures(self, out):
        """Everything that the tables say of each cell, but for times, tries and keys, which depend on paths."""
        rows = self.csv(self.scratch / out / "cells.csv")
        cells = [row["cell"] for row in rows]
        self.assertEqual(len(cells), len(set(cells)), "a cell is counted twice")
        left_out = ("seconds", "tries", "key")
        return {row.pop("cell"): {k: v for k, v in row.items() if k not in left_out} for row in rows}

    def count(self, out, status):
        """How many cells have this status."""
        return sum(row["status"] == status for row in self.figures(out).values())

    def answers(self, out):
        """The statistics in comparison.json without times."""
        answer = self.answer(out)
        for variant in answer["variants"]:
            variant.pop("seconds", None)
        return answer["variants"], answer["comparisons"]

    def expect_same(self, out, as_out):
        self.assertEqual(self.figures(out), self.figures(as_out))
        self.assertEqual(self.answers(out), self.answers(as_out))

    def plan(self, out):
        folder = self.scratch / out / "plans"
        return folder / ((folder / "latest.txt").read_text().strip() + ".json")

    def names(self, out):
        """The chunks of the plan."""
        plan = self.plan(out)
        return (plan.parent / (plan.stem + "-chunks.txt")).read_text().split()

    def chunk(self, out, name, **environment):
        return self.run_program(MARROW, "chunk", self.plan(out), name, "--quiet", **environment)
