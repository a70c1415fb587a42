# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node


def bowl(points):
    return (points[:, 0] - 1) ** 2 + 2 * (points[:, 1] + 2) ** 2 + 3


class NewNode(unittest.TestCase):
    def test_it_finds_the_least_of_a_bowl(self):
        problem = marrow.Problem(bowl, [0, 0], [0.5, 0.5])
        self.assertEqual(new_node(problem), "the simplex is smaller than the tolerance")
        self.assertLess(abs(problem.best - [1, -2]).max(), 1e-3)
        self.assertAlmostEqual(problem.least, 3, delta=1e-5)
        self.assertLess(problem.evaluations, 200)

    def test_it_stays_within_the_bounds(self):
        problem = marrow.Problem(bowl, [2, 2], [1, 1], lower=[1.5, -5], upper=[2.5, 5])
        new_node(problem)
        self.assertLess(abs(problem.best - [1.5, -2]).max(), 1e-3)
        self.assertTrue(np.isfinite(problem.least))


if __name__ == "__main__":
    unittest.main()
