# SPDX-License-Identifier: Apache-2.0
"""Differences over cases, Wilcoxon's signed-rank test and Holm's correction, in exact arithmetic; and the levels at
which a comparison is looked at while cases are added (Lan and DeMets 1983).

Values are fractions, as the table of the plugin writes them, so nothing is rounded: two differences are equal, or one
is 0, where this is so in decimal numbers.
"""
import functools
import itertools
import math
from fractions import Fraction

import numpy
from scipy.optimize import brentq
from scipy.stats import norm, rankdata

EXACT = 50  # cases up to which p is from the exact distribution


def case_differences(pairs, higher_is_better):
    """pairs: {case: [(reference, variant) of each run, None for a run without the figure]}. A dict of what follows."""
    worse = -math.inf if higher_is_better else math.inf
    runs = {"both": 0, "variant_lost": 0, "reference_lost": 0, "neither": 0}
    cases, values, of_both = dict(runs), [], []
    for own in pairs.values():
        both = [variant - reference for reference, variant in own if None not in (reference, variant)]
        variant_lost = sum(variant is None and reference is not None for reference, variant in own)
        reference_lost = sum(reference is None and variant is not None for reference, variant in own)
        runs["both"] += len(both)
        runs["variant_lost"] += variant_lost
        runs["reference_lost"] += reference_lost
        runs["neither"] += len(own) - len(both) - variant_lost - reference_lost
        mean = sum(both, Fraction(0)) / len(both) if both else None
        of_both += [mean] if both else []
        if variant_lost > reference_lost:
            cases["variant_lost"] += 1
            values.append(worse)
        elif reference_lost > variant_lost:
            cases["reference_lost"] += 1
            values.append(-worse)
        elif both:
            cases["both"] += 1
            values.append(mean)
        else:
            cases["neither"] += 1
    return {"values": values, "of_both": of_both, "runs": runs, "cases": cases}


def median(values):
    """Of fractions and infinite numbers; 0 between two infinite ones of different sign."""
    ordered = sorted(values)
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    if math.isinf(low) and math.isinf(high) and low != high:
        return 0.0
    return float((low + high) / 2)


def signed_ranks(values):
    """(ranks of the differences that are not 0, their signs, number of zeros); zeros are ranked too (Pratt)."""
    order = sorted({abs(value) for value in values})
    ranks = rankdata([order.index(abs(value)) for value in values])
    kept = [i for i, value in enumerate(values) if value != 0]
    return ranks[kept], [1 if values[i] > 0 else -1 for i in kept], len(values) - len(kept)


def p_counted(ranks, smaller):
    """By the polynomial whose coefficients count the sets of ranks with each sum."""
    counts = {0: 1}
    for rank in ranks:
        more = dict(counts)
        for total, count in counts.items():
            more[total + round(2 * rank)] = more.get(total + round(2 * rank), 0) + count
        counts = more
    below = sum(count for total, count in counts.items() if total <= round(2 * smaller))
    return float(min(Fraction(1), Fraction(2 * below, 2 ** len(ranks))))


def p_normal(ranks, smaller, zeros):
    n, (_, ties) = len(ranks) + zeros, numpy.unique(ranks, return_counts=True)
    mean = n * (n + 1) / 4 - zeros * (zeros + 1) / 4
    variance = n * (n + 1) * (2 * n + 1) / 24 - zeros * (zeros + 1) * (2 * zeros + 1) / 24
    variance -= float(numpy.sum(ties.astype(float) ** 3 - ties)) / 48
    return min(1.0, 2 * float(norm.sf(max(0.0, mean - smaller - 0.5) / math.sqrt(variance))))


def signed_rank_p(values):
    """(p, whether the positive ranks are the larger sum)"""
    return known_signed_rank_p(tuple(values))


@functools.lru_cache(maxsize=4096)
def known_signed_rank_p(values):
    ranks, signs, zeros = signed_ranks(values)
    if not len(ranks):
        return 1.0, False
    positive = sum(rank for rank, sign in zip(ranks, signs) if sign > 0)
    negative = sum(ranks) - positive
    smaller = min(positive, negative)
    p = p_counted(ranks, smaller) if len(ranks) <= EXACT else p_normal(ranks, smaller, zeros)
    return p, positive > negative


def holm(p_values):
    """The smallest level at which Holm's procedure rejects each of them."""
    p = numpy.asarray(p_values, float)
    order = numpy.argsort(p, kind="stable")
    corrected = numpy.empty(len(p))
    factors = len(p) - numpy.arange(len(p))
    corrected[order] = numpy.minimum(1, numpy.maximum.accumulate(factors * p[order]))
    return corrected.tolist()


def fewest_cases(alpha, comparisons):
    """With so many cases, the least p that there is, 2^(1 - n), is below alpha after Holm's largest factor."""
    return next(n for n in itertools.count(1) if comparisons * Fraction(2) ** (1 - n) < Fraction(str(alpha)))


NODES, WEIGHTS = numpy.polynomial.legendre.leggauss(200)


def spent(share, alpha, is_even):
    if is_even:
        return alpha * math.log(1 + (math.e - 1) * share)
    return 4 * norm.sf(norm.isf(alpha / 4) / math.sqrt(share))


def levels(shares, alpha, is_even):
    """Two-sided levels. The test's sum is a Brownian motion; Gauss and Legendre's rule carries its density from look to
    look, as long as it stays within the bounds."""
    found, before, time = [], 0.0, 0.0
    places = masses = None
    for share in shares:
        chance, sd = spent(share, alpha, is_even) - before, math.sqrt(share - time)

        def beyond(z):
            end = z * math.sqrt(share)
            if places is None:
                return 2 * norm.sf(end / sd)
            return masses @ (norm.sf((end - places) / sd) + norm.sf((end + places) / sd))

        z = brentq(lambda z: beyond(z) - chance, 0, 40, xtol=1e-12)
        found.append(2 * norm.sf(z))
        end = min(z, 8.5) * math.sqrt(share)
        new = end * NODES
        density = norm.pdf(new, scale=sd) if places is None else norm.pdf(new[:, None] - places, scale=sd) @ masses
        places, masses = new, end * WEIGHTS * density
        before, time = spent(share, alpha, is_even), share
    return found


def looks(first, every, most):
    return sorted(set(range(first, most, every)) | {most})
