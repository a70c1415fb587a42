# SPDX-License-Identifier: Apache-2.0
"""Long files, and small ones that are slow to read: they take bounded time and memory, and few words."""
import os

from harness.program import Case, main

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


if __name__ == "__main__":
    main()
