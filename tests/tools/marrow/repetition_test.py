# SPDX-License-Identifier: Apache-2.0
"""Pipelines that repeat: what a person is told by check, graph, plan, run, diff and a page, and what is left after a
crash."""
import json
import os
import signal
import subprocess

from diff_cases import Runs
from harness import MARROW
from harness.program import main

BODY = """marrow: 1
nodes:
  before: {uses: test.constant, with: {value: 1}}
  item: {uses: test.constant, with: {value: 2}}
  sum: {uses: test.add, in: {a: before, b: item}}
outputs: {sum: sum}
"""
OVER = """marrow: 1
nodes:
  l: {uses: test.letters}
  r: {repeat: sum.yaml, over: letter, in: {item: l}, carry: {before: sum}}
outputs: {all: r.sum, last: r.last_sum}
"""
LIMITED = """marrow: 1
nodes:
  before: {uses: test.constant, with: {value: 0}}
  item: {uses: test.constant}
  good: {uses: test.fail_above, in: {a: item}, with: {value: 150}}
  sum: {uses: test.add, in: {a: before, b: good}}
outputs: {sum: sum}
"""
SLOW = """marrow: 1
nodes:
  s: {uses: test.sides, with: {names: [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]}}
  r:
    repeat:
      nodes:
        before: {uses: test.constant}
        item: {uses: test.constant}
        work: {uses: test.work, in: {after: before}, with: {value: 0.2}}
        sum: {uses: test.add, in: {a: work, b: item}}
      outputs: {sum: sum}
    over: side
    in: {item: s.both}
    carry: {before: sum}
outputs: {all: r.sum}
"""


def value(path):
    return json.loads(path.read_text())["metrics"][0]["value"]


