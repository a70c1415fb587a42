# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import best_place, cells, project


class NewNode(unittest.TestCase):
    def test_it_finds_a_shifted_spot(self):
        v, u = np.mgrid[0:120, 0:120]

        def spot(at_u, at_v):
            return np.exp(-((u - at_u) ** 2 + (v - at_v) ** 2) / (2 * 5**2))

        image, drawn = spot(63.4, 55.7), spot(60, 60)
        shift, correlation = best_place(image, drawn, np.array([60, 60]), 24, 10)
        np.testing.assert_allclose(shift, (3.4, -4.3), atol=0.1)
        self.assertGreater(correlation, 0.98)
        self.assertIsNone(best_place(image, 0 * drawn, np.array([60, 60]), 24, 10))

    def test_cells_are_means(self):
        np.testing.assert_array_equal(cells(np.arange(16.0).reshape(4, 4), 2), [[2.5, 4.5], [10.5, 12.5]])

    def test_it_projects(self):
        away = np.eye(4)
        away[2, 3] = 600
        camera = marrow.Camera(128, 128, [[1000, 0, 63.5], [0, 1000, 63.5], [0, 0, 1]], away)
        np.testing.assert_allclose(project(camera, np.eye(4), np.array([6.0, -12, 0])), (73.5, 43.5))


if __name__ == "__main__":
    unittest.main()
