# SPDX-License-Identifier: Apache-2.0
"""What a pipeline says and nothing uses is named; and whom a plan compares with."""
from compare_cases import Comparison
from harness.program import main

UNUSED = """marrow: 1
inputs: {case: {type: path, default: p.yaml}}
nodes:
  shared: {uses: test.work, with: {value: 0.02, path: $case}}
  n: {uses: test.constant, in: {a: shared}}
  m: {uses: test.misbehave, in: {a: n}}
outputs: {number: m}
"""
NOTE = (
    "node 'n': the wire to 'a' is not used: "
    "test.constant does not have this input, only other nodes of the kind test do"
)


class Unused(Comparison):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", UNUSED)

    def test_check_and_the_run_say_which_wire_is_unused(self):
        self.assertIn("  note: %s\n" % NOTE, self.marrow(0, "check", "p.yaml").stdout)
        said = self.marrow(0, "run", "p.yaml", "--out", "out")
        self.assertEqual(said.stderr.count("marrow: note: %s\n" % NOTE), 1)
        self.assertEqual((self.scratch / "out" / "log.txt").read_text().count("note: " + NOTE), 1)
        self.assertNotIn("note: node 'n'", self.marrow(0, "check", "p.yaml", "--set", "n.uses=test.add").stdout)

    def test_an_experiment_says_once_what_no_variant_uses(self):
        self.experiment("e", "{%s}" % ", ".join("v%d: {m.value: %d}" % (i, i) for i in range(20)))
        said = self.marrow(0, "compare", "e.yaml", "--dry-run")
        self.assertEqual(said.stderr.count("marrow: note: %s\n" % NOTE), 1)
        self.experiment("e", "{a: {m.value: 1}, b: {n.uses: test.add}}")
        said = self.marrow(0, "compare", "e.yaml", "--out", "out")
        self.assertNotIn(NOTE, said.stderr, "one variant needs it")
        self.assertNotIn("note: node", said.stderr)

    def test_an_unused_wire_closes_a_circle(self):
        self.write("p.yaml", UNUSED.replace("in: {a: shared}", "in: {a: m}"))
        result = self.marrow(2, "check", "p.yaml")
        self.assertEqual(
            result.stderr,
            "p.yaml:5:3: error: these nodes wait for each other in a circle: n, m\n"
            "    n: {uses: test.constant, in: {a: m}}\n"
            "    ^\n"
            "  hint: n takes m as 'a', m takes n as 'a'; leave out one of these wires\n"
            "1 error\n",
        )

    def test_a_plan_compares_with_the_nearest_result_that_is_kept(self):
        """By hand: the first run differs from what is planned in one option, the last one in two."""
        values = lambda value, word: ["p.yaml", "--set", "n.value=%d" % value, "--set", "n.word=" + word]
        self.marrow(0, "run", *values(1, "one"), "--out", "first")
        self.marrow(0, "run", *values(2, "two"), "--out", "last")
        plan = self.marrow(0, "plan", *values(1, "three")).stdout
        self.assertRegex(plan, r"\nn +test\.constant +runs: option 'word' is three, was one\n")
        plan = self.marrow(0, "plan", *values(2, "three")).stdout
        self.assertRegex(plan, r"\nn +test\.constant +runs: option 'word' is three, was two\n")


if __name__ == "__main__":
    main()
