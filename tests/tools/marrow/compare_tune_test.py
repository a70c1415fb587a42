# SPDX-License-Identifier: Apache-2.0
"""Options that an optimizer chooses on training cases, and what they are worth on cases that are held out."""
import signal
import subprocess

from compare_cases import Compared
from harness import TEST_PLUGINS
from harness.program import main

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
VALUES = """marrow: 1
inputs: {case: {type: path}}
nodes:
  r: {uses: test.case_value, with: {path: $case}}
  s: {uses: test.shifted, in: {of: r}}
outputs: {number: s}
"""
VALUES_EXPERIMENT = """experiment: 1
name: e
pipeline: p.yaml
cases: {folders: [cases/*]}
metrics: [{figure: number.value, label: error}]
timed_cells: 0
tune: {options: {s.shift: [0, 8]}, optimizer: {uses: optimizer.nelder_mead}, points: 2, failed_as: 20,
  training_cases: %d}
"""
EXPERIMENT = """experiment: 1
name: e
pipeline: p.yaml
cases: {seeds: 1..10, draw: {noise: [-1, 1]}}
metrics: [{figure: number.value, label: distance, better: nearest_zero}]
success: {number.value: 0.7}
timed_cells: 1
tune: {options: {x.value: [0, 8]}, optimizer: {uses: optimizer.nelder_mead}, points: 30, training_cases: 6}
"""


