# SPDX-License-Identifier: Apache-2.0
"""Long files, and small ones that are slow to read: they take bounded time and memory, and few words."""
import os
import resource
import unittest

from harness.processes import has_processes
from harness.program import IS_SANITIZED, Case, main, wait_until

ADDS = "".join(" n%d: {uses: test.add, in: {a: n%d}}\n" % (i, i + 1) for i in range(1500))
REPEATED = "marrow: 1\ninputs: {a: {type: text, default: %s}}\nnodes:\n c: {uses: test.sides, with: {names: [%s]}}\n"


class Sizes(Case):
    def checked(self, text):
        """Exit code, seconds, megabytes and what was said."""
        self.write("p.yaml", text)
        with open(self.scratch / "said", "wb") as said:
            process = self.start("check", "p.yaml", stdout=said, stderr=said)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        return process.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000, self.read("said")

    def test_many_faults_are_counted(self):
        code, _, megabytes, said = self.checked("marrow: 1\n" + "".join("%07d:\n" % i for i in range(430000)))
        self.assertEqual(code, 2)
        self.assertLess(len(said), 20000)
        self.assertIn("and 429952 more faults\n430002 errors\n", said)
        self.assertEqual(said.count("unknown key"), 50)
        self.assertLess(megabytes, 2000)

    def test_files_of_13_MB_are_refused_at_once(self):
        code, seconds, _, said = self.checked("marrow: 1\n" + "".join("%08d:\n" % i for i in range(1300000)))
        self.assertEqual((code, said), (2, "p.yaml: error: the pipeline file is longer than 4 MB\n1 error\n"))
        self.assertLess(seconds, 20)

    def test_files_of_64_kB_take_little(self):
        for text in (
            "marrow: 1\nnodes:\n" + ADDS + " n1500: {uses: test.constant}\noutputs: {o: n0}\n",
            "[" * 64000,
            "- " * 32000,
            "&a [*a" + ", *a" * 16000 + "]",
            "marrow: 1\nnodes:\n" + "".join(" n%d: {uses: x%d}\n" % (i, i) for i in range(3200)),
            "x: " + "\x80" * 32000,
            REPEATED % ("x" * 30000, "$a" * 15000),
        ):
            code, seconds, megabytes, said = self.checked(text)
            self.assertIn(code, (0, 2), said[:1000])
            self.assertLess(seconds, 20, text[:60])
            self.assertLess(megabytes, 256, text[:60])
            self.assertLess(len(said), 100000)


# A limit of processes and threads: what can be done with fewer is done, and no method is blamed for the rest.
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
