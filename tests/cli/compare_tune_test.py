# SPDX-License-Identifier: Apache-2.0
"""Options that an optimizer chooses on training cases, and what they are worth on cases that are held out."""
import json
import os
import signal
import subprocess
import time

from marrow_cli import MARROW, TEST_PLUGINS, Case, main, marrow

# number.value is x - 3 + a draw of the case's seed, and best is nearest to zero.
PIPELINE = """marrow: 1
inputs: {noise: {type: number, help: draw}}
nodes:
  x: {uses: test.constant, with: {value: 1}}
  goal: {uses: test.constant, with: {value: -3}}
  drawn: {uses: test.constant, with: {value: $noise}}
  sum: {uses: test.add, in: {a: x, b: goal}}
  noisy: {uses: test.add, in: {a: sum, b: drawn}}
outputs: {number: noisy}
"""
FAILING = PIPELINE.replace("b: drawn", "b: bad").replace(
    "outputs", "  bad: {uses: test.fail_above, with: {value: -100}, in: {a: drawn}}\noutputs"
)
LIMITS = PIPELINE.replace("number: noisy", "number: all").replace(
    "outputs",
    "  limits: {uses: test.limits, with: {low: 1, high: 2}}\n"
    "  all: {uses: test.add, in: {a: noisy, b: limits}}\noutputs",
)
SLOW = PIPELINE.replace("b: drawn", "b: slow").replace(
    "outputs", "  slow: {uses: test.work, with: {value: 0.2}, in: {after: sum}}\noutputs"
)
EXPERIMENT = """experiment: 1
name: e
pipeline: p.yaml
cases: {seeds: 1..10, draw: {noise: [-1, 1]}}
metrics: [{figure: number.value, label: distance, better: nearest_zero}]
success: {number.value: 0.7}
timed_cells: 1
tune: {options: {x.value: [0, 8]}, optimizer: {uses: optimizer.%s}, points: 30, training_cases: 6}
"""


