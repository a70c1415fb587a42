# SPDX-License-Identifier: Apache-2.0
"""marrow's statistics beside scipy's, on fixed data. Prints the largest deviation of each. scipy_test.py PROGRAM"""
import subprocess
import sys
import warnings

try:
    import numpy
    from scipy import stats
except ImportError as missing:
    print(f"skipped: {missing}; install python3-scipy to compare with it")
    sys.exit(77)

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


def split_mix(seed):
    mask = (1 << 64) - 1
    while True:
        seed = (seed + 0x9E3779B97F4A7C15) & mask
        bits = ((seed ^ (seed >> 30)) * 0xBF58476D1CE4E5B9) & mask
        bits = ((bits ^ (bits >> 27)) * 0x94D049BB133111EB) & mask
        yield bits ^ (bits >> 31)


def check_bootstrap(random):
    # split_mix itself, on the first outputs of seed 1234567 that are published with the algorithm's implementations
    outputs = split_mix(1234567)
    assert [next(outputs) for _ in range(3)] == [6457827717110365317, 3203168211198807973, 9817491932198370423]
    ten_cases = numpy.array([0.3, -0.1, 0.25, 0.4, 0.05, 0.2, 0.15, 0.6, -0.2, 0.35])
    data = [(ten_cases, 1, 0.95), (numpy.array([0.7]), 1, 0.95), (numpy.full(9, 0.7), 3, 0.95)]
    settings = [(6, 5, 0.95), (13, 2**40 + 1, 0.9), (20, 0, 0.95), (40, 9, 0.5)]
    data += [(random.standard_t(3, n), seed, confidence) for n, seed, confidence in settings]
    got = answers([line("median_interval", values, seed, c) for values, seed, c in data])
    for (values, seed, confidence), interval in zip(data, got):
        outputs, n = split_mix(seed), len(values)
        drawn = numpy.array([((next(outputs) >> 32) * n) >> 32 for _ in range(10000 * n)]).reshape(10000, n)
        medians = numpy.median(numpy.sort(values)[drawn], axis=1)
        tails = [50 * (1 - confidence), 50 * (1 + confidence)]
        compare("bootstrap, same resamples", interval, numpy.percentile(medians, tails), 1e-13, values)
        if numpy.ptp(values) == 0:
            continue  # scipy refuses one value
        theirs = stats.bootstrap(
            (values,), numpy.median, confidence_level=confidence, n_resamples=10000, method="percentile", random_state=1
        ).confidence_interval
        of_width = (numpy.array(interval) - theirs.low) / (theirs.high - theirs.low)
        compare("bootstrap, scipy's own resamples (of the width)", 1 + of_width, [1, 2], 0.1, values)


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
check_bootstrap(random)
check_holm()
for what, (count, deviation) in largest.items():
    print(f"{what}: {count} compared, largest deviation {deviation:.2g}")
if failures:
    sys.exit("\n".join(failures))
