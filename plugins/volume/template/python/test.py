# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node


class NewNode(unittest.TestCase):
    def test_it_removes_a_bright_voxel_and_keeps_an_edge(self):
        samples = np.zeros((8, 8, 8))
        samples[4:] = 1000  # bone above z = 4
        samples[2, 3, 3] = 3000
        volume = new_node(marrow.Volume(samples, spacing_mm=(0.5, 0.5, 1), origin_mm=(1, 2, 3)))
        expected = np.zeros((8, 8, 8))
        expected[4:] = 1000
        np.testing.assert_array_equal(volume.array, expected)
        np.testing.assert_array_equal(volume.origin_mm, (1, 2, 3))


if __name__ == "__main__":
    unittest.main()
