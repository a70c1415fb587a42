# SPDX-License-Identifier: Apache-2.0
"""Images as a network sees them, against values computed by hand."""
import unittest

import network_cases
import numpy as np
import cv2
import images


class Images(unittest.TestCase):
    def test_line_integrals(self):
        grey = np.array([[1000, 500], [0, 1]], np.uint16)
        darkest = -np.log(0.005)
        np.testing.assert_allclose(images.line_integrals(grey), [[0, np.log(2)], [darkest, darkest]], rtol=1e-6)

    def test_normalised(self):
        values = np.arange(101, dtype=np.float32)
        np.testing.assert_allclose(images.normalised(values, 10, 60), (values - 10) / 50, rtol=1e-6)
        self.assertTrue((images.normalised(np.full(9, 3.0), 10, 60) == 0).all())

    def test_resized_is_the_mean_of_pixels(self):
        values = np.arange(16, dtype=np.float32).reshape(4, 4)
        np.testing.assert_allclose(images.resized(values, 2), [[2.5, 4.5], [10.5, 12.5]])

    def test_scaled(self):
        np.testing.assert_allclose(images.scaled(np.array([0, 1, 5])), [0, 0.5, 2.5])

    def test_a_random_motion_keeps_the_middle_and_the_zoom(self):
        for seed in range(20):
            matrix = images.random_motion(np.random.default_rng(seed), (64, 32), (10, 20), zoom=1.25)
            np.testing.assert_allclose(matrix @ [10, 20, 1], [15.5, 31.5], atol=1e-9)
            lengths = np.linalg.norm(matrix[:, :2], axis=0)
            self.assertAlmostEqual(lengths[0], lengths[1])
            self.assertTrue(0.79 < lengths[0] < 1.26)

    def test_a_round_field_covers_what_is_outside_of_a_disc(self):
        for seed in range(20):
            random = np.random.default_rng(seed)
            outside = images.outside_of_round_field(random, (120, 160))
            values = random.uniform(0, 2, (120, 160)).astype(np.float32)
            shown = images.covered(random, values, outside)
            from_rim = cv2.distanceTransform((~outside).astype(np.uint8), cv2.DIST_L2, 5)
            v, u = np.unravel_index(np.argmax(from_rim), from_rim.shape)
            self.assertGreater(from_rim[v, u], 40)  # the disc's middle is deep inside
            np.testing.assert_allclose(shown[from_rim > 12], values[from_rim > 12], atol=1e-4)
            far = cv2.distanceTransform(outside.astype(np.uint8), cv2.DIST_L2, 5) > 12
            if far.any():
                self.assertLess(np.ptp(shown[far]), 1e-4)

    def test_changes_depend_on_the_random_numbers_alone_and_stay_finite(self):
        values = np.linspace(0, 3, 400, dtype=np.float32).reshape(20, 20)
        likeness = []
        for seed in range(30):
            one, again = (images.changed(np.random.default_rng(seed), values) for _ in range(2))
            self.assertTrue(np.isfinite(one).all())
            self.assertTrue((one == again).all())
            likeness.append(np.corrcoef(one.ravel(), values.ravel())[0, 1])
        self.assertGreater(min(likeness), 0.5)
        self.assertGreater(np.median(likeness), 0.9)


if __name__ == "__main__":
    unittest.main()
