# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node

RADIUS_MM = 20


def ball():
    """A ball of water about the world's origin."""
    z, y, x = np.mgrid[0:64, 0:64, 0:64] - 31.5
    inside = np.sqrt(x**2 + y**2 + z**2) < RADIUS_MM
    samples = np.where(inside, 0, -1000).astype("float32")
    return marrow.Volume(samples, spacing_mm=(1, 1, 1), origin_mm=(-31.5, -31.5, -31.5))


def camera():
    away = np.eye(4)
    away[2, 3] = 600
    return marrow.Camera(128, 128, [[1000, 0, 63.5], [0, 1000, 63.5], [0, 0, 1]], away)


class NewNode(unittest.TestCase):
    def test_a_ray_through_the_ball_is_as_long_as_the_ball_is_thick(self):
        draw, _ = new_node(ball())
        seen = draw(camera(), np.eye(4), np.array([[63.5, 63.5], [63.5 + 15 * 1000 / 600, 63.5], [2, 2]]))
        self.assertAlmostEqual(seen[0], 2 * RADIUS_MM, delta=0.8)
        self.assertAlmostEqual(seen[1], 2 * np.sqrt(RADIUS_MM**2 - 15**2), delta=1.5)
        self.assertEqual(seen[2], 0)

    def test_the_box_holds_the_ball(self):
        _, corners_mm = new_node(ball())
        self.assertEqual(corners_mm.shape, (8, 3))
        self.assertTrue((abs(abs(corners_mm) - RADIUS_MM) <= 1.5).all())


if __name__ == "__main__":
    unittest.main()
