# SPDX-License-Identifier: Apache-2.0
"""What a pipeline says and nothing uses is named; and whom a plan compares with."""
from compare_cases import Compared
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


class Unused(Compared):
    pipeline = UNUSED

    def test_check_and_the_run_say_which_wire_is_unused(self):
        self.assertIn("  note: %s\n" % NOTE, self.expect(0, "check", "p.yaml").stdout)
        said = self.expect(0, "run", "p.yaml", "--out", "out")
        self.assertEqual(said.stderr.count("marrow: note: %s\n" % NOTE), 1)
        self.assertEqual(self.read("out/log.txt").count("note: " + NOTE), 1)
        self.assertNotIn("note: node 'n'", self.expect(0, "check", "p.yaml", "--set", "n.uses=test.add").stdout)

    def test_an_experiment_says_once_what_no_variant_uses(self):
        self.experiment("e", "{%s}" % ", ".join("v%d: {m.value: %d}" % (i, i) for i in range(20)))
        said = self.expect(0, "compare", "e.yaml", "--dry-run")
        self.assertEqual(said.stderr.count("marrow: note: %s\n" % NOTE), 1)
        self.experiment("e", "{a: {m.value: 1}, b: {n.uses: test.add}}")
        said = self.expect(0, "compare", "e.yaml", "--out", "out")
        self.assertNotIn(NOTE, said.stderr, "one variant needs it")
        self.assertNotIn("note: node", said.stderr)

    def test_a_plan_compares_with_the_nearest_result_that_is_kept(self):
        """By hand: the first run differs from what is planned in one option, the last one in two."""
        values = lambda value, word: ["p.yaml", "--set", "n.value=%d" % value, "--set", "n.word=" + word]
        self.expect(0, "run", *values(1, "one"), "--out", "first")
        self.expect(0, "run", *values(2, "two"), "--out", "last")
        plan = self.expect(0, "plan", *values(1, "three")).stdout
        self.assertRegex(plan, r"\nn +test\.constant +runs: option 'word' is three, was one\n")
        plan = self.expect(0, "plan", *values(2, "three")).stdout
        self.assertRegex(plan, r"\nn +test\.constant +runs: option 'word' is three, was two\n")


if __name__ == "__main__":
    main()
