# SPDX-License-Identifier: Apache-2.0
"""Random experiments from a seed: with failures, missing figures, NaN, units, ties, zeros, and values of all sizes."""
import random

import numpy
from scipy.stats import qmc

from experiment import Experiment, Metric, Variant
from intervals import uniform

UNITS = ("mm", "deg", "px", "%", "")


def displacements(count, most=10.0, seed=1):
    """The first part of each start's shift: directions uniform on the sphere, lengths uniform up to `most`. Each start
    takes three numbers for its rotation and three for its shift."""
    drawn = uniform(seed, 6 * count).reshape(count, 6)[:, 3:]
    z = 2 * drawn[:, 0] - 1
    radius = numpy.sqrt(numpy.maximum(0, 1 - z * z))
    return (most * drawn[:, 2] * radius * numpy.cos(2 * numpy.pi * drawn[:, 1])).tolist()


def with_unit(value, digits, power, unit):
    """The text of a figure: value times 10 to this power."""
    number = "%.*f" % (digits, value) + ("e%d" % power if power else "")
    return (number + " " + unit).strip()


class Values:
    """Draws the texts of one figure: how its values scatter over cases, starts and variants."""

    def __init__(self, chance, metric, has_sizes):
        self.chance, self.metric = chance, metric
        self.power = chance.choice([0] * 8 + [85, -7]) if has_sizes else 0  # of ten, by which all are multiplied
        self.shape = chance.choice(["normal", "normal", "skewed", "coarse", "coarse", "equal"])
        self.effects = {}  # by column
        self.spread_of_starts = chance.choice([0, 0.1, 1])

    def of(self, column, hardness):
        chance, signed = self.chance, self.metric.better == "nearest_zero"
        if column not in self.effects:
            self.effects[column] = chance.choice([0, 0, 0.3, -0.3, 1])
        value, effect = 2 + hardness, self.effects[column]
        if self.shape == "normal":
            value += effect + chance.gauss(0, 0.5)
        elif self.shape == "skewed":
            value += (effect + 0.5) * chance.expovariate(1) ** 3
        elif self.shape == "coarse":
            value = round(value, 1) + (round(effect, 1) if chance.random() < 0.6 else 0)
            value += chance.choice([-0.2, -0.1, 0, 0, 0.1])
        else:
            value = 1 + effect
        if self.shape in ("normal", "skewed"):
            value += self.spread_of_starts * chance.random()
        if signed:
            value *= chance.choice([-1, 1])
        return with_unit(value, 1 if self.shape == "coarse" else 4, self.power, self.metric.unit)


def metrics_of(chance):
    metrics = []
    for i in range(chance.choice([1, 1, 2, 3])):
        node = "may" if i and chance.random() < 0.5 else "main"
        better = chance.choice(["lower", "lower", "higher", "nearest_zero"])
        name = "abcd"[i]
        label = chance.choice([node + "." + name, "the error %d" % i, "axial, %d" % i])
        metrics.append(Metric(node, name, label, better, chance.choice(UNITS)))
    return metrics


def add_limits(chance, metrics, values):
    """Limits of success near the values."""
    for metric in metrics:
        if chance.random() < 0.6:
            metric.limit = float("%ge%d" % (chance.choice([1.5, 2, 2.5, 4]), values[metric.name].power))


def judgement(chance, is_bad):
    word = chance.choices(["trusted", "doubtful", "wrong"], [1, 2, 3] if is_bad else [6, 1, 1])[0]
    return word + chance.choice(["", " %.1f" % (100 * chance.random())])


def fill_table(chance, experiment, columns, cases, has_sizes):
    """Draws the texts of all cells. Hard cases have large values, and make some columns fail. With `has_sizes`, some
    figures are of other powers of ten."""
    values = {metric.name: Values(chance, metric, has_sizes) for metric in experiment.metrics}
    add_limits(chance, experiment.metrics, values)
    failing = {column: chance.choice([0, 0, 0, 0.1, 0.5, 1]) for column in columns}
    may_fail = {column: chance.choice([0, 0, 0.2, 0.7]) for column in columns}
    nan_rate = chance.choice([0, 0, 0.03])
    for case in cases:
        hardness = chance.gauss(0, 1)
        for start in range(len(experiment.starts)):
            error = "%.3f mm" % (chance.random() * 10)
            for column in columns:
                texts = {m.name: values[m.name].of(column, hardness) for m in experiment.metrics}
                for metric in experiment.metrics:
                    if metric.node == "may" and hardness > 0 and chance.random() < may_fail[column]:
                        texts[metric.name] = "fail"
                    if chance.random() < nan_rate:
                        texts[metric.name] = chance.choice(["nan", "absent"])
                if hardness > 0.3 and chance.random() < failing[column]:
                    texts[experiment.metrics[0].name] = "fail"
                texts["start_error"] = error
                texts["evaluations"] = str(chance.randrange(1, 500))
                texts["verdict"] = judgement(chance, hardness > 0.5)
                experiment.table[case, column, start] = texts


def add_crash(chance, experiment):
    texts = experiment.table[chance.choice(sorted(experiment.table))]
    texts[experiment.metrics[0].name] = "crash"


def sweep_of(chance):
    is_log = chance.random() < 0.4
    low, high = (0.5, 4.0) if is_log else (-1.0, 2.0)
    return {"range": [low, high], "is_log": is_log, chance.choice(["grid", "sobol"]): chance.choice([2, 3, 5])}


