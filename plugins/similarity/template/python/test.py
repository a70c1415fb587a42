# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node

RADIUS_MM = 20


def ball():
    """A ball of bone in a CT, about the world's origin, and the signed field of it."""
    z, y, x = np.mgrid[-24:25, -24:25, -24:25]
    off_mm = np.sqrt(x**2 + y**2 + z**2) - RADIUS_MM
    place = {"spacing_mm": (1, 1, 1), "origin_mm": (-24, -24, -24)}
    return marrow.Volume(np.where(off_mm < 0, 700, 0).astype("float32"), **place), marrow.SignedField(
        off_mm.astype("float32"), **place
    )


def view_of_ball():
    """The ball's image from 600 mm away: exp(-0.02 / mm of bone)."""
    focal_px, middle_px = 1000, 63.5
    v, u = np.mgrid[0:128, 0:128] - middle_px
    off_mm = 600 * np.sin(np.arctan(np.hypot(u, v) / focal_px))  # of the ray from the ball's middle
    thick_mm = 2 * np.sqrt(np.maximum(RADIUS_MM**2 - off_mm**2, 0))
    away = np.eye(4)
    away[2, 3] = 600
    camera = marrow.Camera(128, 128, [[focal_px, 0, middle_px], [0, focal_px, middle_px], [0, 0, 1]], away)
    return marrow.View(np.round(40000 * np.exp(-0.02 * thick_mm)).astype("uint16"), camera)


class NewNode(unittest.TestCase):
    def test_it_is_least_where_the_ball_is(self):
        costs = new_node(*ball(), {"frontal": view_of_ball()})
        poses = np.tile(np.eye(4), (5, 1, 1))
        poses[1:, :2, 3] = [(-3, 0), (3, 0), (0, -3), (0, 3)]
        there, *off = costs(poses)
        self.assertLess(there, 0.05)
        self.assertGreater(min(off), there + 0.05)

    def test_it_is_worst_where_nothing_is_seen(self):
        pose = np.eye(4)
        pose[0, 3] = 500
        self.assertEqual(new_node(*ball(), {"frontal": view_of_ball()})(pose[None])[0], 1)


if __name__ == "__main__":
    unittest.main()
