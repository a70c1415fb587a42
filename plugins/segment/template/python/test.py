# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node

RADIUS_MM, CENTRES_MM = 8, {"proximal": (20, 20, 45), "distal": (20, 20, 15)}


class NewNode(unittest.TestCase):
    def test_it_finds_the_surfaces_of_two_balls(self):
        z, y, x = np.mgrid[0:61, 0:41, 0:41]
        points = np.stack([x, y, z], -1)
        outside = (
            np.min([np.linalg.norm(points - np.array(c), axis=-1) for c in CENTRES_MM.values()], axis=0) - RADIUS_MM
        )
        bone = 40 + 420 * np.clip(0.5 - outside, 0, 1)  # in soft tissue
        seeds = {name: marrow.Seeds(name, [centre]) for name, centre in CENTRES_MM.items()}
        fields = new_node(marrow.Volume(bone, spacing_mm=(1, 1, 1)), seeds)
        self.assertEqual(sorted(fields), ["distal", "proximal"])
        for name, (u, v, w) in CENTRES_MM.items():
            distances = fields[name].array
            self.assertLess(distances[w, v, u], 0)
            for side in (u - RADIUS_MM, u + RADIUS_MM):
                self.assertLess(abs(distances[w, v, side]), 0.6)
            other = next(centre for one, centre in CENTRES_MM.items() if one != name)
            self.assertGreater(distances[other[2], v, u], 0, "the other fragment is outside")


if __name__ == "__main__":
    unittest.main()
