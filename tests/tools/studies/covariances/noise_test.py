#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The predicted deviations of nodes that fit points are right over 60 draws of noise: the ratio of two root mean
squares of 60 errors or more is known to a tenth, the shares within one and two deviations (68 and 95 %) to a few
points. The study beside this test does the same for the costs."""
import sys
import unittest

from harness import BUILD, SOURCE

sys.path[:0] = [str(SOURCE / "tests/tools/studies/covariances/study"), str(BUILD / "python")]

import figures
import fits
import noise
import numpy as np

import marrow

DRAWS = 60


class Noise(unittest.TestCase):
    def test_fits_of_points_predict_their_errors(self):
        for name in fits.FITS:
            if not name.startswith("initial."):
                continue
            with self.subTest(name):
                of = figures.of([noise.draw((name, 1, number)) for number in range(DRAWS)], figures.GROUPS)
                self.assertEqual(of["known"], DRAWS)
                for group in figures.GROUPS:
                    self.assertTrue(0.5 < of[group] < 2, "%s: %.2f" % (group, of[group]))
                self.assertTrue(0.58 < of["within one"] < 0.78, of["within one"])
                self.assertTrue(0.9 < of["within two"] < 0.99, of["within two"])
                # With one view, the depth is known to 19 mm. Over such a distance, errors no longer form an ellipsoid.
                most = 4 if "1 view" in name else 1.4
                self.assertTrue(0.7 < of["mahalanobis"] < most, of["mahalanobis"])

    def test_each_cost_is_in_the_study(self):
        costs = set(dir(marrow.similarity)) - {"with_prior", "with_contact"}  # they add to another cost
        of_study = {name.split(",")[0] for name in noise.studies() if " view" in name}
        self.assertLessEqual(costs, of_study)

    def test_figures_of_normal_errors_are_those_of_the_normal_distribution(self):
        random, root = np.random.default_rng(2), 0.1 * np.diag([1, 2, 3, 4, 5, 6]) @ np.linalg.qr(np.eye(6) + 0.3)[0]
        draws = [(root @ random.normal(size=6), root @ root.T) for _ in range(4000)]
        of = figures.of(draws, {"all": range(6)})
        self.assertAlmostEqual(of["all"], 1, delta=0.03)
        self.assertAlmostEqual(of["within one"], 0.6827, delta=0.01)
        self.assertAlmostEqual(of["within two"], 0.9545, delta=0.005)
        self.assertAlmostEqual(of["mahalanobis"], 1, delta=0.03)
        self.assertEqual(figures.of([(error, None) for error, _ in draws], {"all": range(6)}), {"known": 0})


if __name__ == "__main__":
    unittest.main()
