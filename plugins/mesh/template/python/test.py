# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node

RADIUS_MM, CENTRE_MM = 10, np.array([15.2, 15.7, 16.1])


class NewNode(unittest.TestCase):
    def test_it_makes_a_ball_of_its_size(self):
        z, y, x = np.mgrid[0:32, 0:32, 0:32]
        distances = np.linalg.norm(np.stack([x, y, z], -1) - CENTRE_MM, axis=-1)
        mesh = new_node(marrow.SignedField(distances - RADIUS_MM, spacing_mm=(1, 1, 1)))
        radii = np.linalg.norm(mesh.vertices_mm - CENTRE_MM, axis=1)
        self.assertLess(abs(radii - RADIUS_MM).max(), 0.15)
        a, b, c = (mesh.vertices_mm[mesh.triangles[:, corner]] - CENTRE_MM for corner in range(3))
        volume_mm3 = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6  # positive: the normals point outward
        self.assertAlmostEqual(volume_mm3, 4188.8, delta=0.02 * 4188.8)


if __name__ == "__main__":
    unittest.main()
