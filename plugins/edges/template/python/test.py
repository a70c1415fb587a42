# SPDX-License-Identifier: Apache-2.0
import math
import unittest

import marrow
import numpy as np
from new_node_file import new_node

STEP_PX = 31.7


class NewNode(unittest.TestCase):
    def test_it_finds_a_step_where_it_is(self):
        row = [25000 + 5000 * math.erf((u - STEP_PX) / math.sqrt(2)) for u in range(64)]
        camera = marrow.Camera(64, 64, [[1000, 0, 31.5], [0, 1000, 31.5], [0, 0, 1]], np.eye(4))
        edges = new_node(marrow.View(np.tile(np.round(row), (64, 1)).astype("uint16"), camera))
        self.assertGreaterEqual(len(edges), 50)
        self.assertLess(abs(edges.pixels[:, 0] - STEP_PX).max(), 0.25)
        self.assertLess(abs(edges.pixels[:, 2] - 1).max(), 0.01)  # towards the brighter side


if __name__ == "__main__":
    unittest.main()
