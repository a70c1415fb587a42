# SPDX-License-Identifier: Apache-2.0
"""tools/studies/deviations on errors that are drawn here: how it counts them, and the factors that it fits."""
import contextlib
import importlib.machinery
import importlib.util
import io
import random
import re
import unittest

from harness import SOURCE


def tool():
    loader = importlib.machinery.SourceFileLoader("deviations", str(SOURCE / "tools/studies/deviations"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("deviations", loader))
    loader.exec_module(module)
    return module


DEVIATIONS = tool()
# How many times larger than predicted the deviation of the errors is.
TRUE_FACTORS = {"first": [2, 1, 0.5, 1, 1.5, 3], "final": [1, 0.7, 1.2, 4, 0.25, 1]}


def rows(count):
    chance = random.Random(1)
    made = []
    for _ in range(count):
        row = {}
        for stage, factors in TRUE_FACTORS.items():
            row["errors.distal.%s.mtre_mm" % stage] = "0.1"
            for axis, factor in zip(DEVIATIONS.AXES, factors):
                predicted = chance.uniform(0.01, 0.1)
                row["errors.distal.%s.predicted_%s" % (stage, axis)] = repr(predicted)
                row["errors.distal.%s.%s" % (stage, axis)] = repr(chance.gauss(0, predicted * factor))
        made.append(row)
    return made


def printed(call, *arguments):
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream):
        call(*arguments)
    return stream.getvalue()


class Deviations(unittest.TestCase):
    def test_the_factors_and_the_shares_are_those_of_the_errors(self):
        many = rows(4000)
        text = printed(DEVIATIONS.print_factors, many)
        found = [
            (name, list(map(float, re.findall(r"[\d.]+", numbers))))
            for name, numbers in re.findall(r"(\w+): \[(.*)\]", text)
        ]
        names = ("first_rotation", "first_translation", "rotation", "translation")
        first, final = TRUE_FACTORS["first"], TRUE_FACTORS["final"]
        self.assertEqual([name for name, _ in found], [name + "_factors" for name in names])
        for (name, factors), wanted in zip(found, (first[:3], first[3:], final[:3], final[3:])):
            for got, expected in zip(factors, wanted):
                self.assertAlmostEqual(got / expected, 1, delta=0.06, msg=name)
        # Within one and two deviations: twice, as, half as large as predicted, and so on: of the normal distribution.
        text = printed(DEVIATIONS.print_stage, many, "first")
        shares = [tuple(map(int, pair)) for pair in re.findall(r"(\d+) %\s+(\d+) %", text)]
        expected = [(38, 68), (68, 95), (95, 100), (68, 95), (50, 82), (26, 50)]
        self.assertEqual(len(shares), len(expected))
        for got, wanted in zip(shares, expected):
            self.assertLessEqual(max(abs(a - b) for a, b in zip(got, wanted)), 3, text)

    def test_factors_are_judged_on_poses_that_they_were_not_fitted_to(self):
        chance = random.Random(2)
        ratios = [abs(chance.gauss(0, 3)) for _ in range(2000)]
        for got, wanted in zip(DEVIATIONS.shares_of_others(ratios), (0.683, 0.954)):
            self.assertAlmostEqual(got, wanted, delta=0.03)
        # One half is five times larger than the other half. Judged by the factor of the other half, all of the
        # small errors lie within one deviation and none of the large ones within two.
        halves = [5 * ratio if i % 2 else ratio for i, ratio in enumerate([1, 1.1, 0.9, 1.2] * 10)]
        self.assertEqual(DEVIATIONS.shares_of_others(halves, 2), [0.5, 0.5])
        # They are printed with a fit.
        self.assertNotIn("by factors of others", printed(DEVIATIONS.print_stage, rows(200), "first"))
        text = printed(DEVIATIONS.print_stage, rows(1000), "first", True)
        shares = re.findall(r"(\d+) %, +(\d+) %$", text, re.M)
        self.assertEqual(len(shares), 6)
        for one, two in shares:
            self.assertLess(abs(int(one) - 68) + abs(int(two) - 95), 9, text)

    def test_a_pose_that_is_wrong_is_left_out(self):
        some = rows(20)
        some[3]["errors.distal.first.mtre_mm"] = "2.5"
        self.assertIn("contour: 19 poses, 1 left out", printed(DEVIATIONS.print_stage, some, "first"))


if __name__ == "__main__":
    unittest.main()
