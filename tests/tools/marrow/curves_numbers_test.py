# SPDX-License-Identifier: Apache-2.0
"""Every figure of `marrow curves`, computed again by numpy and scipy on made sequences whose truth is known."""
from curves_cases import Curves
from harness import need_scipy
from harness.program import main

need_scipy()
import numpy  # noqa: E402
from scipy import fft, signal, stats  # noqa: E402

RATE_HZ = 50


def autoregressive(random, columns, frames, memory):
    noise = random.standard_normal((columns, frames + 300))
    return signal.lfilter([1], [1, -memory], noise, axis=1)[:, 300:]


def interval_of_mean(d):
    """The equal-weighted cosine estimator by scipy's cosine transform."""
    n = len(d)
    c = d - d.mean()
    r = numpy.clip((n * (c[1:] @ c[:-1]) / (c @ c) + 1) / (n - 4), 0, 0.999)
    freedom = int(numpy.clip(int(n * (1 - r) / (3 * numpy.pi)), 2, min(8, int(0.4 * n ** (2 / 3)))))
    weights = fft.dct(d, norm="ortho")[1 : freedom + 1]
    variance = numpy.mean(weights**2)
    half = stats.t.ppf(0.975, freedom) * numpy.sqrt(variance / n)
    return d.mean() - half, d.mean() + half, freedom, numpy.clip(d.var(ddof=1) * n / variance, 1, n)


class Numbers(Curves):
    def pair(self, first, second, times=None):
        times = numpy.arange(len(first)) / RATE_HZ if times is None else times
        files = self.two({"time_s": times, "x_mm": first}, {"time_s": times[: len(second)], "x_mm": second})
        return self.compared(*files)["x_mm"]

    def test_all_statistics_with_gaps_an_outlier_and_another_length(self):
        random = numpy.random.default_rng(4)
        times = numpy.arange(300) / RATE_HZ
        first = 20 * numpy.sin(2 * numpy.pi * times)
        second = first[:280] + 1.5 + autoregressive(random, 1, 280, 0.7)[0]
        first[40:55] = numpy.nan
        second[200] += 40
        got = self.pair(first, second, times)
        d = second - first[:280]
        keep = numpy.isfinite(d)
        a, b, d = first[:280][keep], second[keep], d[keep]
        low, high, freedom, effective = interval_of_mean(d)
        expected = {
            "times": 300,
            "both": 265,
            "only_first": 20,
            "only_second": 15,
            "bias": d.mean(),
            "rms": numpy.sqrt((d**2).mean()),
            "largest": d[numpy.abs(d).argmax()],
            "largest_at": 200 / RATE_HZ,
            "deviation": d.std(ddof=1),
            "correlation": stats.pearsonr(a, b)[0],
            "freedom": freedom,
            "effective_frames": effective,
        }
        for key, value in expected.items():
            with self.subTest(key):
                numpy.testing.assert_allclose(got[key], value, rtol=1e-9)
        half = stats.norm.ppf(0.975) * d.std(ddof=1)
        numpy.testing.assert_allclose(got["agreement"], [d.mean() - half, d.mean() + half], rtol=1e-9)
        numpy.testing.assert_allclose(got["bias_interval"], [low, high], rtol=1e-9)
        numpy.testing.assert_allclose([v for v in got["difference"] if v is not None], d, rtol=1e-12, atol=1e-12)

    def test_the_lag_of_a_shifted_sine_and_its_removal(self):
        times = numpy.arange(400) / RATE_HZ
        for lag in (0.1, -0.233, 0):
            with self.subTest(lag):
                wave = lambda at: numpy.sin(2 * numpy.pi * 0.4 * at) + 0.5 * numpy.sin(2 * numpy.pi * 1.1 * at)  # noqa
                got = self.pair(wave(times), wave(times - lag) + 3, times)
                self.assertAlmostEqual(got["lag"], lag, delta=0.001)
                self.assertGreater(got["lag_correlation"], 0.9999)
                shifted = self.compared("a.csv", "b.csv", "--lag=%g" % lag)["x_mm"]
                self.assertAlmostEqual(shifted["bias"], 3, delta=1e-3)
                self.assertLess(shifted["deviation"], 0.005)

    def test_no_lag_is_the_best_of_a_line_and_a_constant_has_no_correlation(self):
        times = numpy.arange(100) / RATE_HZ
        got = self.pair(times, times + 1)
        self.assertEqual(got["lag"], 0)
        self.assertIn("; correlation 1, and no lag matches better", got["sentence"])
        got = self.pair(numpy.zeros(100), numpy.ones(100))
        self.assertEqual([got[key] for key in ("correlation", "lag", "bias_interval")], [None] * 3)

    def test_the_interval_holds_the_truth_in_95_percent(self):
        """500 pairs of AR(1) noise of 250 frames without a difference, each: a column of the same two tables. With a
        coverage of 95 %, fewer than 92.0 or more than 97.5 % have a probability of about 0.4 % each."""
        random = numpy.random.default_rng(11)
        names = ["f%d" % i for i in range(500)]
        for memory in (0, 0.5, 0.8):
            with self.subTest(memory):
                noise = lambda: dict(zip(names, autoregressive(random, 500, 250, memory)))
                figures = self.compared(*self.two(*({"frame": range(1, 251), **noise()} for _ in range(2))))
                held = [low <= 0 <= high for low, high in (figures[name]["bias_interval"] for name in names)]
                print("AR(1) %g: the interval held 0 in %.1f %%" % (memory, 100 * numpy.mean(held)))
                self.assertGreater(numpy.mean(held), 0.92)
                self.assertLess(numpy.mean(held), 0.975)


