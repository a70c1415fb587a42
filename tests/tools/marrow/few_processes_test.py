# SPDX-License-Identifier: Apache-2.0
"""A limit of processes and threads: what can be done with fewer is done, and no method is blamed for the rest."""
import csv
import os
import resource
import subprocess
import unittest

from harness import MARROW
from harness.program import IS_SANITIZED, Case, main, wait_until
from harness.processes import has_processes

USER = 40000 + os.getpid() % 10000  # of no account and no other process, nor of this test elsewhere
TETRAHEDRON = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
10 0 0
0 10 0
0 0 %d
3 0 2 1
3 0 1 3
3 1 2 3
3 0 3 2
"""
PIPELINE = """marrow: 1
nodes:
  a: {uses: read.mesh, with: {path: a.ply}}
  b: {uses: read.mesh, with: {path: b.ply}}
  d: {uses: evaluate.surface_distance, in: {mesh: a, reference: b}, with: {points: 200}}
outputs: {d: d}
"""
EXPERIMENT = (
    "experiment: 1\npipeline: p.yaml\ncases: {seeds: 1..2}\nvariants: {one: {}, two: {d.points: 300}}\nmetrics:"
    " [d.mean_mm]\n"
)


@unittest.skipIf(os.getuid() != 0, "only root can become a user without other processes")
@unittest.skipIf(IS_SANITIZED, "a sanitizer has threads of its own")
class FewProcesses(Case):
    def setUp(self):
        super().setUp()
        os.chown(self.scratch, USER, USER)
        for name, height in (("a.ply", 10), ("b.ply", 11)):
            self.write(name, TETRAHEDRON % height)
        self.write("p.yaml", PIPELINE)
        self.write("e.yaml", EXPERIMENT)

    def marrow(self, most, *arguments):
        def become_user():
            resource.setrlimit(resource.RLIMIT_NPROC, (most, most))
            os.setgroups([])
            os.setgid(USER)
            os.setuid(USER)

        environment = dict(
            os.environ,
            HOME=str(self.scratch),
            MARROW_CACHE=str(self.scratch / "cache"),
            XDG_CACHE_HOME=str(self.scratch),
        )
        wait_until(lambda: not has_processes(USER), "processes of the last program are left, which count, too")
        return subprocess.run(
            [str(MARROW), *arguments, "--no-cache"],
            capture_output=True,
            text=True,
            cwd=self.scratch,
            timeout=300,
            env=environment,
            preexec_fn=become_user,
        )

    def test_a_run_waits_for_one_reader_to_start_the_other(self):
        for most in (3, 4, 5):
            with self.subTest(most):
                result = self.marrow(most, "run", "p.yaml", "--threads", "2", "--out", "out-%d" % most)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_a_node_that_may_fail_is_not_blamed_for_too_few(self):
        self.write("p.yaml", PIPELINE.replace("ply}}", "ply}, may_fail: true}").replace("200}", "200}, may_fail: true"))
        result = self.marrow(2, "run", "p.yaml", "--threads", "1", "--out", "out")
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("cannot start a process", result.stderr)
        self.assertNotIn("the run goes on without it", result.stderr)

    def test_a_comparison_is_done_by_fewer_workers(self):
        for most in (4, 5, 6):
            with self.subTest(most):
                result = self.marrow(most, "compare", "e.yaml", "--jobs", "3", "--quiet", "--out", "out-%d" % most)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
                with open(self.scratch / ("out-%d" % most) / "cells.csv", newline="") as stream:
                    self.assertEqual([row["status"] for row in csv.DictReader(stream)], ["done"] * 4)

    def test_no_cell_is_blamed_for_too_few_processes(self):
        result = self.marrow(3, "compare", "e.yaml", "--quiet", "--out", "out")
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertIn("the limit of processes is reached (ulimit -u)", result.stderr)
        self.assertEqual(result.stderr.count("marrow: error: "), 1, result.stderr)
        self.assertEqual([path.name for path in (self.scratch / "out").rglob("cell*.*")], [])


if __name__ == "__main__":
    main()
