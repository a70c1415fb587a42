# SPDX-License-Identifier: Apache-2.0
"""Success rates of runs that share cases, and the capture range."""
import math

import numpy
from scipy.optimize import brentq
from scipy.stats import beta, norm


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