class Tuning(Case):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        self.file = self.write("e.yaml", EXPERIMENT % "nelder_mead")

    def marrow(self, *arguments):
        return marrow(
            *arguments,
            plugins=[TEST_PLUGINS, TEST_PLUGINS.parent / "relation_plugins"],
            extra_environment={"MARROW_CACHE": str(self.scratch / "cache")},
            cwd=self.scratch
        )

    def compare(self, *arguments, code=0):
        result = self.marrow("compare", self.file, "--out", "out", *arguments)
        self.assertEqual(result.returncode, code, result.stderr + result.stdout)
        return result

    def answer(self):
        return json.loads((self.scratch / "out" / "comparison.json").read_text())

    def draws(self, first, last):
        """What the cases draw: number.value of the pipeline as it is is the magnitude of this, minus 2."""
        values = []
        for seed in range(first, last + 1):
            row = json.loads((self.scratch / "out/cells/untuned" / ("seed-%d" % seed) / "0/cell.json").read_text())
            values.append(2 - row["values"][0])
        return values

    def test_the_best_of_the_training_cases_is_compared_on_the_others(self):
        said = self.compare()
        tuning = self.answer()["tuning"]
        draws = self.draws(1, 6)
        mean = lambda x: sum(min(abs(x - 3 + draw), 7) for draw in draws) / 6
        for point in tuning["points"]:
            self.assertAlmostEqual(point["figure"], mean(point["values"][0]), 5)
            self.assertEqual(point["runs"], 6)
        self.assertAlmostEqual(tuning["untuned"]["figure"], mean(1), 5)
        best = tuning["points"][tuning["best"]]
        self.assertEqual(best["figure"], min(point["figure"] for point in tuning["points"]))
        least = min(mean(i / 100) for i in range(801))
        self.assertLess(best["figure"] - least, 0.05)
        self.assertEqual(tuning["points"][0]["values"], [1], "it begins at the pipeline's own value")
        name = "tuned+%g" % best["values"][0]
        variants = {one["name"]: one for one in self.answer()["variants"]}
        self.assertEqual(set(variants), {"untuned", name})
        held_out = self.draws(7, 10)
        values = sorted(abs(best["values"][0] - 3 + draw) for draw in held_out)
        self.assertAlmostEqual(variants[name]["metrics"]["number.value"]["median"], (values[1] + values[2]) / 2, 5)
        self.assertEqual(variants[name]["runs"], 4)
        self.assertIn("marrow: " + tuning["sentence"], said.stderr)
        self.assertIn("tuned on 6 cases by optimizer.nelder_mead", said.stdout + said.stderr)
        self.assertEqual(self.answer()["curves"][0]["option"], "x.value")
        page = (self.scratch / "out" / "report.html").read_text()
        self.assertIn(tuning["sentence"], page)

        cell = self.marrow("cell", self.file, name + "/seed-8/0", "--out", "out")
        self.assertEqual(cell.returncode, 0, cell.stderr)
        unknown = self.marrow("cell", self.file, "tuned+99/seed-8/0", "--out", "out")
        self.assertIn("there is no variant 'tuned+99'", unknown.stderr)

        again = self.compare("--quiet")
        self.assertIn("8 cells: 2 variants, 4 cases, 1 starts; 8 were there already", again.stdout)
        self.assertEqual(again.stderr, "")
        self.assertEqual(self.answer()["tuning"], tuning)

    def test_another_optimizer(self):
        self.file = self.write("e.yaml", EXPERIMENT % "direct")
        self.compare("--quiet")
        tuning = self.answer()["tuning"]
        self.assertEqual(tuning["optimizer"], "optimizer.direct")
        self.assertLessEqual(len(tuning["points"]), 30)
        self.assertLess(tuning["points"][tuning["best"]]["figure"], tuning["untuned"]["figure"])

    def test_a_point_that_the_pipeline_refuses_counts_as_a_bad_one(self):
        self.write("p.yaml", LIMITS)
        self.file = self.write(
            "e.yaml", EXPERIMENT.replace("x.value: [0, 8]", "limits.low: [0, 8], limits.high: [0, 8]") % "nelder_mead"
        )
        self.compare("--quiet")
        tuning = self.answer()["tuning"]
        refused = [point for point in tuning["points"] if point["values"][0] > point["values"][1]]
        self.assertIn([3, 2], [point["values"] for point in refused], "the first step")
        for point in refused:
            self.assertEqual((point["figure"], point["runs"]), (7, 0))
            self.assertIn("'low'", point["refused"])
        self.assertNotIn("refused", tuning["points"][tuning["best"]])

    def test_a_failed_run_counts_as_a_bad_one(self):
        self.write("p.yaml", FAILING)
        result = self.compare("--quiet")
        tuning = self.answer()["tuning"]
        self.assertEqual(tuning["untuned"], {"values": [], "figure": 7, "runs": 6, "failed": 6})
        self.assertIn("which is no better", tuning["sentence"])
        self.assertIn("failed cells", result.stdout)

    def test_interrupted_it_goes_on(self):
        self.write("p.yaml", SLOW)
        self.file = self.write("e.yaml", EXPERIMENT % "nelder_mead")
        environment = dict(os.environ, MARROW_CACHE=str(self.scratch / "cache"), MARROW_PLUGIN_PATH=str(TEST_PLUGINS))
        process = subprocess.Popen(
            [MARROW, "compare", self.file, "--out", "out"],
            cwd=self.scratch,
            env=environment,
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            text=True,
        )
        for line in process.stderr:
            if "point 2 of" in line:
                process.send_signal(signal.SIGINT)
                break
        rest = process.stderr.read()
        process.stderr.close()
        self.assertEqual(process.wait(), 130, rest)
        self.assertIn("the same command goes on from here", rest)

    def test_what_does_not_go_together(self):
        for arguments, text in (
            (("--more-cases", "5"), "--more-cases goes with a rule under 'stop', not with 'tune'"),
            (("--emit", "parallel"), "'tune' looks at each point before it chooses the next one, so it runs here"),
        ):
            self.assertIn(text, self.compare(*arguments, code=2).stderr)


if __name__ == "__main__":
    main()
