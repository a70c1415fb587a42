# SPDX-License-Identifier: Apache-2.0
"""A comparison of two variants on two cases, and the program run on it."""
from harness.program import Case, wait_until

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  shared: {uses: test.work, with: {value: 0.02, path: $case}}
  m: {uses: test.misbehave, in: {a: shared}}
outputs: {number: m}
"""
DRAWN = "  drawn: {uses: render.curves, in: {metrics: %s}}\n"  # a picture of a node's number
HEAD = "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\ntimed_cells: 0\n"


class Compared(Case):
    """Has an experiment as `self.file`, and compares into the folder `self.out`."""

    pipeline, cases, variants = PIPELINE, "01", "{a: {}, b: {m.value: 5}}"

    def setUp(self):
        super().setUp()
        self.out = self.scratch / "out"
        self.write("p.yaml", self.pipeline)
        for name in self.cases:
            self.add_case(name)
        self.file = self.experiment("e", self.variants)

    def add_case(self, name):
        self.write("cases/%s/data" % name, "case " + name)

    def experiment(self, name, variants, head=HEAD):
        return self.write(name + ".yaml", head + "variants: " + variants + "\n")

    def compare(self, *arguments, status=0, file=None, out="out", **more):
        return self.expect(status, "compare", file or self.file, "--out", out, *arguments, **more)

    def refused(self, said, *arguments, **more):
        """Says in one sentence why nothing was done."""
        told = super().refused(said, *arguments, **more)
        self.assertEqual(len(told.splitlines()), 1, told)
        return told

    def refused_both(self, said, *arguments, file=None, **more):
        """By the whole comparison and by one cell of it."""
        for command in (["compare", file or self.file], ["cell", file or self.file, "a/0/0"]):
            self.refused(said, *command, *arguments, **more)

    def figures(self, out="out", column="number.value"):
        return {cell: row[column] for cell, row in self.rows(out).items()}

    def kept_row(self, cell, out="out"):
        return self.scratch / out / "cells" / cell / "cell.json"

    def wait_for(self, path):
        wait_until(path.exists, "%s did not come" % path)

    def slow(self):
        """An experiment with a cell that hangs until its time limit."""
        return self.experiment("slow", "{hang: {m.how: hang}}")
