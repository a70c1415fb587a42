# SPDX-License-Identifier: Apache-2.0
"""marrow's statistics beside scipy's, on fixed data. Prints the largest deviation of each. scipy_test.py PROGRAM"""
import subprocess
import sys
import warnings

from harness import need_scipy

need_scipy()
import numpy  # noqa: E402
from scipy import stats  # noqa: E402

PROGRAM = sys.argv[1]
warnings.simplefilter("ignore")  # scipy warns of small samples and ties, which are the point here
largest, failures = {}, []


def answers(lines):
    result = subprocess.run([PROGRAM], input="\n".join(lines) + "\n", text=True, capture_output=True, check=True)
    return [[float(number) for number in line.split()] for line in result.stdout.splitlines()]


def line(command, values, *settings):
    return " ".join([command, *map(repr, settings), *(repr(float(value)) for value in values)])


def compare(what, got, expected, tolerance, data):
    """Both relative to the expected value, or absolute where that is below 1e-300."""
    got, expected = numpy.atleast_1d(got), numpy.atleast_1d(expected)
    scale = numpy.where(numpy.abs(expected) > 1e-300, numpy.abs(expected), 1)
    deviation = float(numpy.max(numpy.abs(got - expected) / scale))
    count, before = largest.get(what, (0, 0.0))
    largest[what] = (count + 1, max(before, deviation))
    if not deviation <= tolerance:
        failures.append(f"{what}: got {got}, scipy {expected}, deviation {deviation} > {tolerance}, on {data}")


