# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node

RADIUS_MM, AXIS_MM = 13, np.array([5, -3])  # of an upright shaft


def cylinder():
    """A closed cylinder along z, about the origin."""
    sides, rings = 60, 31
    angle, z = np.meshgrid(2 * np.pi * np.arange(sides) / sides, np.linspace(-60, 60, rings))
    vertices = np.stack([RADIUS_MM * np.cos(angle), RADIUS_MM * np.sin(angle), z], -1).reshape(-1, 3)
    triangles = []
    for ring in range(rings - 1):
        for side in range(sides):
            a, b = ring * sides + side, ring * sides + (side + 1) % sides
            triangles += [(a, b, b + sides), (a, b + sides, a + sides)]
    for middle, ring, turn in ((len(vertices), 0, -1), (len(vertices) + 1, rings - 1, 1)):
        ends = [(ring * sides + side, ring * sides + (side + 1) % sides)[::turn] for side in range(sides)]
        triangles += [(middle, *pair) for pair in ends]
    return marrow.Mesh(np.vstack([vertices, [(0, 0, -60), (0, 0, 60)]]), triangles)


def borders(camera):
    """Where rays touch the cylinder whose axis goes upright through AXIS_MM."""
    source = -camera.camera_from_world[:3, :3].T @ camera.camera_from_world[:3, 3]
    near = (source[:2] - AXIS_MM) / np.linalg.norm(source[:2] - AXIS_MM)
    cosine = RADIUS_MM / np.linalg.norm(source[:2] - AXIS_MM)
    u_px = []
    for side in (-1, 1):
        across = side * np.sqrt(1 - cosine**2) * np.array([-near[1], near[0]])
        point = np.append(AXIS_MM + RADIUS_MM * (cosine * near + across), [0, 1])
        seen = camera.intrinsics @ (camera.camera_from_world @ point)[:3]
        u_px.append(seen[0] / seen[2])
    left, right = (((u, 150), (u, 360)) for u in (max(u_px), min(u_px)))  # down the image, left is at larger u
    return marrow.ShaftLines(left, right, width_mm=2 * RADIUS_MM, width_deviation_mm=1)


class NewNode(unittest.TestCase):
    def test_it_moves_the_axis_to_where_two_views_show_it(self):
        cameras = marrow.camera.carm(names=["frontal", "lateral"], alpha_deg=[0, 0], beta_deg=[0, 90])
        image = np.full((512, 512), 1000, "uint16")
        views = {name: marrow.View(image, cameras[name], name=name) for name in ("frontal", "lateral")}
        pose = new_node(cylinder(), {name: borders(cameras[name]) for name in views}, views)
        self.assertAlmostEqual(abs(pose.matrix[2, 2]), 1, delta=1e-4)
        np.testing.assert_allclose(pose.matrix[:2, 3], AXIS_MM, atol=0.2)


if __name__ == "__main__":
    unittest.main()
