# SPDX-License-Identifier: Apache-2.0
"""Pipelines of several files at the command line: show --resolved, graph, runs, rerun, --set-file, experiments."""
from harness.program import Case, main

BASE = """marrow: 1
inputs: {v: {type: number, default: 3}}
nodes:
  c: {uses: test.constant, with: {value: $v}}
  d: {uses: test.constant, with: {value: 4}}
  sum: {uses: test.add, in: {a: c, b: d}}
outputs: {sum: sum}
"""
PART = """marrow: 1
inputs: {to: {type: metrics}, by: {type: number, default: 3}}
nodes:
  c: {uses: test.constant, with: {value: $by}}
  sum: {uses: test.add, in: {a: to, b: c}}
outputs: {sum: sum}
"""
WHOLE = """marrow: 1
extends: base.yaml
nodes:
  plus: {uses: part.yaml, in: {to: sum}}
outputs: {sum: plus}
"""
MINE = "marrow: 1\nextends: whole.yaml\nset:\n  d.value: 5\n  sum.uses: test.add\n"
EXPERIMENT = """experiment: 1
pipeline: whole.yaml
cases: {seeds: 1..3}
variants: {one: {}, two: {plus.c.value: 4}}
metrics: [sum.value]
"""
EXTENDING = "experiment: 1\nextends: e.yaml\nvariants: {two: null, three: {plus.by: 9}}\ncases: {seeds: 1..2}\n"


class Extends(Case):
    def setUp(self):
        super().setUp()
        for name, text in (("base", BASE), ("part", PART), ("whole", WHOLE), ("mine", MINE)):
            self.write(name + ".yaml", text)

    def value(self, *arguments, out="run"):
        self.expect(0, "run", "whole.yaml", *arguments, "--out", out)
        return self.metric(out + "/outputs/sum.json")

    def tells(self, patterns, *command):
        told = self.printed(*command)
        for pattern in patterns:
            self.assertRegex(told, r"(?m)^%s$" % pattern)
        return told

    def test_a_run_and_what_it_writes(self):
        self.assertEqual(self.value(), 3 + 4 + 3)
        self.assertEqual(self.value("v=5", "--set", "plus.by=1", "--set", "d.value=2", out="two"), 5 + 2 + 1)
        self.assertEqual(self.value("--set", "plus.c.value=10", out="three"), 3 + 4 + 10)
        self.assertIn("plus/sum:", self.read("run/pipeline.yaml"))
        self.expect(0, "rerun", "run", "--out", "again")
        self.assertEqual(self.read("run/outputs/sum.json"), self.read("again/outputs/sum.json"))
        self.refused("values of inputs are for --resolved", "show", "run", "v=8")

    def test_show_resolved(self):
        lines = [r"  c: +# base\.yaml:4", r"      value: 8", r"      count: 0 +# default"]
        lines += [r"  plus/sum: +# part\.yaml:5", r"    in: \{a: sum, b: plus/c\}"]
        self.write("resolved.yaml", self.tells(lines, "show", "whole.yaml", "--resolved", "v=8"))
        self.expect(0, "check", "resolved.yaml")

    def test_plan_and_graph_say_where_nodes_of_other_files_are_written(self):
        lines = [
            r"c +test\.constant +runs: it has not run before \(base\.yaml:4\)",
            r"d +test\.constant +.* \(base\.yaml:5, value: mine\.yaml:4\)",
            r"sum +test\.add +.* \(base\.yaml:6, uses: mine\.yaml:5\)",
            r"plus/sum +test\.add +.* \(part\.yaml:5\)",
        ]
        self.tells(lines, "plan", "mine.yaml")
        self.tells([r"c +test\.constant .*before"], "plan", "base.yaml")
        self.assertEqual(self.json_of("plan", "mine.yaml")["nodes"]["c"]["written"], "base.yaml:4")
        self.tells([r"plus/sum  \(test\.add\)  \[\S*part\.yaml:5\]"], "graph", "whole.yaml")
        self.assertIn('tooltip="', self.printed("graph", "whole.yaml", "--dot"))
        deep = self.write("one/two/mine.yaml", "marrow: 1\nextends: ../../base.yaml\n")
        self.assertIn("(%s:4)" % (self.scratch.resolve() / "base.yaml"), self.printed("plan", deep))

    def test_diff_says_which_file_changed_an_option(self):
        self.expect(0, "run", "whole.yaml", "--out", "a")
        self.expect(0, "run", "mine.yaml", "--set", "d.count=2", "--out", "b")
        told = self.expect(1, "diff", "a", "b").stdout
        self.assertIn("why: option 'value' is 5, was 4 (mine.yaml:4, was base.yaml:5)", told)
        self.assertIn("why: option 'count' is 2, was 0 (--set d.count=2, was the default)", told)

    def test_a_file_of_settings(self):
        by_file = ["--set-file", "here.yaml"]
        self.write("here.yaml", "inputs: {v: 6}\nset: {plus.by: 1, d.uses: test.draw, d.in: 3}\n")
        self.refused("here.yaml:2", "run", "whole.yaml", *by_file)
        self.write("here.yaml", "inputs: {v: 6}\nset: {plus.by: 1, d.value: 5}\n")
        self.assertEqual(self.value(*by_file), 6 + 5 + 1)
        self.assertEqual(self.value("v=1", *by_file, "--set", "d.value=2", out="two"), 1 + 2 + 1)
        said = "unknown key 'input' in the file of settings"
        fault = ("input: {v: 6}\n", 1, 1, said, "did you mean 'inputs'?")
        self.faults(fault, command=("run", "whole.yaml", "--set-file"), file="here.yaml")
        said = "none.yaml: error: the file of settings cannot be read"
        self.refused(said, "run", "whole.yaml", "--set-file", "none.yaml")

    def test_an_experiment_that_extends(self):
        self.write("e.yaml", EXPERIMENT)
        self.write("f.yaml", EXTENDING)
        self.expect(0, "compare", "f.yaml", "--out", "out", "--quiet")
        variants = [cell.split("/")[0] for cell in self.rows()]
        self.assertEqual(len(variants), 2 * 2)
        self.assertEqual([name for name in variants if "two" in name], [])


if __name__ == "__main__":
    main()