def check_wilson():
    settings = [
        (k, n, c)
        for n in (1, 2, 10, 37, 500, 100000)
        for k in sorted({0, 1, n // 3, n - 1, n})
        for c in (0.5, 0.95, 0.999)
    ]
    got = answers([f"wilson {k} {n} {c}" for k, n, c in settings])
    for (k, n, c), interval in zip(settings, got):
        expected = stats.binomtest(k, n).proportion_ci(c, method="wilson")
        # near 0 both take the difference of two almost equal numbers, so 1 + the bound is compared
        theirs = numpy.array([expected.low, expected.high])
        compare("Wilson interval", 1 + numpy.array(interval), 1 + theirs, 1e-12, (k, n, c))


def samples(random):
    """Differences without ties and zeros, of 1 to 400 cases, with heavy tails, and a shift in every second."""
    for k, n in enumerate([1, 2, 3, 4, 5, 6, 7, 10, 13, 20, 25, 37, 49, 50, 51, 80, 150, 400]):
        yield random.standard_t(3, n) + (0.7 if k % 2 else 0)


def tied_samples(random):
    yield [2.0] * 5
    yield [-0.25] * 30
    yield [0.3] * 60
    yield [0.0, -1, 2, 3]
    yield [0.0, 0, 0, 0, 1]
    yield [1.0, -1, 1, -1]
    yield [0.0]
    yield [0.0] * 7
    for n in (2, 3, 6, 8, 10, 12, 20, 50, 51, 200):
        yield random.integers(-3, 6, n).astype(float)  # ties and zeros
        yield random.integers(1, 5, n) * random.choice([-1.0, 1.0], n)  # ties only


def check_summary(random):
    data = list(samples(random)) + list(tied_samples(random))
    for values, got in zip(data, answers([line("summary", values) for values in data])):
        values = numpy.asarray(values)
        quantiles = [numpy.median(values), *numpy.percentile(values, [25, 75, 95])]
        expected = [len(values), values.mean(), *quantiles, values.max()]
        scale = max(numpy.abs(values).max(), 1e-300)
        compare("summary", 1 + numpy.array(got) / scale, 1 + numpy.array(expected) / scale, 1e-14, values)


def check_without_ties(random):
    data = list(samples(random))
    exact = [values for values in data if len(values) <= 50]
    for values, got in zip(exact, answers([line("exact", values) for values in exact])):
        expected = stats.wilcoxon(values, method="exact")
        compare("signed rank, exact: p", got[2], expected.pvalue, 1e-12, values)
        compare("signed rank, exact: W", min(got[:2]), expected.statistic, 0, values)
    for values, got in zip(data, answers([line("normal", values) for values in data])):
        compare("signed rank, normal: p", got[2], normal(values), 1e-12, values)


def normal(values):
    if not numpy.any(values):
        return 1.0  # where scipy refuses
    return stats.wilcoxon(values, zero_method="pratt", correction=True, method="approx").pvalue


def check_ties_and_zeros(random):
    data = list(tied_samples(random))
    for values, got in zip(data, answers([line("normal", values) for values in data])):
        compare("signed rank, normal with ties and zeros: p", got[2], normal(values), 1e-12, values)
    few = [values for values in data if len(values) <= 12]
    for values, got in zip(few, answers([line("exact", values) for values in few])):
        expected = all_signs(numpy.asarray(values))
        compare("signed rank, all signs tried with ties and zeros: p", got[2], expected, 1e-12, values)


def all_signs(values):
    """scipy tries every assignment of signs to the midranks; those of zeros are left out after ranking (Pratt)."""
    ranks = stats.rankdata(numpy.abs(values)) * numpy.sign(values)
    ranks = ranks[ranks != 0]
    if len(ranks) == 0:
        return 1.0
    if len(ranks) == 1:
        return 1.0  # two assignments, one to either side; scipy wants two observations
    test = stats.permutation_test(
        (ranks,),
        lambda r, axis: numpy.sum(r, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=numpy.inf,
    )
    return min(1.0, test.pvalue)


def check_units():
    """Differences of 0.1 mm in other units: scipy gets whole numbers, in which ties and zeros are exact."""
    random = numpy.random.default_rng(2)
    for unit in (1, 0.1, 0.01, 1e-3, 1 / 3, 25.4):
        data = [random.integers(-3, 6, n) for n in (6, 8, 12, 20, 60, 200)]
        for values, got in zip(data, answers([line("normal", values * unit) for values in data])):
            compare("signed rank in other units: p", got[2], normal(values.astype(float)), 1e-12, values)


def check_medians(random):
    """The order statistics by scipy's binomial distribution; the bootstrap, with the same share of other resamples."""
    for n in (1, 2, 5, 6, 7, 8, 9, 20, 51, 400):
        for level in (0.05, 0.01, 0.2):
            values = random.standard_t(3, n)
            below = [j for j in range(1, n + 1) if 2 * stats.binom.cdf(j - 1, n, 0.5) <= level]
            ordered = numpy.sort(values)
            expected = (ordered[below[-1] - 1], ordered[n - below[-1]]) if below else (-numpy.inf, numpy.inf)
            got = answers([line("order_statistics", values, level)])[0]
            if tuple(got) != expected:
                failures.append(f"order statistics: got {got}, scipy {expected}, on {n} values at {level}")
    for cases, runs, confidence in ((6, 3, 0.95), (12, 5, 0.95), (20, 2, 0.9)):
        values = random.normal(size=(cases, 1)) + random.normal(size=(cases, runs))
        drawn = values[random.integers(cases, size=(20000, cases))]
        drawn = numpy.take_along_axis(drawn, random.integers(runs, size=drawn.shape), axis=2)
        tail = stats.norm.sf(numpy.sqrt(cases / (cases - 1)) * stats.t.isf((1 - confidence) / 2, cases - 1))
        theirs = numpy.quantile(numpy.median(drawn, axis=(1, 2)), [tail, 1 - tail])
        got = numpy.array(answers([line("median_of_runs", values.ravel(), runs, confidence)])[0])
        of_width = (got - theirs[0]) / (theirs[1] - theirs[0])
        compare("bootstrap, numpy's own resamples (of the width)", 1 + of_width, [1, 2], 0.1, values)


def check_exact_rates():
    settings = [(k, n, c) for n in (1, 2, 3, 20, 500) for k in sorted({0, 1, n // 2, n}) for c in (0.95, 0.999)]
    for (k, n, c), got in zip(settings, answers([f"exact_rate {k} {n} {c}" for k, n, c in settings])):
        theirs = stats.binomtest(k, n).proportion_ci(c, method="exact")
        compare("exact interval of a rate", 1 + numpy.array(got), 1 + numpy.array(tuple(theirs)), 1e-12, (k, n, c))


def check_holm():
    for p_values in ([0.01, 0.04, 0.03, 0.005], [0.5], [1.0, 0.0, 0.2, 0.2, 1e-9]):
        order, m = numpy.argsort(p_values), len(p_values)
        steps = numpy.minimum(1, (m - numpy.arange(m)) * numpy.asarray(p_values)[order])
        expected = numpy.empty(m)
        expected[order] = numpy.maximum.accumulate(steps)
        compare("Holm", answers([line("holm", p_values)])[0], expected, 1e-15, p_values)


random = numpy.random.default_rng(1)
check_wilson()
check_summary(random)
check_without_ties(random)
check_ties_and_zeros(random)
check_units()
check_medians(random)
check_exact_rates()
check_holm()
for what, (count, deviation) in largest.items():
    print(f"{what}: {count} compared, largest deviation {deviation:.2g}")
if failures:
    sys.exit("\n".join(failures))