class Repetition(Runs):
    def setUp(self):
        super().setUp()
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}
        self.write("sum.yaml", BODY)

    def told(self, code, *arguments):
        result = self.marrow(*arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def record(self, run):
        return json.loads((self.scratch / run / "run.json").read_text())

    def nodes(self, run):
        return {node["id"]: node for node in self.record(run)["nodes"]}

    def test_the_body_is_a_pipeline_of_its_own(self):
        self.assertIn("good; 3 nodes, 1 outputs", self.told(0, "check", "sum.yaml"))
        self.told(0, "run", "sum.yaml", "--out", "alone")
        self.assertEqual(value(self.scratch / "alone/outputs/sum.json"), 3)

    def test_a_run_tells_of_its_passes(self):
        told = self.told(0, "run", self.write("p.yaml", OVER), "--out", "a")
        self.assertRegex(told, r"\nr +repeat +\d+\.\d+ +3  done\n +3 passes\n")
        self.assertRegex(told, r"\nr/before +test\.constant +\d+\.\d+ +1  done\n")
        self.assertRegex(told, r"\nr/sum +test\.add +\d+\.\d+ +3  done\n")
        outputs = self.scratch / "a/outputs"
        self.assertEqual([value(outputs / "all" / (name + ".json")) for name in "xyz"], [101, 301, 601])
        self.assertEqual(value(outputs / "last.json"), 601)
        nodes = self.nodes("a")
        self.assertEqual(list(nodes), ["l", "r", "r/before", "r/sum"])
        self.assertEqual([(one["name"], one["status"]) for one in nodes["r"]["passes"]], [(n, "done") for n in "xyz"])
        self.assertEqual([item[0] for item in nodes["r/sum"]["items"]["sum"]], ["x", "y", "z"])

    def test_check_and_graph(self):
        path = self.write("p.yaml", OVER)
        self.assertIn("  r runs a body of 3 nodes: each letter in turn\n", self.told(0, "check", path))
        self.assertEqual(
            self.told(0, "graph", path),
            "l  (test.letters)\n"
            "r  (repeat)  each letter in turn\n"
            "    item <- l\n"
            "    before <- sum of the pass before\n"
            "    | before  (test.constant)\n"
            "    | item  (test.constant)\n"
            "    | sum  (test.add)\n"
            "    |     a <- before\n"
            "    |     b <- item\n"
            "outputs\n"
            "    all <- r.sum  (a list over letter)\n"
            "    last <- r.last_sum\n",
        )
        dot = self.told(0, "graph", path, "--dot")
        self.assertIn('subgraph "cluster r" {', dot)
        self.assertIn('"l" -> "r/sum" [label="b"];', dot)
        self.assertIn('"r/sum" -> "r/sum" [label="a", constraint=false, color=gray50];', dot)

    def test_a_pass_that_fails(self):
        self.write("sum.yaml", LIMITED)
        path = self.write("p.yaml", OVER)
        told = self.told(1, "run", path, "--out", "a")
        self.assertIn(
            "error: node 'r' (repeat) failed: pass y failed: the number is too large; give a smaller one", told
        )
        told = self.told(0, "run", path, "--out", "b", "--set", "r.if_pass_fails=go_on")
        self.assertIn("warning: node 'good' (test.fail_above) in r/y failed: the number is too large; give a", told)
        passes = self.nodes("b")["r"]["passes"]
        self.assertEqual([one["status"] for one in passes], ["done", "failed", "failed"])
        self.assertEqual(passes[1]["reason"], "the number is too large; give a smaller one")
        self.assertEqual(value(self.scratch / "b/outputs/last.json"), 100)

    def test_the_plan_names_the_first_pass_that_runs(self):
        path = self.write("p.yaml", OVER)
        self.assertRegex(self.told(0, "plan", path), r"\nr +repeat +runs unless 'l' comes out unchanged\n")
        self.told(0, "run", path, "--out", "a")
        self.assertRegex(self.told(0, "plan", path), r"\nr +repeat +cached\n")
        self.assertRegex(
            self.told(0, "plan", path, "--set", "r.body.before.value=2"), r"\nr +repeat +runs: pass x: node 'before': "
        )

    def test_differences_of_bodies(self):
        self.run_into("a", OVER)
        self.run_into("b", OVER, "--set", "r.body.before.value=2")
        told = self.diff(1, "a", "b")
        self.assertIn(
            "First difference: node 'r/before' (test.constant)\n  why: option 'value' is 2, was 1 "
            "(--set r.body.before.value=2, was sum.yaml:3)\n",
            told,
        )
        self.assertIn("In consequence differ: r, r/sum\n", told)
        self.run_into("c", OVER)
        self.assertIn("identical: all 4 nodes came out the same", self.diff(0, "a", "c"))
        self.assertIn("identical: all 4 nodes came out the same", self.told(0, "rerun", "b", "--out", "d", "--quiet"))

    def test_what_was_done_is_kept_when_it_is_killed(self):
        self.write("p.yaml", SLOW)
        environment = {
            **os.environ,
            **self.environment,
            "MARROW_PLUGIN_PATH": ":".join(str(folder) for folder in self.plugins),
        }
        process = subprocess.Popen(
            [str(MARROW), "run", "p.yaml", "--out", "killed", "--json"],
            cwd=self.scratch,
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        done = 0
        for line in process.stdout:
            event = json.loads(line)
            done += event["event"] == "finished" and event["node"] == "r/sum"
            if done == 3:
                break
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        self.told(0, "run", "p.yaml", "--out", "again")
        work = self.nodes("again")["r/work"]
        self.assertGreaterEqual(work["cached"], 3)
        self.assertEqual(work["cached"] + work["calls"], 16)
        self.told(0, "run", "p.yaml", "--out", "whole", "--no-cache", "--threads", "1")
        self.assertIn("identical: all 5 nodes", self.told(0, "diff", "again", "whole"))

    def test_the_page_shows_passes_and_body(self):
        self.run_into("a", OVER)
        self.told(0, "show", "a")
        data = self.page_data("a/report.html")
        self.assertEqual([one["node"] for one in data["passes"]], ["r"])
        self.assertEqual([one["name"] for one in data["passes"][0]["passes"]], ["x", "y", "z"])
        nodes = {node["id"]: node for node in data["graph"]["nodes"]}
        self.assertEqual(
            nodes["r"]["options"], {"passes": "each letter in turn", "if_pass_fails": "end", "carry before": "sum"}
        )
        edges = {(edge["from"], edge["to"]) for edge in data["graph"]["edges"]}
        self.assertEqual(edges, {("l", "r/sum"), ("r/before", "r/sum"), ("r/sum", "r")})

    def test_a_rule_is_written_as_json(self):
        self.write(
            "p.yaml",
            "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\n"
            "  s: {uses: test.stop_above, in: {a: c}, with: {value: 2}}\noutputs: {s: s}\n",
        )
        self.told(0, "run", "p.yaml", "--out", "a")
        self.assertEqual(
            json.loads((self.scratch / "a/outputs/s.json").read_text()), {"stops": True, "reason": "it is above 2"}
        )

    def test_nothing_takes_the_place_of_a_body(self):
        path = self.write("p.yaml", OVER)
        self.assertIn(
            "error: node 'r' repeats a body, so no other node can take its place\n"
            "  hint: a node of the body is changed by  r.body.NODE.uses=kind.name\n",
            self.told(2, "check", path, "--set", "r.uses=test.add"),
        )
        self.assertNotIn("\nFits\n", self.told(0, "list", "--fits", path, "r"))
        self.told(0, "check", path, "--set", "r.body.sum.uses=test.add")

    def test_names_are_no_names_of_the_body(self):
        self.write("p.yaml", OVER.replace("  l: ", "  r/l: ").replace("item: l}", "item: r/l}"))
        self.assertIn(
            "p.yaml:3:3: error: the node's name 'r/l' has a slash\n"
            "    r/l: {uses: test.letters}\n"
            "    ^\n"
            "  hint: slashes are for nodes of a body or of a part, as in track/edges",
            self.told(2, "check", "p.yaml"),
        )


if __name__ == "__main__":
    main()
