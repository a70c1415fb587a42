# SPDX-License-Identifier: Apache-2.0
"""A comparison of two variants on two cases, and the program run on it."""
import os
import subprocess

from harness import MARROW, TEST_PLUGINS
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


class Comparison(Case):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        for i in range(2):
            (self.scratch / "cases" / str(i)).mkdir(parents=True)
            self.write("cases/%d/data" % i, "case %d" % i)
        self.environment = dict(
            os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS), MARROW_CACHE=str(self.scratch / "cache")
        )
        self.file = self.experiment("e", "{a: {}, b: {m.value: 5}}")

    def experiment(self, name, variants):
        return self.write(name + ".yaml", HEAD + "variants: " + variants + "\n")

    def marrow(self, code, *arguments, **more):
        result = super().marrow(*arguments, **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def refused(self, sentence, *arguments, **more):
        """Says in one sentence why nothing was done."""
        result = self.marrow(2, *arguments, **more)
        self.assertIn(sentence, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)

    def start(self, *arguments):
        process = subprocess.Popen(
            [str(MARROW), *map(str, arguments)],
            env=self.environment,
            cwd=self.scratch,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)  # where the test ends before
        return process

    def wait_for(self, path):
        wait_until(path.exists, "%s did not come" % path)

    def slow(self):
        """An experiment with a cell that hangs until its time limit."""
        return self.experiment("slow", "{hang: {m.how: hang}}")
