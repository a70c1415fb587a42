# SPDX-License-Identifier: Apache-2.0
"""A limit of processes and threads: what can be done with fewer is done, and no method is blamed for the rest."""
import os
import resource
import unittest

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
    plugins = []

    def setUp(self):
        super().setUp()
        self.environment = {"HOME": str(self.scratch), "XDG_CACHE_HOME": str(self.scratch)}
        os.chown(self.scratch, USER, USER)
        for name, height in (("a.ply", 10), ("b.ply", 11)):
            self.write(name, TETRAHEDRON % height)
        self.write("p.yaml", PIPELINE)
        self.write("e.yaml", EXPERIMENT)

    def complaints(self, most, code, *arguments):
        """Those of a call that ends with this code where its user may have this many processes and threads."""

        def become_user():
            resource.setrlimit(resource.RLIMIT_NPROC, (most, most))
            os.setgroups([])
            os.setgid(USER)
            os.setuid(USER)

        wait_until(lambda: not has_processes(USER), "processes of the last program are left, which count, too")
        program = self.start(*arguments, "--no-cache", preexec_fn=become_user)
        said, complaints = program.communicate(timeout=300)
        self.assertEqual(program.returncode, code, said + complaints)
        return complaints

    def test_a_run_waits_for_one_reader_to_start_the_other(self):
        for most in (3, 4, 5):
            with self.subTest(most):
                self.complaints(most, 0, "run", "p.yaml", "--threads", "2", "--out", "out-%d" % most)

    def test_a_node_that_may_fail_is_not_blamed_for_too_few(self):
        self.write("p.yaml", PIPELINE.replace("ply}}", "ply}, may_fail: true}").replace("200}", "200}, may_fail: true"))
        said = self.complaints(2, 1, "run", "p.yaml", "--threads", "1", "--out", "out")
        self.assertIn("cannot start a process", said)
        self.assertNotIn("the run goes on without it", said)

    def test_a_comparison_is_done_by_fewer_workers(self):
        for most in (4, 5, 6):
            with self.subTest(most):
                self.complaints(most, 0, "compare", "e.yaml", "--jobs", "3", "--quiet", "--out", "out-%d" % most)
                self.assertEqual([row["status"] for row in self.csv("out-%d/cells.csv" % most)], ["done"] * 4)

    def test_no_cell_is_blamed_for_too_few_processes(self):
        said = self.complaints(3, 2, "compare", "e.yaml", "--quiet", "--out", "out")
        self.assertIn("the limit of processes is reached (ulimit -u)", said)
        self.assertEqual(said.count("marrow: error: "), 1, said)
        self.assertEqual([path.name for path in (self.scratch / "out").rglob("cell*.*")], [])


if __name__ == "__main__":
    main()
