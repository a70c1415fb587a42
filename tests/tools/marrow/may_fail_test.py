# SPDX-License-Identifier: Apache-2.0
"""A node that may fail: what a person is told, and what a run, a plan, a page and a comparison make of it."""
import json

from diff_cases import Runs
from harness.program import main

PIPELINE = """marrow: 1
nodes:
  c: {uses: test.constant, with: {value: 5}}
  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}, may_fail: true}
  d: {uses: test.add, in: {a: c, b: f}}
outputs: {d: d, f: f}
"""
CELLS = """marrow: 1
inputs: {case: {type: path}}
nodes:
  c: {uses: test.work, with: {value: 0, path: $case}}
  m: {uses: test.misbehave, in: {a: c}, may_fail: true}
  d: {uses: test.add, in: {a: c, b: m}}
outputs: {m: m, d: d}
"""
EXPERIMENT = """experiment: 1
pipeline: p.yaml
cases: {folders: [cases/*]}
metrics: [m.value, d.value]
success: {m.value: 10}
timed_cells: 0
variants: {a: {}, b: {m.how: error}, strict: {m.how: error, m.may_fail: false}}
"""
FAILED = "node 'f' (test.fail_above) failed: the number is too large; give a smaller one"
GOES_ON = FAILED + " (its inputs: a = c); the run goes on without it"


class MayFail(Runs):
    has_own_store = True

    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)

    def run_it(self, *arguments, code=0):
        return self.expect(code, "run", "p.yaml", "--no-cache", *arguments)

    def test_the_run_warns_and_ends_well(self):
        result = self.run_it("--out", "out")
        self.assertIn("marrow: warning: " + GOES_ON, result.stderr)
        self.assertRegex(result.stdout, r"\nf +test\.fail_above +\d+\.\d+ +1  failed alone\n")
        self.assertIn("\n  outputs/d.json\n  f: not there because node 'f' failed\n", result.stdout)
        self.assertRegex(self.read("out/log.txt"), r"\[warning\] node 'f' \(test\.fail_above\) failed: ")
        self.assertEqual(sorted(path.name for path in (self.scratch / "out/outputs").iterdir()), ["d.json"])
        self.assertEqual(self.json("out/run.json")["status"], "done")
        self.assertEqual(
            [(node["status"], node.get("reason")) for node in self.nodes().values()],
            [("done", None), ("failed alone", "the number is too large; give a smaller one"), ("done", None)],
        )
        self.expect(0, "show", "out")
        cell = self.page_data()["cells"][0]
        self.assertEqual((cell["status"], cell["absent"]), ("done", FAILED))

    def events(self, *arguments, code=0):
        """The failures, and the end."""
        events = [json.loads(line) for line in self.run_it("--json", *arguments, code=code).stdout.splitlines()]
        return [event for event in events if event["event"] == "failed"], events[-1]

    def test_as_json(self):
        failed, end = self.events("--out", "out")
        self.assertEqual(failed, [{"event": "failed", "node": "f", "level": "warning", "text": GOES_ON}])
        self.assertEqual((end["status"], end["absent"]), ("done", {"f": "node 'f' failed"}))
        failed, end = self.events("--out", "bad", "--set", "f.may_fail=false", code=1)
        self.assertEqual([event["level"] for event in failed], ["error"])
        self.assertEqual((end["status"], end["absent"]), ("failed", {}))

    def test_of_a_list_the_rest_is_there(self):
        self.write(
            "p.yaml",
            "marrow: 1\nnodes:\n  s: {uses: test.sides}\n"
            "  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 15}, may_fail: true}\noutputs: {f: f}\n",
        )
        told = self.run_it("--out", "out").stdout
        self.assertIn("\n  outputs/f/a.json\n  f: not there as a whole because node 'f' failed\n", told)

    def test_who_needs_it_is_refused_before_anything_runs(self):
        self.write("p.yaml", PIPELINE.replace("{a: c, b: f}", "{a: f}"))
        said = "p.yaml:5:28: error: node 'd' needs input 'a', but node 'f' may fail\n"
        self.refused(said, "check", "p.yaml")
        self.expect(0, "check", "p.yaml", "--set", "d.may_fail=true")

    def test_only_nodes_that_can_do_without_it_fit(self):
        fits = lambda file: {fit["node"]: fit for fit in self.json_of("list", "--fits", file, "d")}
        self.assertEqual(fits("p.yaml")["test.fail_above"]["fits"], "yes", "it has no input b")
        items = PIPELINE.replace("{a: c, b: f}", "{items: f, a: c}").replace("test.add", "test.any")
        one = fits(self.write("q.yaml", items))["test.sum"]
        self.assertEqual(one["fits"], "no")
        self.assertIn("node 'd' needs input 'items', but node 'f' may fail", one["faults"])

    def test_the_graph_says_which_may(self):
        self.assertIn("f  (test.fail_above)  [may fail]\n", self.printed("graph", "p.yaml"))
        self.assertIn('label="f\\ntest.fail_above\\nmay fail"', self.printed("graph", "p.yaml", "--dot"))

    def test_the_plan(self):
        self.run_into("out", PIPELINE)
        told = self.printed("plan", "p.yaml")
        self.assertRegex(told, r"\nf +test\.fail_above +runs: the store has no result of it: it failed, ")
        self.assertRegex(told, r"\nd +test\.add +runs unless 'f' comes out unchanged\n")
        self.assertIn("1 cached, 1 to run, 1 that may run", told)
        self.assertRegex(self.printed("run", "p.yaml", "--out", "again"), r"\nd +test\.add .* cached \(took")

    def test_the_same_again(self):
        self.run_it("--out", "a")
        self.assertIn(
            "identical: all 3 nodes came out the same\nnode 'f' failed alone in both: the number is too large; give a "
            "smaller one\n",
            self.printed("rerun", "a", "--out", "b", "--quiet"),
        )
        text = self.read("a/pipeline.yaml")
        self.assertIn("may_fail: true", text)
        self.assertEqual(self.read("b/pipeline.yaml"), text)
        self.run_it("--out", "c", "--set", "f.value=9")
        self.assertIn(
            "  in the first run it failed alone: the number is too large; give a smaller one\n"
            "  in the second run it was done\n",
            self.diff(1, "a", "c"),
        )

    def test_a_comparison_has_an_empty_figure(self):
        self.write("p.yaml", CELLS)
        self.write("e.yaml", EXPERIMENT)
        for case in "01":
            self.write("cases/%s/data" % case, case)
        compare = ["compare", "e.yaml", "--out", "out"]
        why = "'m.value' is not there because node 'm' failed"
        self.assertIn(
            "\ncells in which a node failed that may fail\n  b/0/0: %s\n  b/1/0: %s\n" % (why, why),
            self.printed(*compare),
        )
        rows = self.rows()
        shown = [rows["b/0/0"][name] for name in ("status", "reason", "success", "m.value", "d.value")]
        self.assertEqual(shown, ["done", why, "0", "", "0"])
        self.assertEqual(rows["a/0/0"]["d.value"], "1")
        self.assertEqual(rows["strict/0/0"]["status"], "failed")
        table = self.page_data()["cell_table"]
        row = dict(zip(table["fields"], table["rows"][4]))  # of case 1, variant b
        self.assertEqual((row["variant"], row["case"], row["start"], table["texts"][row["absent"]]), (1, 1, 0, why))
        self.assertIn("4 were there already", self.printed(*compare))
        self.expect(0, "cell", "e.yaml", "b/0/0", "--out", "out")


if __name__ == "__main__":
    main()