class Bands(Curves):
    def write_trials(self, differences):
        base = numpy.zeros(differences.shape[-1])
        frames = range(1, len(base) + 1)
        for i, difference in enumerate(differences):
            for folder, values in (("a", base), ("b", difference)):
                run = "%s/t%02d/" % (folder, i)
                self.table(run + "outputs/c.csv", {"frame": frames, "f": values})
                self.write(run + "run.json", '{"outputs": [{"files": ["outputs/c.csv"]}]}')

    def figure(self):
        return self.answer_of("a", "b")["trials"][0]["figures"][0]

    @staticmethod
    def smooth(random, trials, frames, memory):
        kernel = numpy.exp(-0.5 * (numpy.arange(-3 * memory, 3 * memory + 1) / memory) ** 2)
        noise = random.standard_normal((trials, frames + 6 * memory))
        return numpy.array([numpy.convolve(row, kernel, "valid") for row in noise])

    def test_the_pointwise_band_is_students(self):
        differences = self.smooth(numpy.random.default_rng(2), 8, 50, 4) + numpy.linspace(0, 20, 50)
        self.write_trials(differences)
        got = self.figure()
        numpy.testing.assert_allclose(got["mean"], differences.mean(0), rtol=1e-9, atol=1e-9)
        half = stats.t.ppf(0.975, 7) * differences.std(0, ddof=1) / numpy.sqrt(8)
        numpy.testing.assert_allclose(got["pointwise"], half, rtol=1e-9)
        means = differences.mean(1)
        low, high = stats.t.interval(0.95, 7, means.mean(), stats.sem(means))
        numpy.testing.assert_allclose(got["bias_interval"], [low, high], rtol=1e-9)

    def test_the_simultaneous_band_is_that_of_all_sign_changes(self):
        """With 10 trials there are 1024 changes of sign; numpy takes them all, the program draws 4999 of them."""
        differences = self.smooth(numpy.random.default_rng(3), 10, 40, 3)
        self.write_trials(differences)
        got = self.figure()
        signs = numpy.array([[1 if k >> i & 1 else -1 for i in range(10)] for k in range(1024)])
        rest = differences - differences.mean(0)
        sums = signs @ rest
        t = numpy.abs(sums) / numpy.sqrt(10 * ((rest**2).sum(0) - sums**2 / 10) / 9)
        expected = numpy.quantile(t.max(1), 0.95) * differences.std(0, ddof=1) / numpy.sqrt(10)
        numpy.testing.assert_allclose(got["simultaneous"], expected, rtol=0.06)
        self.assertEqual(got, self.figure())


if __name__ == "__main__":
    main()