def swept_values(sweep):
    if "grid" in sweep:
        fractions = [i / (sweep["grid"] - 1) for i in range(sweep["grid"])]
    else:
        fractions = qmc.Sobol(1, scramble=False).random(8)[: sweep["sobol"], 0].tolist()
    low, high = sweep["range"]
    if sweep["is_log"]:
        return [low * (high / low) ** fraction for fraction in fractions]
    return [low + (high - low) * fraction for fraction in fractions]


def stop_of(chance, experiment):
    first = len(experiment.cases)
    every = chance.choice([3, 5, 8])
    stop = {"look_every": every, "most_cases": min(40, first + chance.choice([1, 2, 3]) * every)}
    metric = chance.choice(experiment.metrics)
    if len(experiment.variants) > 1 and chance.random() < 0.6:
        variant = chance.choice([i for i in range(len(experiment.variants)) if i != experiment.baseline])
        stop.update(difference=metric.path, variant=variant, alpha=chance.choice([0.05, 0.2]))
    elif chance.random() < 0.5 and experiment.has_limits:
        stop.update(figure="success", width=chance.choice([0.4, 0.6]))
    else:
        stop.update(figure=metric.path, width=chance.choice([0.5, 1, 2]))
    return stop


def asks(chance, experiment):
    """All pairs, or the main effects of a matrix: with one more option, whose value is appended to the column."""
    experiment.compare_all = chance.random() < 0.5
    if chance.random() < 0.5 or len(experiment.variants) * len(experiment.cases) * len(experiment.starts) > 50:
        return
    experiment.variants = experiment.variants[:3]
    named = [variant.name for variant in experiment.variants]
    others = ["nm", "powell", "bobyqa"][: 3 if len(named) == 1 else 2]
    experiment.factors = [("variants", named), ("main.other", others)]
    experiment.variants = [
        Variant("%s+%s" % (name, other), name, levels=[i, k], other=other)
        for i, name in enumerate(named)
        for k, other in enumerate(others)
    ]
    experiment.baseline = chance.randrange(len(experiment.variants))
    main = [metric.name for metric in experiment.metrics if metric.node == "main"]
    for (case, column, start), texts in list(experiment.table.items()):
        for k, other in enumerate(others):
            own = experiment.table[case, column + other, start] = dict(texts)
            for name in main if k else []:  # the first one leaves the figures as they are
                own[name] = changed_a_little(chance, texts[name], k)


def changed_a_little(chance, text, by):
    """Another value of a figure that has one; at times the same, or a failure."""
    number, *unit = text.split()
    if number in ("fail", "crash", "nan", "absent") or chance.random() < 0.1:
        return text
    if chance.random() < 0.05:
        return "fail"
    digits, _, power = number.partition("e")
    decimals = len(digits.partition(".")[2])
    digits = "%.*f" % (
        decimals,
        float(digits) + chance.choice([0.1, 0.2]) * by + (chance.random() if decimals > 1 else 0),
    )
    return " ".join([digits + ("e" + power if power else ""), *unit])


def generate(seed, mode=None):
    """The experiment of a seed. Modes: plain, sweep, stop, tune."""
    chance = random.Random(seed)
    mode = mode or chance.choice(["plain"] * 6 + ["sweep", "stop", "stop", "tune"])
    columns = ["canny", "adaptive", "third", "x y"][: chance.choice([1, 2, 2, 3, 4])]
    count = chance.choice([1, 2, 3, 5, 6, 7, 9, 12, 20, 40])
    starts = chance.choice([1, 1, 2, 3, 4]) if count < 40 else 1
    if mode in ("sweep", "tune"):
        columns, count, starts = columns[:2], max(3, min(count, 9)), min(starts, 2)
    elif mode == "stop":
        count, starts = max(2, min(count, 12)), min(starts, 2)
    has_seeds = mode in ("stop", "tune")
    name = "seed-%d" if has_seeds else chance.choice(["case %02d", "=case,%02d", "-a%02d", '"%02d"', "c%02d"])
    cases = [name % (i + 1) for i in range(count)]
    variants = [Variant(column, column) for column in columns]
    experiment = Experiment("e%d" % seed, metrics_of(chance), variants, cases, displacements(starts), {})
    experiment.baseline = chance.randrange(len(variants))
    experiment.has_initial_error = chance.random() < 0.5
    experiment.has_verdict = chance.random() < 0.5
    experiment.timed_cells = chance.choice([0, 0, 0, 2])
    table_cases = cases if mode != "stop" else ["seed-%d" % (i + 1) for i in range(40)]
    fill_table(chance, experiment, columns, table_cases, mode in ("plain", "stop"))
    if mode == "plain" and chance.random() < 0.2:
        add_crash(chance, experiment)
    if mode == "stop":
        experiment.stop = stop_of(chance, experiment)
    if mode == "sweep":
        experiment.sweep = sweep_of(chance)
        experiment.baseline = 0
        experiment.variants = [
            Variant("%s+%.6g" % (one.name, value), one.column, [value], one.name)
            for one in variants
            for value in swept_values(experiment.sweep)
        ]
    if mode == "plain":
        asks(random.Random("what the experiment %d asks" % seed), experiment)
    if mode == "tune":
        bad = 0.0 if experiment.metrics[0].higher_is_better else 8.0
        experiment.tune = {"failed_as": bad, "training_cases": len(cases) // 2, "points": 6}
    return experiment
