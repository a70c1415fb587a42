# SPDX-License-Identifier: Apache-2.0
"""Every figure that marrow compare says of random experiments is the one that follows from their cells."""
import collections

from harness import BUILD, need_scipy
from harness.program import Case, main
from harness.sample import ALL, sample

need_scipy()  # before the modules below
import files
import of_words
import ranks
import recompute_compare
from checks import Checks
from experiment import Experiment, Metric, Variant
from generator import displacements, generate


def features(one):
    """What an experiment has, of all that one may have."""
    mode = "stop" if one.stop else "tune" if one.tune else "sweep" if one.sweep else "plain"
    texts = {text for own in one.table.values() for text in own.values()}
    has = {
        "all pairs": one.compare_all,
        "effects": len(one.factors) > 1,
        "several starts": len(one.starts) > 1,
        "enough cases": len(one.cases) > 5,
        "verdicts": one.has_verdict,
        "a capture range": one.has_initial_error,
        "limits": one.has_limits,
        "times": one.timed_cells > 0,
        "nodes that may fail": any(metric.node == "may" for metric in one.metrics),
        **{text: text in texts for text in ("fail", "crash", "nan", "absent")},
    }
    of_mode = {mode, *(one.stop or ()), *(one.sweep or ())}
    return {name for name, is_there in has.items() if is_there} | {m.better for m in one.metrics} | of_mode


def some(seeds, count):
    """At least `count` of the seeds, which have all features that those of a larger sample have."""
    if ALL:
        return list(seeds)
    chosen, others, met = [], [], set()
    for seed in sample(seeds, 60):
        new = features(generate(seed)) - met
        (chosen if new else others).append(seed)
        met |= new
    return chosen + others[: max(0, count - len(chosen))]


class Recomputed(Case):
    def test_random_experiments(self):
        checks, done = Checks(), collections.Counter()
        for seed in some(range(1, 401), 10):
            one = recompute_compare.run_and_check(checks, seed, self.scratch / str(seed), BUILD)
            done["stop" if one.stop else "tune" if one.tune else "sweep" if one.sweep else "plain"] += 1
        print("experiments: %s\n%s" % (dict(done), checks.report()))
        self.assertEqual(checks.differences, [])
        self.assertGreater(sum(checks.counts.values()), 1000)


def differences(numbers, unit="mm", factor=1):
    """An experiment with one start, in which the variants differ by these numbers."""
    cases = ["case %02d" % i for i in range(len(numbers))]
    table = {}
    for i, (case, number) in enumerate(zip(cases, numbers)):
        for column, value in (("a", 10 + 0.1 * (i % 7)), ("b", 10 + 0.1 * (i % 7) + number)):
            text = "%s %s" % (repr(round(value * factor, 6)), unit)
            table[case, column, 0] = {"a": text, "evaluations": "1", "start_error": "1 mm", "verdict": "trusted"}
    metrics = [Metric("main", "a", "mTRE", "lower", unit)]
    return Experiment("ties", metrics, [Variant("a", "a"), Variant("b", "b")], cases, displacements(1), table)


