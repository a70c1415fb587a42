# SPDX-License-Identifier: Apache-2.0
"""Pipelines that repeat: what a person is told by check, graph, plan, run, diff and a page, and what is left after a
crash."""
import json

from diff_cases import Runs
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


GRAPH = """l  (test.letters)
r  (repeat)  each letter in turn
    item <- l
    before <- sum of the pass before
    | before  (test.constant)
    | item  (test.constant)
    | sum  (test.add)
    |     a <- before
    |     b <- item
outputs
    all <- r.sum  (a list over letter)
    last <- r.last_sum
"""
RULE = """marrow: 1
nodes:
  c: {uses: test.constant, with: {value: 3}}
  s: {uses: test.stop_above, in: {a: c}, with: {value: 2}}
outputs: {s: s}
"""


class Repetition(Runs):
    has_own_store = True
    files = {"sum.yaml": BODY, "p.yaml": OVER}

    def told(self, code, *arguments):
        result = self.expect(code, *arguments)
        return result.stdout + result.stderr

    def test_the_body_is_a_pipeline_of_its_own(self):
        self.assertIn("good; 3 nodes, 1 outputs", self.printed("check", "sum.yaml"))
        self.expect(0, "run", "sum.yaml", "--out", "alone")
        self.assertEqual(self.metric("alone/outputs/sum.json"), 3)

    def test_a_run_and_its_page_tell_of_its_passes(self):
        told = self.told(0, "run", "p.yaml", "--out", "a")
        self.assertRegex(told, r"\nr +repeat +\d+\.\d+ +3  done\n +3 passes\n")
        self.assertRegex(told, r"\nr/before +test\.constant +\d+\.\d+ +1  done\n")
        self.assertRegex(told, r"\nr/sum +test\.add +\d+\.\d+ +3  done\n")
        outputs = ["all/x", "all/y", "all/z", "last"]
        self.assertEqual([self.metric("a/outputs/%s.json" % name) for name in outputs], [101, 301, 601, 601])
        nodes = self.nodes("a")
        self.assertEqual(list(nodes), ["l", "r", "r/before", "r/sum"])
        self.assertEqual([(one["name"], one["status"]) for one in nodes["r"]["passes"]], [(n, "done") for n in "xyz"])
        self.assertEqual([item[0] for item in nodes["r/sum"]["items"]["sum"]], ["x", "y", "z"])
        self.expect(0, "show", "a")
        data = self.page_data("a/report.html")
        self.assertEqual([one["node"] for one in data["passes"]], ["r"])
        self.assertEqual([one["name"] for one in data["passes"][0]["passes"]], ["x", "y", "z"])
        shown = {node["id"]: node for node in data["graph"]["nodes"]}
        options = {"passes": "each letter in turn", "if_pass_fails": "end", "carry before": "sum"}
        self.assertEqual(shown["r"]["options"], options)
        edges = {(edge["from"], edge["to"]) for edge in data["graph"]["edges"]}
        self.assertEqual(edges, {("l", "r/sum"), ("r/before", "r/sum"), ("r/sum", "r")})

    def test_check_and_graph(self):
        self.assertIn("  r runs a body of 3 nodes: each letter in turn\n", self.printed("check", "p.yaml"))
        self.assertEqual(self.told(0, "graph", "p.yaml"), GRAPH)
        dot = self.printed("graph", "p.yaml", "--dot")
        for line in (
            'subgraph "cluster r" {',
            '"l" -> "r/sum" [label="b"];',
            '"r/sum" -> "r/sum" [label="a", constraint=false, color=gray50];',
        ):
            self.assertIn(line, dot)

    def test_a_pass_that_fails(self):
        self.write("sum.yaml", LIMITED)
        said = "error: node 'r' (repeat) failed: pass y failed: the number is too large; give a smaller one"
        self.assertIn(said, self.told(1, "run", "p.yaml", "--out", "a"))
        told = self.told(0, "run", "p.yaml", "--out", "b", "--set", "r.if_pass_fails=go_on")
        self.assertIn("warning: node 'good' (test.fail_above) in r/y failed: the number is too large; give a", told)
        passes = self.nodes("b")["r"]["passes"]
        self.assertEqual([one["status"] for one in passes], ["done", "failed", "failed"])
        self.assertEqual(passes[1]["reason"], "the number is too large; give a smaller one")
        self.assertEqual(self.metric("b/outputs/last.json"), 100)

    def test_plans_and_differences_name_what_is_in_the_body(self):
        plan = ["plan", "p.yaml"]
        self.assertRegex(self.printed(*plan), r"\nr +repeat +runs unless 'l' comes out unchanged\n")
        self.run_into("a", OVER)
        self.assertRegex(self.printed(*plan), r"\nr +repeat +cached\n")
        another = ["--set", "r.body.before.value=2"]
        self.assertRegex(self.printed(*plan, *another), r"\nr +repeat +runs: pass x: node 'before': ")
        self.run_into("b", OVER, *another)
        told = self.diff(1, "a", "b")
        self.assertIn(
            "First difference: node 'r/before' (test.constant)\n  why: option 'value' is 2, was 1 "
            "(--set r.body.before.value=2, was sum.yaml:3)\n",
            told,
        )
        self.assertIn("In consequence differ: r, r/sum\n", told)
        self.run_into("c", OVER)
        same = "identical: all 4 nodes came out the same"
        self.assertIn(same, self.diff(0, "a", "c"))
        self.assertIn(same, self.printed("rerun", "b", "--out", "d", "--quiet"))

    def test_what_was_done_is_kept_when_it_is_killed(self):
        self.write("p.yaml", SLOW)
        process = self.start("run", "p.yaml", "--out", "killed", "--json")
        done = 0
        for event in map(json.loads, process.stdout):
            done += event["event"] == "finished" and event["node"] == "r/sum"
            if done == 3:
                break
        process.kill()
        process.wait()
        self.expect(0, "run", "p.yaml", "--out", "again")
        work = self.nodes("again")["r/work"]
        self.assertGreaterEqual(work["cached"], 3)
        self.assertEqual(work["cached"] + work["calls"], 16)
        self.expect(0, "run", "p.yaml", "--out", "whole", "--no-cache", "--threads", "1")
        self.assertIn("identical: all 5 nodes", self.printed("diff", "again", "whole"))

    def test_a_rule_is_written_as_json(self):
        self.run_into("a", RULE)
        self.assertEqual(self.json("a/outputs/s.json"), {"stops": True, "reason": "it is above 2"})

    def test_nothing_takes_the_place_of_a_body(self):
        said = (
            "error: node 'r' repeats a body, so no other node can take its place\n"
            "  hint: a node of the body is changed by  r.body.NODE.uses=kind.name\n"
        )
        self.refused(said, "check", "p.yaml", "--set", "r.uses=test.add")
        self.assertNotIn("\nFits\n", self.printed("list", "--fits", "p.yaml", "r"))
        self.expect(0, "check", "p.yaml", "--set", "r.body.sum.uses=test.add")

    def test_names_are_no_names_of_the_body(self):
        self.write("p.yaml", OVER.replace("  l: ", "  r/l: ").replace("item: l}", "item: r/l}"))
        self.refused(
            "p.yaml:3:3: error: the node's name 'r/l' has a slash\n"
            "    r/l: {uses: test.letters}\n"
            "    ^\n"
            "  hint: slashes are for nodes of a body or of a part, as in track/edges",
            *("check", "p.yaml"),
        )


if __name__ == "__main__":
    main()
