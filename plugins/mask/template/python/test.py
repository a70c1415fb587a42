# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node


class NewNode(unittest.TestCase):
    def test_it_leaves_out_a_plate_of_metal(self):
        grey = np.full((64, 64), 20000, np.uint16)
        grey[:4] = 50000  # air
        grey[30:40, 20:36] = 2000  # metal
        grey[20:60, 44:54] = 12000  # bone
        camera = marrow.Camera(64, 64, [[1000, 0, 31.5], [0, 1000, 31.5], [0, 0, 1]], np.eye(4))
        before = np.full((64, 64), 255, np.uint8)
        before[50, 2] = 0
        mask = new_node(marrow.View(grey, camera, mask=before)).mask
        expected = before.copy()
        expected[30:40, 20:36] = 0
        np.testing.assert_array_equal(mask, expected)


if __name__ == "__main__":
    unittest.main()
