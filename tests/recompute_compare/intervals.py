# SPDX-License-Identifier: Apache-2.0
"""Quantiles; success rates of runs that share cases, and the capture range; and intervals of medians: by order
statistics, and by the hierarchical bootstrap with the documented random numbers (SplitMix64; resample k has a stream of
its own)."""
import functools
import math

import numpy
from scipy.optimize import brentq
from scipy.stats import beta, binom, norm
from scipy.stats import t as student

STEP = numpy.uint64(0x9E3779B97F4A7C15)
MULTIPLIERS = numpy.uint64(0xBF58476D1CE4E5B9), numpy.uint64(0x94D049BB133111EB)


def summary(values, higher_is_better=False):
    values = numpy.array(values, float)
    q1, middle, q3, low, high = numpy.percentile(values, [25, 50, 75, 5, 95])
    return {
        "median": middle,
        "q1": q1,
        "q3": q3,
        "p5" if higher_is_better else "p95": low if higher_is_better else high,
        "worst": values.min() if higher_is_better else values.max(),
        "mean": values.mean(),
    }


def order_statistics(values, level):
    """The narrowest pair of j-th smallest and j-th largest value with the confidence 1 - level; None without any."""
    n = len(values)
    j = max((j for j in range(1, n // 2 + 1) if 2 * binom.cdf(j - 1, n, 0.5) <= level * (1 + 1e-12)), default=0)
    ordered = sorted(values)
    return (ordered[j - 1], ordered[n - j]) if j else None


def mix(z):
    z = (z ^ (z >> numpy.uint64(30))) * MULTIPLIERS[0]
    z = (z ^ (z >> numpy.uint64(27))) * MULTIPLIERS[1]
    return z ^ (z >> numpy.uint64(31))


def splitmix(state, numbers):
    """The draws of these numbers, counted from 0."""
    with numpy.errstate(over="ignore"):
        return mix(state + (numpy.asarray(numbers, numpy.uint64) + numpy.uint64(1)) * STEP)


def uniform(seed, count):
    return (splitmix(numpy.uint64(seed), numpy.arange(count)) >> numpy.uint64(11)).astype(float) * 2.0**-53


def bootstrap(cases, confidence, seed=1, resamples=10000):
    """cases: [[value of each run]]. Expanded percentile interval (Hesterberg 2015) of the median of all runs: each
    resample draws cases, and then within each as many runs as it has."""
    cases = sorted(sorted(map(float, own)) for own in cases)
    sizes = numpy.array([len(own) for own in cases])
    table = numpy.full((len(cases), sizes.max()), numpy.inf)
    for row, own in zip(table, cases):
        row[: len(own)] = own
    with numpy.errstate(over="ignore"):
        state = mix(numpy.uint64(seed) + STEP) ^ mix(~numpy.arange(resamples, dtype=numpy.uint64))
    index = lambda draw, count: ((draw >> numpy.uint64(32)) * count.astype(numpy.uint64)) >> numpy.uint64(32)
    drawn = numpy.full((resamples, len(cases), sizes.max()), numpy.inf)
    used, totals = numpy.zeros(resamples, numpy.uint64), numpy.zeros(resamples, int)
    number_of_cases = numpy.full(resamples, len(cases))
    for c in range(len(cases)):
        chosen = index(splitmix(state, used), number_of_cases).astype(int)
        used += numpy.uint64(1)
        own = sizes[chosen]
        for k in range(sizes.max()):
            has_more = k < own
            picked = index(splitmix(state, used), own).astype(int)
            drawn[has_more, c, k] = table[chosen, picked][has_more]
            used += has_more.astype(numpy.uint64)
        totals += own
    drawn = numpy.sort(drawn.reshape(resamples, -1), axis=1)
    rows = numpy.arange(resamples)
    medians = 0.5 * (drawn[rows, (totals - 1) // 2] + drawn[rows, totals // 2])
    n = len(cases)
    tail = norm.sf(numpy.sqrt(n / (n - 1)) * student.isf((1 - confidence) / 2, n - 1))
    return tuple(numpy.quantile(medians, [tail, 1 - tail]))


def resamples_for(runs):
    return min(max(int(1e9) // max(runs, 1), 1000), 10000)


def median_interval(cases, confidence=0.95):
    """Of the median of a variant's figure; None with too few cases."""
    return known_median_interval(tuple(tuple(own) for own in cases if own), confidence)


@functools.lru_cache(maxsize=4096)
def known_median_interval(cases, confidence):
    firsts = order_statistics([own[0] for own in cases], 1 - confidence) if cases else None
    if firsts is None:
        return None
    if all(len(own) == 1 for own in cases):
        return tuple(map(float, firsts))
    return bootstrap(cases, confidence, resamples=resamples_for(sum(map(len, cases))))


def wilson(rate, runs, confidence=0.95):
    """Both rates p at which |rate - p| is z standard errors sqrt(p (1 - p) / runs): Wilson's definition, solved."""
    z = norm.isf((1 - confidence) / 2)
    excess = lambda p: (rate - p) ** 2 - z * z * p * (1 - p) / runs
    solved = lambda low, high: brentq(excess, low, high, xtol=1e-15, rtol=1e-14)
    # with rate 0 or 1, one bound is the rate itself, and the other solves a linear equation
    low = runs / (runs + z * z) if rate == 1 else 0.0 if rate == 0 else solved(0, rate)
    high = z * z / (runs + z * z) if rate == 0 else 1.0 if rate == 1 else solved(rate, 1)
    return low, high


def effective_runs(outcomes):
    """outcomes: {case: [bool of each run]}. Runs over the design effect of Rao and Scott; the variance is taken with
    two more cases of a quarter of a case's weight, one that succeeds and one that fails altogether."""
    successes = numpy.array([sum(own) for own in outcomes.values()], float)
    sizes = numpy.array([len(own) for own in outcomes.values()], float)
    weights = numpy.append(numpy.ones(len(sizes)), [0.25, 0.25])
    usual = sizes.mean()
    successes, all_sizes = numpy.append(successes, [usual, 0]), numpy.append(sizes, [usual, usual])
    total = weights @ all_sizes
    rate = weights @ successes / total
    between = weights.sum() / (weights.sum() - 1) * (weights @ (successes - all_sizes * rate) ** 2) / total**2
    effect = between / (rate * (1 - rate) / total)
    return sizes.sum() / min(max(effect, 1.0), (sizes**2).sum() / sizes.sum())


class Rate:
    def __init__(self, outcomes):
        """outcomes: [(case, bool)]"""
        by_case = {}
        for case, is_good in outcomes:
            by_case.setdefault(case, []).append(is_good)
        self.of = len(outcomes)
        self.count = sum(is_good for _, is_good in outcomes)
        if self.of:
            self.rate = self.count / self.of
            self.effective = effective_runs(by_case)
            self.low, self.high = wilson(self.rate, self.effective)

    def exact(self, confidence):
        """Clopper and Pearson's interval with the effective number of runs."""
        good = self.rate * self.effective
        tail, bad = (1 - confidence) / 2, self.effective - good
        low = beta.ppf(tail, good, bad + 1) if self.count else 0.0
        high = beta.isf(tail, good + 1, bad) if self.count < self.of else 1.0
        return float(low), float(high)


BIN, LEAST, MOST_BINS = 2.0, 0.95, 100


def capture_range(starts):
    """starts: [(error, bool, case)]. (bins as (from, to, Rate), range, whether it is open)"""
    if not starts:
        return [], 0.0, False
    number = [min(int(math.floor(error / BIN)), MOST_BINS - 1) for error, _, _ in starts]
    farthest = max(error for error, _, _ in starts)
    bins = []
    for b in range(max(number) + 1):
        own = [(case, is_good) for n, (_, is_good, case) in zip(number, starts) if n == b]
        bins.append([b * BIN, (b + 1) * BIN, Rate(own)])
    bins[-1][1] = max(bins[-1][1], farthest)
    reached = 0.0
    for _, end, rate in bins:
        if rate.of and rate.count < LEAST * rate.of:
            return bins, reached, False
        reached = end if rate.of else reached
    return bins, farthest, True
