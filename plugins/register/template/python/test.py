# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node, turned


class NewNode(unittest.TestCase):
    def test_a_turn_about_the_long_axis_leaves_its_points(self):
        pose = turned(marrow.Pose(np.eye(4)), 90)  # without the axes of a bone, z is the long one
        np.testing.assert_allclose(pose.matrix @ [0, 0, 5, 1], [0, 0, 5, 1], atol=1e-9)
        np.testing.assert_allclose(pose.matrix @ [1, 0, 0, 1], [0, 1, 0, 1], atol=1e-9)

    def test_it_finds_the_pose_that_two_views_show(self):
        """A ball of water with a smaller one at its side, from a start that is 2 mm and 4 degrees off."""
        cameras = marrow.camera.carm(
            names=["frontal", "lateral"], alpha_deg=[0, 0], beta_deg=[0, 90], width_px=128, height_px=128, pixel_mm=1.2
        )
        z, y, x = np.mgrid[-30:31, -30:31, -30:31]
        bone = np.maximum(20 - np.hypot(np.hypot(x, y), z), 8 - np.hypot(np.hypot(x - 18, y - 6), z - 4))
        volume = marrow.Volume(np.clip(bone, -1, 1) * 500 - 500, spacing_mm=(1, 1, 1), origin_mm=(-30, -30, -30))
        field = marrow.SignedField(-bone, spacing_mm=(1, 1, 1), origin_mm=(-30, -30, -30))
        drr = marrow.project.joseph(volume=volume, field=field)
        seen = {name: drr(camera, np.eye(4)) for name, camera in cameras.items()}
        images = {name: (60000 * np.exp(-0.02 * seen[name])).astype("uint16") for name in seen}
        views = {name: marrow.View(images[name], cameras[name], name=name) for name in images}
        cost = marrow.similarity.gradient_correlation(projector=drr, views=views)
        off = np.array(turned(marrow.Pose(np.eye(4)), 4).matrix)
        off[:3, 3] = 2, 0, 0
        found = new_node(cost, cost, marrow.optimizer.levenberg_marquardt(), marrow.Pose(off), turns_deg=[-4.0, 0.0])
        np.testing.assert_allclose(found.pose.matrix[:3, 3], 0, atol=0.3)
        np.testing.assert_allclose(found.pose.matrix[:3, :3], np.eye(3), atol=0.03)


if __name__ == "__main__":
    unittest.main()
