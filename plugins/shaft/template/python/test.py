# SPDX-License-Identifier: Apache-2.0
import unittest

import marrow
import numpy as np
from new_node_file import new_node

LEFT_PX, RIGHT_PX = 215, 295  # 80 px of 0.586 mm, magnified by 1000 / 600: 28.1 mm


class NewNode(unittest.TestCase):
    def test_it_finds_the_borders_of_an_upright_shaft(self):
        camera = marrow.camera.carm(names=["frontal"], alpha_deg=[0], beta_deg=[0])["frontal"]
        image = np.full((512, 512), 1000, "uint16")
        image[:, LEFT_PX:RIGHT_PX] = 500
        # Gradients point to the bright side.
        pixels = [(u, v, direction, 0, 100) for v in range(20, 480) for u, direction in ((LEFT_PX, -1), (RIGHT_PX, 1))]
        edges = marrow.EdgeMap(pixels, width_px=512, height_px=512)
        # The borders of this drawing are sharp. Those of a bone are drawn inward by blur, which `outline` corrects.
        lines = new_node(edges, marrow.View(image, camera, name="frontal"), outline=False)
        self.assertAlmostEqual(lines.width_mm, 28.1, delta=0.5)
        self.assertAlmostEqual(lines.left[0][0], RIGHT_PX, delta=1)  # seen down the image, left is at larger u
        self.assertAlmostEqual(lines.right[0][0], LEFT_PX, delta=1)


if __name__ == "__main__":
    unittest.main()
