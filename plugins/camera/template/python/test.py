# SPDX-License-Identifier: Apache-2.0
import unittest

from new_node_file import new_node


def seen_px(camera, point_mm):
    """Where the camera sees a point of the world."""
    u, v, depth = camera.intrinsics @ (camera.camera_from_world @ [*point_mm, 1])[:3]
    return u / depth, v / depth


class NewNode(unittest.TestCase):
    def test_it_shows_the_isocentre_in_the_middle_and_magnifies_by_the_distances(self):
        camera = new_node(names=["frontal"], alpha_deg=[0], beta_deg=[0])["frontal"]
        middle, below = seen_px(camera, (0, 0, 0)), seen_px(camera, (0, 0, -9))
        self.assertAlmostEqual(middle[0], 255.5, delta=1e-9)
        self.assertAlmostEqual(middle[1], 255.5, delta=1e-9)
        self.assertAlmostEqual(below[1] - middle[1], 9 * 1000 / 600 / 0.586, delta=1e-6)  # the head is up

    def test_a_lateral_view_looks_from_the_side(self):
        camera = new_node()["lateral"]
        self.assertAlmostEqual(seen_px(camera, (50, 0, 0))[0], 255.5, delta=1e-6)
        self.assertGreater(abs(seen_px(camera, (0, 9, 0))[0] - 255.5), 20)


if __name__ == "__main__":
    unittest.main()
