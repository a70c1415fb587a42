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
FAILED = "node 'f' (test.fail_above) failed: the number is too large; give a smaller one"
GOES_ON = FAILED + " (its inputs: a = c); the run goes on without it"


class MayFail(Runs):
    def setUp(self):
        super().setUp()
        self.path = self.write("p.yaml", PIPELINE)

    def run_it(self, *arguments, code=0):
        result = self.marrow("run", self.path, "--no-cache", *arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def test_the_run_warns_and_ends_well(self):
        result = self.run_it("--out", "out")
        self.assertIn("marrow: warning: " + GOES_ON, result.stderr)
        self.assertRegex(result.stdout, r"\nf +test\.fail_above +\d+\.\d+ +1  failed alone\n")
        self.assertIn("\n  outputs/d.json\n  f: not there because node 'f' failed\n", result.stdout)
        out = self.scratch / "out"
        self.assertRegex((out / "log.txt").read_text(), r"\[warning\] node 'f' \(test\.fail_above\) failed: ")
        self.assertEqual(sorted(path.name for path in (out / "outputs").iterdir()), ["d.json"])
        record = json.loads((out / "run.json").read_text())
        self.assertEqual(record["status"], "done")
        self.assertEqual(
            [(node["status"], node.get("reason")) for node in record["nodes"]],
            [("done", None), ("failed alone", "the number is too large; give a smaller one"), ("done", None)],
        )

    def test_as_json(self):
        events = [json.loads(line) for line in self.run_it("--out", "out", "--json").stdout.splitlines()]
        failed = [event for event in events if event["event"] == "failed"]
        self.assertEqual(failed, [{"event": "failed", "node": "f", "level": "warning", "text": GOES_ON}])
        self.assertEqual(events[-1]["status"], "done")
        self.assertEqual(events[-1]["absent"], {"f": "node 'f' failed"})
        events = [
            json.loads(line)
            for line in self.run_it("--out", "bad", "--json", "--set", "f.may_fail=false", code=1).stdout.splitlines()
        ]
        self.assertEqual([event["level"] for event in events if event["event"] == "failed"], ["error"])
        self.assertEqual((events[-1]["status"], events[-1]["absent"]), ("failed", {}))

    def test_of_a_list_the_rest_is_there(self):
        self.path = self.write(
            "list.yaml",
            "marrow: 1\nnodes:\n  s: {uses: test.sides}\n"
            "  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 15}, may_fail: true}\noutputs: {f: f}\n",
        )
        told = self.run_it("--out", "out").stdout
        self.assertIn("\n  outputs/f/a.json\n  f: not there as a whole because node 'f' failed\n", told)

    def test_who_needs_it_is_refused_before_anything_runs(self):
        path = self.write("q.yaml", PIPELINE.replace("{a: c, b: f}", "{a: f}"))
        result = self.marrow("check", path)
        self.assertEqual(result.returncode, 2)
        self.assertEqual(
            result.stderr,
            "%s:5:28: error: node 'd' needs input 'a', but node 'f' may fail\n"
            "    d: {uses: test.add, in: {a: f}}\n"
            "                             ^\n"
            "  hint: write  may_fail: true  at node 'd' too, or wire it to an input that may be left out\n"
            "1 error\n" % path,
        )
        self.assertEqual(self.marrow("check", path, "--set", "d.may_fail=true").returncode, 0)

    def test_only_nodes_that_can_do_without_it_fit(self):
        listed = self.marrow("list", "--fits", self.path, "d", "--json")
        self.assertEqual(listed.returncode, 0, listed.stderr)
        fits = {fit["node"]: fit for fit in json.loads(listed.stdout)}
        self.assertEqual(fits["test.fail_above"]["fits"], "yes", "it has no input b")
        path = self.write(
            "q.yaml", PIPELINE.replace("{a: c, b: f}", "{items: f, a: c}").replace("test.add", "test.any")
        )
        fits = {fit["node"]: fit for fit in json.loads(self.marrow("list", "--fits", path, "d", "--json").stdout)}
        self.assertEqual(fits["test.sum"]["fits"], "no")
        self.assertIn("node 'd' needs input 'items', but node 'f' may fail", fits["test.sum"]["faults"])

    def test_the_graph_says_which_may(self):
        self.assertIn("f  (test.fail_above)  [may fail]\n", self.marrow("graph", self.path).stdout)
        self.assertIn('label="f\\ntest.fail_above\\nmay fail"', self.marrow("graph", self.path, "--dot").stdout)

    def test_the_plan(self):
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}
        self.assertEqual(self.marrow("run", self.path, "--out", "out").returncode, 0)
        told = self.marrow("plan", self.path).stdout
        self.assertRegex(told, r"\nf +test\.fail_above +runs: the store has no result of it: it failed, ")
        self.assertRegex(told, r"\nd +test\.add +runs unless 'f' comes out unchanged\n")
        self.assertIn("1 cached, 1 to run, 1 that may run", told)
        self.assertRegex(self.marrow("run", self.path, "--out", "again").stdout, r"\nd +test\.add .* cached \(took")

    def test_the_page_says_it(self):
        self.run_it("--out", "out")
        self.assertEqual(self.marrow("show", "out").returncode, 0)
        data = self.page_data()
        self.assertEqual(data["cells"][0]["status"], "done")
        self.assertEqual(data["cells"][0]["absent"], FAILED)

    def test_the_same_again(self):
        self.run_it("--out", "a")
        result = self.marrow("rerun", "a", "--out", "b", "--quiet")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn(
            "identical: all 3 nodes came out the same\nnode 'f' failed alone in both: the number is too large; give a "
            "smaller one\n",
            result.stdout,
        )
        text = [(self.scratch / name / "pipeline.yaml").read_text() for name in "ab"]
        self.assertIn("may_fail: true", text[0])
        self.assertEqual(text[0], text[1])
        self.run_it("--out", "c", "--set", "f.value=9")
        self.assertIn(
            "  in the first run it failed alone: the number is too large; give a smaller one\n"
            "  in the second run it was done\n",
            self.diff(1, "a", "c"),
        )

    def test_a_comparison_has_an_empty_figure(self):
        self.write(
            "p.yaml",
            "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  c: {uses: test.work, with: {value: 0, path: $case}}\n"
            "  m: {uses: test.misbehave, in: {a: c}, may_fail: true}\n  d: {uses: test.add, in: {a: c, b: m}}\n"
            "outputs: {m: m, d: d}\n",
        )
        for case in "01":
            (self.scratch / "cases" / case).mkdir(parents=True)
            self.write("cases/%s/data" % case, case)
        experiment = self.write(
            "e.yaml",
            "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [m.value, d.value]\n"
            "success: {m.value: 10}\ntimed_cells: 0\n"
            "variants: {a: {}, b: {m.how: error}, strict: {m.how: error, m.may_fail: false}}\n",
        )
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}
        result = self.marrow("compare", experiment, "--out", "out")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        why = "'m.value' is not there because node 'm' failed"
        self.assertIn(
            "\ncells in which a node failed that may fail\n  b/0/0: %s\n  b/1/0: %s\n" % (why, why), result.stdout
        )
        rows = self.rows()
        shown = [rows["b/0/0"][name] for name in ("status", "reason", "success", "m.value", "d.value")]
        self.assertEqual(shown, ["done", why, "0", "", "0"])
        self.assertEqual(rows["a/0/0"]["d.value"], "1")
        self.assertEqual(rows["strict/0/0"]["status"], "failed")
        table = self.page_data()["cell_table"]
        row = dict(zip(table["fields"], table["rows"][4]))  # of case 1, variant b
        self.assertEqual((row["variant"], row["case"], row["start"], table["texts"][row["absent"]]), (1, 1, 0, why))
        again = self.marrow("compare", experiment, "--out", "out")
        self.assertIn("4 were there already", again.stdout)
        self.assertEqual(self.marrow("cell", experiment, "b/0/0", "--out", "out").returncode, 0)


if __name__ == "__main__":
    main()