class Tuning(Compared):
    plugins = [TEST_PLUGINS, TEST_PLUGINS.parent / "relation_plugins", TEST_PLUGINS.parent / "timed_plugins"]
    pipeline, cases = PIPELINE, ()

    def setUp(self):
        super().setUp()
        self.write("e.yaml", EXPERIMENT)

    def tuned(self):
        """What is known of the tuning, and of its best point."""
        self.compare("--quiet")
        tuning = self.answer()["tuning"]
        return tuning, None if tuning["best"] is None else tuning["points"][tuning["best"]]

    def draws(self, first, last):
        """What the cases draw: number.value of the pipeline as it is is the magnitude of this, minus 2."""
        cells = ["out/cells/untuned/seed-%d/0/cell.json" % seed for seed in range(first, last + 1)]
        return [2 - self.json(cell)["values"][0] for cell in cells]

    def test_the_best_of_the_training_cases_is_compared_on_the_others(self):
        said = self.compare()
        tuning = self.answer()["tuning"]
        draws = self.draws(1, 6)
        mean = lambda x: sum(min(abs(x - 3 + draw), 7) for draw in draws) / 6
        for point in tuning["points"]:
            self.assertAlmostEqual(point["score"], mean(point["values"][0]), 5)
            self.assertEqual((point["runs"], point["failed"], point["capped"]), (6, 0, 0))
            self.assertAlmostEqual(point["mean"], point["score"], 12, "no run is worse than 7")
        self.assertAlmostEqual(tuning["untuned"]["score"], mean(1), 5)
        best = tuning["points"][tuning["best"]]
        self.assertEqual(best["score"], min(point["score"] for point in tuning["points"]))
        least = min(mean(i / 100) for i in range(801))
        self.assertLess(best["score"] - least, 0.05)
        self.assertEqual(tuning["points"][0]["values"], [1], "it begins at the pipeline's own value")
        name = "tuned+%g" % best["values"][0]
        variants = {one["name"]: one for one in self.answer()["variants"]}
        self.assertEqual(set(variants), {"untuned", name})
        values = sorted(abs(best["values"][0] - 3 + draw) for draw in self.draws(7, 10))
        self.assertAlmostEqual(variants[name]["metrics"]["number.value"]["median"], (values[1] + values[2]) / 2, 5)
        self.assertEqual(variants[name]["runs"], 4)
        self.assertIn("marrow: " + tuning["sentence"], said.stderr)
        self.assertIn("tuned on 6 cases by optimizer.nelder_mead", said.stdout + said.stderr)
        self.assertEqual(self.answer()["curves"][0]["option"], "x.value")
        self.assertIn(tuning["sentence"], self.read("out/report.html"))

        self.expect(0, "cell", self.file, name + "/seed-8/0", "--out", "out")
        self.refused("there is no variant 'tuned+99'", "cell", self.file, "tuned+99/seed-8/0", "--out", "out")
        again = self.compare("--quiet")
        self.assertIn("8 cells: 2 variants, 4 cases, 1 starts; 8 were there already", again.stdout)
        self.assertEqual(again.stderr, "")
        self.assertEqual(self.answer()["tuning"], tuning)

    def test_another_optimizer(self):
        self.write("e.yaml", EXPERIMENT.replace("nelder_mead", "direct"))
        tuning, best = self.tuned()
        self.assertEqual(tuning["optimizer"], "optimizer.direct")
        self.assertLessEqual(len(tuning["points"]), 30)
        self.assertLess(best["score"], tuning["untuned"]["score"])

    def test_a_point_that_the_pipeline_refuses_counts_as_a_bad_one(self):
        self.write("p.yaml", LIMITS)
        self.write("e.yaml", EXPERIMENT.replace("x.value: [0, 8]", "limits.low: [0, 8], limits.high: [0, 8]"))
        tuning, best = self.tuned()
        refused = [point for point in tuning["points"] if point["values"][0] > point["values"][1]]
        self.assertIn([3, 2], [point["values"] for point in refused], "the first step")
        for point in refused:
            self.assertEqual((point["score"], point["mean"], point["runs"]), (7, None, 0))
            self.assertIn("'low'", point["refused"])
        self.assertNotIn("refused", best)
        counts = len(tuning["points"]), len(refused)
        self.assertIn(", %d points, %d of them refused by the pipeline; " % counts, tuning["sentence"])

    def test_a_failed_run_counts_as_a_bad_one(self):
        self.write("p.yaml", FAILING)
        result = self.compare("--quiet")
        tuning = self.answer()["tuning"]
        nothing = {"values": [], "score": 7, "mean": None, "runs": 6, "failed": 6, "capped": 0}
        for point in (tuning["untuned"], *tuning["points"]):
            self.assertEqual({**point, "values": []}, nothing)
        self.assertEqual((tuning["untuned"]["values"], tuning["best"]), ([], None))
        self.assertRegex(
            tuning["sentence"],
            r"points; score: mean distance with failed and worse runs counted as 7; untuned: 7 \(no figure in any of 6 "
            r"runs\); no point is better than failed runs, so none is compared on the cases that are held out$",
        )
        self.assertEqual([one["name"] for one in self.answer()["variants"]], ["untuned"], "none was tuned")
        self.assertIn("failed cells", result.stdout)

    def with_values(self, *values, pipeline=VALUES, **changes):
        """An experiment whose runs of the pipeline as it is have these values; None for a run that fails. A run is the
        number of a case's file, and a tuned point adds 'shift'."""
        for i, value in enumerate(values):
            self.write("cases/%d/value" % i, "" if value is None else str(value))
        self.write("p.yaml", pipeline)
        text = VALUES_EXPERIMENT % (len(values) - 1)
        for key, (before, now) in changes.items():
            self.assertIn(key + ": " + before, text)
            text = text.replace(key + ": " + before, key + ": " + now)
        self.write("e.yaml", text)

    def assert_point(self, point, score, mean, failed, capped):
        self.assertAlmostEqual(point["score"], score, 12)
        self.assertAlmostEqual(point["mean"], mean, 12)
        self.assertEqual((point["failed"], point["capped"]), (failed, capped))

    def test_a_score_is_not_called_a_mean(self):
        """By hand: of 1, 5, 30, 140 mm and two that fail, the mean is 176 / 4 = 44, and the score, with all above 20 mm
        and the failed ones counted as 20, is (1 + 5 + 4 * 20) / 6 = 14.33."""
        self.with_values(1, 5, 30, 140, None, None, 2)
        said = self.compare().stderr
        tuning = self.answer()["tuning"]
        self.assert_point(tuning["untuned"], 86 / 6, 44, failed=2, capped=2)
        self.assertEqual(tuning["untuned"]["runs"], 6)
        rule = "score: mean error with failed and worse runs counted as 20 mm"
        text = "14.33 mm (mean 44 mm of 4 of 6 runs, 2 failed or without the figure, 2 worse than 20 mm)"
        self.assertIn("marrow: %s\nmarrow: untuned as it is: %s\n" % (rule, text), said)
        self.assertIn("; %s; untuned: %s; " % (rule, text), tuning["sentence"])
        self.assertEqual(tuning["score_rule"], rule[len("score: ") :])
        # The second of two points, 2 mm lower: (0 + 3 + 4 * 20) / 6 = 13.83, and (0 + 3 + 28 + 138) / 4 = 42.25.
        self.assert_point(tuning["points"][tuning["best"]], 83 / 6, 42.25, failed=2, capped=2)
        self.assertIn("marrow: point 2 of at most 2, s.shift 2: score 13.83 mm (mean 42.25 mm of 4 of 6 runs, ", said)
        self.assertIn("; best so far 13.83 mm (mean 42.25 mm ", said)

    def test_points_whose_runs_are_all_worse_are_none_to_choose_from(self):
        self.with_values(30, 140, 50, 2)
        tuning, best = self.tuned()
        self.assertEqual([point["capped"] for point in tuning["points"]], [3, 3])
        self.assert_point(tuning["untuned"], 20, 220 / 3, failed=0, capped=3)
        self.assertIsNone(best)
        self.assertIn("untuned: 20 mm (mean 73.33 mm of 3 runs, 3 worse than 20 mm); no point", tuning["sentence"])

    def test_higher_may_be_better(self):
        """Of 1, 5, 30 and one that fails, each below 4 counts as 4: (4 + 5 + 30 + 4) / 4 = 10.75, the mean is 12."""
        self.with_values(1, 5, 30, None, 2, label=("error", "score, better: higher"), failed_as=("20", "4"))
        tuning, _ = self.tuned()
        self.assert_point(tuning["untuned"], 10.75, 12, failed=1, capped=1)
        self.assertEqual(tuning["best"], 0, "a shift makes them lower")

    def test_a_run_without_the_figure_counts_as_failed(self):
        """The cell is done, but the node of the figure failed, which it may."""
        may_fail = VALUES.replace("$case}}", "$case}, may_fail: true}").replace("r}}", "r}, may_fail: true}")
        self.with_values(1, None, 3, pipeline=may_fail)
        tuning, _ = self.tuned()
        self.assert_point(tuning["untuned"], 10.5, 1, failed=1, capped=0)

    def test_points_of_different_units_are_refused(self):
        shift = ("{s.shift: [0, 8]}", "{s.shift: [0, 8], s.scale: [0, 1]}")
        self.with_values(1, 2, 3, options=shift, points=("2", "6"))
        said = self.compare("--quiet", status=2).stderr
        self.assertIn("has the unit 'mm' in the cell untuned/0/0 and the unit 'm' in the cell tuned+", said)

    def when_the_second_point_is_there(self, act, status, said):
        self.write("p.yaml", SLOW)
        process = self.start("compare", self.file, "--out", "out", stdout=subprocess.DEVNULL)
        next(line for line in process.stderr if "point 2 of" in line)
        act(process)
        rest = process.stderr.read()
        self.assertEqual(process.wait(), status, rest)
        self.assertRegex(rest, said)

    def test_a_change_and_an_interruption_between_two_points(self):
        said = r"p\.yaml was changed while the comparison ran: its tables may mix the old with the new"
        self.when_the_second_point_is_there(lambda process: self.write("p.yaml", PIPELINE), 2, said)
        stop = lambda process: process.send_signal(signal.SIGINT)
        self.when_the_second_point_is_there(stop, 130, "the same command goes on from here")

    def test_what_does_not_go_together(self):
        for arguments, text in (
            (("--more-cases", "5"), "--more-cases goes with a rule under 'stop', not with 'tune'"),
            (("--emit", "parallel"), "'tune' looks at each point before it chooses the next one, so it runs here"),
        ):
            self.assertIn(text, self.compare(*arguments, status=2).stderr)


if __name__ == "__main__":
    main()