class Told(Case):
    def run_it(self, experiment, name):
        files.write(experiment, self.scratch / name)
        return files.run(experiment, self.scratch / name, BUILD)

    def checked(self, experiment, name):
        ended, checks = self.run_it(experiment, name), Checks()
        self.assertEqual(ended.returncode, 0, ended.stderr)
        recompute_compare.check(checks, experiment, self.scratch / name / "out", ended.stdout)
        self.assertEqual(checks.differences, [])
        return ended.stdout

    def test_ties_do_not_depend_on_the_unit(self):
        # 0.1 and 0.3 - 0.2 differ in the last bit, and other bits when all is multiplied by ten.
        numbers = [0.1, 0.2, -0.1, 0.3, 0.2, 0.1, -0.2, 0.4, 0, 0.3]
        p = [ranks.signed_rank_p([ranks.Fraction(str(one)) * ten for one in numbers])[0] for ten in (1, 10)]
        self.assertEqual(p[0], p[1])
        said = [self.checked(differences(numbers, factor=ten), str(ten)).split("cases, ")[1] for ten in (1, 10)]
        self.assertEqual(said[0].split("\n")[0], said[1].split("\n")[0])

    def test_three_measures_by_two_optimizers(self):
        # gradient is 0.5 better than mutual, which is 0.01 better or worse than ncc; powell is 0.2 better than nm.
        of_measure, of_optimizer = {"gradient": 0.5, "mutual": 1.0, "ncc": 1.0}, {"nm": 0.2, "powell": 0.0}
        cases, table = ["femur %02d" % i for i in range(12)], {}
        for i, case in enumerate(cases):
            for measure, own in of_measure.items():
                for optimizer, more in of_optimizer.items():
                    sign = 0.01 if i % 2 and measure == "ncc" else -0.01 if measure == "ncc" else 0
                    text = "%.3f mm" % (2 + 0.1 * (i % 5) + own + more + sign + 0.001 * i * (optimizer == "powell"))
                    table[case, measure + optimizer, 0] = {"a": text}
                table[case, measure, 0] = {"a": "0 mm", "evaluations": "1", "start_error": "1 mm"}
        factors = [("variants", list(of_measure)), ("main.other", list(of_optimizer))]
        variants = [
            Variant("%s+%s" % (measure, optimizer), measure, levels=[m, o], other=optimizer)
            for m, measure in enumerate(of_measure)
            for o, optimizer in enumerate(of_optimizer)
        ]
        metrics = [Metric("main", "a", "mTRE", "lower", "mm")]
        experiment = Experiment("three", metrics, variants, cases, displacements(1), table)
        experiment.factors, experiment.compare_all = factors, True
        said = self.checked(experiment, "three")
        for line in (
            "1  gradient+powell  2.6565     0  a",
            "2  gradient+nm      2.8500     0  b",
            "3  mutual+powell    3.1565     0  c",
            "3  ncc+powell       3.1565     0  c",
            "5  mutual+nm        3.3500     0  d",
            "5  ncc+nm           3.3500     0  d",
            "best in mTRE: gradient+powell; 13 of 15 pairs differ; not told apart from it: none",
            "  variants: mutual against gradient: 0.50 mm worse, 95 % interval 0.50 to 0.50, 12 cases",
            "  variants: ncc against gradient: 0.500 mm worse, 95 % interval 0.490 to 0.510, 12 cases",
            "  main.other: powell against nm: 0.195 mm better, 95 % interval 0.191 to 0.198, 12 cases",
        ):
            self.assertIn("\n" + line + "\n", said)

    def test_metres_and_millimetres_are_refused(self):
        experiment = differences([0.1] * 6)
        for case in experiment.cases:
            experiment.table[case, "b", 0]["a"] = "0.0101 m"
        ended = self.run_it(experiment, "units")
        self.assertEqual(ended.returncode, 2, ended.stdout)
        self.assertIn("the figure 'main.a' has the unit 'mm' in the cell a/case 00/0", ended.stderr)
        self.assertIn("and the unit 'm' in the cell b/case 00/0", ended.stderr)

    def test_all_sizes_of_experiments(self):
        # One case up to six, at which 95 % can be reached; and 40, which no enumeration of all signs reaches.
        # 60 differences are compared by the normal distribution.
        for count in (1, 2, 5, 6, 40, 60):
            said = self.checked(differences([0.5 + 0.01 * i for i in range(count)]), "n%d" % count)
            self.assertEqual("no difference shown" in said, count < 6)
            self.assertEqual("fewer than 6 cases cannot reach p < 0.05" in said, count < 6)

    def test_how_many_cases_it_takes_is_said_before(self):
        checks = Checks()
        for seed in (1, 2, 3, 5, 6, 9):  # with all pairs and without, with a matrix, tuned, and with a rule to stop
            experiment, folder = generate(seed), self.scratch / str(seed)
            checks.where = "experiment %d" % seed
            files.write(experiment, folder)
            ended = files.run(experiment, folder, BUILD, arguments=["--dry-run"])
            self.assertEqual(ended.returncode, 0, ended.stderr)
            of_words.check_dry_run(checks, ended.stdout, experiment)
        self.assertEqual(checks.differences, [])

    def test_a_rate_that_can_never_be_so_narrow(self):
        # Clopper and Pearson's interval of 40 of 40 begins at 0.025^(1/40) = 0.9119, so it is 0.0881 wide; Wilson's,
        # which the rule does not take, is 0.0876 wide.
        for width, is_possible in ((0.0879, False), (0.089, True)):
            experiment = differences([0.1] * 40)
            experiment.cases = ["seed-%d" % (i + 1) for i in range(40)]
            table = experiment.table
            experiment.table = {("seed-%d" % (int(c[5:]) + 1), v, s): texts for (c, v, s), texts in table.items()}
            experiment.metrics[0].limit = 50
            experiment.stop = {"figure": "success", "width": width, "most_cases": 40, "look_every": 5}
            files.write(experiment, self.scratch / str(width))
            ended = files.run(experiment, self.scratch / str(width), BUILD, arguments=["--dry-run"])
            self.assertEqual("'stop' can never be met" in ended.stderr, not is_possible, ended.stderr)
            self.assertEqual("is at least 0.088 wide" in ended.stderr, not is_possible, ended.stderr)


if __name__ == "__main__":
    main()
