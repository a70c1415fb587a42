# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node


def pose(turn_rad: float, x_mm: float) -> marrow.Pose:
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(turn_rad), -np.sin(turn_rad)], [np.sin(turn_rad), np.cos(turn_rad)]]
    matrix[0, 3] = x_mm
    return marrow.Pose(matrix)


class NewNode(unittest.TestCase):
    def test_one_wrong_pose_of_a_still_bone_is_put_right(self):
        poses = {"%04d" % i: pose(0.3, 5) for i in range(1, 8)}
        poses["0004"] = pose(0.9, 25)
        better = new_node(poses)
        self.assertEqual(list(better), list(poses))
        for one in better.values():
            np.testing.assert_allclose(one.matrix, pose(0.3, 5).matrix, atol=1e-9)


if __name__ == "__main__":
    unittest.main()
