# SPDX-License-Identifier: Apache-2.0
"""Pipelines of several files at the command line: show --resolved, graph, runs, rerun, --set-file, experiments."""
import json
import re

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


class Extends(Case):
    def setUp(self):
        super().setUp()
        for name, text in (("base.yaml", BASE), ("part.yaml", PART), ("whole.yaml", WHOLE)):
            (self.scratch / name).write_text(text)

    def run_marrow(self, *arguments, code=0):
        result = self.marrow(*arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def value(self, *arguments, out="run"):
        folder = self.scratch / out
        self.run_marrow("run", "whole.yaml", *arguments, "--out", folder)
        (metric,) = json.loads((folder / "outputs" / "sum.json").read_text())["metrics"]
        return metric["value"]

    def test_a_run(self):
        self.assertEqual(self.value(), 3 + 4 + 3)
        self.assertEqual(self.value("v=5", "--set", "plus.by=1", "--set", "d.value=2", out="two"), 5 + 2 + 1)
        self.assertEqual(self.value("--set", "plus.c.value=10", out="three"), 3 + 4 + 10)

    def test_what_a_run_writes_gives_it_again(self):
        self.value()
        text = (self.scratch / "run" / "pipeline.yaml").read_text()
        self.assertIn("plus/sum:", text)
        self.run_marrow("rerun", "run", "--out", "again")
        old, new = (self.scratch / name / "outputs" / "sum.json" for name in ("run", "again"))
        self.assertEqual(old.read_bytes(), new.read_bytes())

    def test_show_resolved(self):
        told = self.run_marrow("show", "whole.yaml", "--resolved", "v=8").stdout
        self.assertRegex(told, r"(?m)^  c: +# base\.yaml:4$")
        self.assertRegex(told, r"(?m)^      value: 8$")
        self.assertRegex(told, r"(?m)^      count: 0 +# default$")
        self.assertRegex(told, r"(?m)^  plus/sum: +# part\.yaml:5$")
        self.assertRegex(told, r"(?m)^    in: \{a: sum, b: plus/c\}$")
        (self.scratch / "resolved.yaml").write_text(told)
        self.run_marrow("check", "resolved.yaml")

    def test_inputs_are_for_resolved_only(self):
        self.value()
        told = self.run_marrow("show", "run", "v=8", code=2).stderr
        self.assertIn("values of inputs are for --resolved", told)

    def test_plan_says_where_nodes_of_other_files_are_written(self):
        (self.scratch / "mine.yaml").write_text(
            "marrow: 1\nextends: whole.yaml\nset:\n  d.value: 5\n  sum.uses: test.add\n"
        )
        told = self.run_marrow("plan", "mine.yaml").stdout
        self.assertRegex(told, r"(?m)^c +test\.constant +runs: it has not run before \(base\.yaml:4\)$")
        self.assertRegex(told, r"(?m)^d +test\.constant +.* \(base\.yaml:5, value: mine\.yaml:4\)$")
        self.assertRegex(told, r"(?m)^sum +test\.add +.* \(base\.yaml:6, uses: mine\.yaml:5\)$")
        self.assertRegex(told, r"(?m)^plus/sum +test\.add +.* \(part\.yaml:5\)$")
        self.assertRegex(self.run_marrow("plan", "base.yaml").stdout, r"(?m)^c +test\.constant .*before$")
        written = json.loads(self.run_marrow("plan", "mine.yaml", "--json").stdout)["nodes"]["c"]["written"]
        self.assertEqual(written, "base.yaml:4")

    def test_diff_says_which_file_changed_an_option(self):
        (self.scratch / "mine.yaml").write_text("marrow: 1\nextends: whole.yaml\nset: {d.value: 5}\n")
        self.run_marrow("run", "whole.yaml", "--out", "a")
        self.run_marrow("run", "mine.yaml", "--set", "d.count=2", "--out", "b")
        told = self.run_marrow("diff", "a", "b", code=1).stdout
        self.assertIn("why: option 'value' is 5, was 4 (mine.yaml:3, was base.yaml:5)", told)
        self.assertIn("why: option 'count' is 2, was 0 (--set d.count=2, was the default)", told)

    def test_a_far_file_is_named_whole(self):
        deep = self.scratch / "one" / "two"
        deep.mkdir(parents=True)
        (deep / "mine.yaml").write_text("marrow: 1\nextends: ../../base.yaml\n")
        told = self.run_marrow("plan", deep / "mine.yaml").stdout
        self.assertIn("(%s:4)" % (self.scratch.resolve() / "base.yaml"), told)

    def test_graph_says_where_nodes_are_written(self):
        told = self.run_marrow("graph", "whole.yaml").stdout
        self.assertRegex(told, r"(?m)^plus/sum  \(test\.add\)  \[\S*part\.yaml:5\]$")
        self.assertIn('tooltip="', self.run_marrow("graph", "whole.yaml", "--dot").stdout)

    def test_a_file_of_settings(self):
        (self.scratch / "here.yaml").write_text("inputs: {v: 6}\nset: {plus.by: 1, d.uses: test.draw, d.in: 3}\n")
        told = self.run_marrow("run", "whole.yaml", "--set-file", "here.yaml", code=2).stderr
        self.assertIn("here.yaml:2", told)
        (self.scratch / "here.yaml").write_text("inputs: {v: 6}\nset: {plus.by: 1, d.value: 5}\n")
        self.assertEqual(self.value("--set-file", "here.yaml"), 6 + 5 + 1)
        self.assertEqual(self.value("v=1", "--set-file", "here.yaml", "--set", "d.value=2", out="two"), 1 + 2 + 1)
        (self.scratch / "here.yaml").write_text("input: {v: 6}\n")
        told = self.run_marrow("run", "whole.yaml", "--set-file", "here.yaml", code=2).stderr
        self.assertRegex(
            told,
            r"here\.yaml:1:1: error: unknown key 'input' in the file of settings\n.*\n.*\n"
            r" +hint: did you mean 'inputs'\?",
        )
        told = self.run_marrow("run", "whole.yaml", "--set-file", "none.yaml", code=2).stderr
        self.assertIn("none.yaml: error: the file of settings cannot be read", told)

    def test_a_file_that_has_moved(self):
        (self.scratch / "old.yaml").write_text("{marrow: 1, extends: base.yaml, moved: true}\n")
        told = self.run_marrow("run", "old.yaml", "--out", "run")
        self.assertIn(
            "old.yaml has moved to base.yaml; its old name will go with the next release", told.stdout + told.stderr
        )

    def test_an_experiment_that_extends(self):
        (self.scratch / "e.yaml").write_text(
            "experiment: 1\npipeline: whole.yaml\ncases: {seeds: 1..3}\nvariants: {one: {}, two: {plus.c.value: 4}}\n"
            "metrics: [sum.value]\n"
        )
        (self.scratch / "f.yaml").write_text(
            "experiment: 1\nextends: e.yaml\nvariants: {two: null, three: {plus.by: 9}}\ncases: {seeds: 1..2}\n"
        )
        self.run_marrow("compare", "f.yaml", "--out", "compared", "--quiet")
        rows = (self.scratch / "compared" / "cells.csv").read_text().splitlines()
        found = sorted(set(re.match(r"[^,]*", row).group() for row in rows[1:]))
        self.assertEqual(len(rows), 1 + 2 * 2, rows)
        self.assertEqual([name for name in found if "two" in name], [])


main()
