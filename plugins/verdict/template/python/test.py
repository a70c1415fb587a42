# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node


class KnownTo:
    """A pose that is known to some mm along one axis, and nearly exactly in all else: what the node reads of a pose."""

    warnings, axes, origin_mm = [], np.eye(3), np.zeros(3)

    def __init__(self, deviation_mm):
        self.covariance = 1e-12 * np.eye(6)
        self.covariance[3, 3] = deviation_mm**2


class NewNode(unittest.TestCase):
    model = marrow.Mesh([(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 40)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])

    def test_it_trusts_a_pose_that_is_known_well(self):
        verdict = new_node(KnownTo(0.5), self.model)
        self.assertEqual(verdict.judgement, "trusted")
        self.assertAlmostEqual(verdict.figures["predicted_mtre_mm"], 0.5, delta=0.03)  # a shift moves all points alike

    def test_it_doubts_a_pose_that_is_hardly_known(self):
        verdict = new_node(KnownTo(2), self.model)  # more than 2 mm: beyond one standard deviation, 31.7 %
        self.assertEqual(verdict.judgement, "doubtful")
        self.assertAlmostEqual(verdict.failure_probability, 0.317, delta=0.03)

    def test_it_doubts_a_pose_without_deviations(self):
        self.assertEqual(new_node(marrow.Pose(np.eye(4)), self.model).judgement, "doubtful")


if __name__ == "__main__":
    unittest.main()
