# SPDX-License-Identifier: Apache-2.0
"""The training of networks for landmarks, on images of discs whose middles are the points."""
import contextlib
import io
import pathlib
import tempfile
import types
import unittest
import unittest.mock

import network_cases  # noqa: F401  must come first: it looks for PyTorch
import cv2
import landmarks
import numpy as np
import torch
import yaml
from landmarks import Found, Shown

NAMES = {"small": [0, 0, 0], "large": [1, 2, 3]}


def discs(random):
    """A small dense disc and a large one, or the small one alone."""
    v, u = np.mgrid[:200, :200]
    places = random.uniform(70, 130, (2, 2)) + [[-35, 0], [35, 0]]
    values = 0.1 * random.normal(size=u.shape)
    for place, radius in zip(places, (8, 20)):
        values += np.hypot(u - place[0], v - place[1]) < radius
    return Shown(values.astype(np.float32), places)


class HeatMaps(unittest.TestCase):
    def test_a_peak_is_where_its_point_is(self):
        places = np.array([[60.3, 41.8], [np.nan, np.nan], [100.0, 120.5]])
        maps = landmarks.heat_maps(places)
        self.assertEqual(maps.shape, (3, 96, 96))
        self.assertEqual(maps[1].max(), 0)
        for heat_map, place in ((maps[0], places[0]), (maps[2], places[2])):
            centre, spread, height = landmarks.peak_of(heat_map)
            np.testing.assert_allclose((centre + 0.5) * landmarks.STRIDE_PX - 0.5, place, atol=0.05)
            # 0.777 of the deviation, as in the test of the node that uses the network
            self.assertAlmostEqual(spread, 0.777 * landmarks.SIGMA, delta=0.06)
            self.assertGreater(height, 0.9)

    def test_points_move_with_the_image(self):
        random = np.random.default_rng(3)
        values = np.zeros((150, 150), np.float32)
        place = np.array([70.0, 90.0])
        shown = Shown(np.exp(-0.5 * np.sum((np.mgrid[:150, :150][::-1].T - place) ** 2, -1).T / 9), place[None])
        for _ in range(5):
            matrix = landmarks.random_motion(random, shown)
            moved = cv2.warpAffine(shown.values.astype(np.float32), matrix, landmarks.TILE_PX[::-1])
            v, u = np.unravel_index(np.argmax(moved), moved.shape)
            np.testing.assert_allclose((u, v), matrix[:, :2] @ place + matrix[:, 2], atol=1)
        self.assertEqual(values.max(), 0)


class Figures(unittest.TestCase):
    def test_deviations_fit_the_errors(self):
        random = np.random.default_rng(5)
        found = Found()
        found.spread_mm = list(random.uniform(1, 3, 4000))
        found.off_mm = list(np.hypot(*random.normal(0, 0.7, (2, 4000))) * found.spread_mm)
        found.heights = [1.0] * 4000
        self.assertAlmostEqual(found.factor(), 0.7, delta=0.02)
        figures = found.figures(found.factor())
        self.assertAlmostEqual(figures["within_1_deviation"], 0.39, delta=0.02)
        self.assertAlmostEqual(figures["within_2_deviations"], 0.86, delta=0.02)
        self.assertEqual(figures["missed"], 0)

    def test_a_hidden_point_that_is_seen_is_false(self):
        found = Found()
        maps = landmarks.heat_maps(np.array([[50.0, 50.0], [90.0, 90.0]]))
        found.add(maps, Shown(None, np.array([[50.0, 50.0], [np.nan, np.nan]])))
        figures = found.figures(1)
        self.assertEqual((figures["points"], figures["false"]), (1, 1))
        self.assertLess(figures["median_mm"], 0.1)


class Training(unittest.TestCase):
    def test_the_smallest_training_learns_and_is_exported(self):
        views = {seed: [discs(np.random.default_rng(seed))] for seed in (1000, 1001, 1002, 2000, 3000)}
        arguments = types.SimpleNamespace(
            anatomy="femur", training=3, choice=1, judgement=1, views=1, size_px=288, steps=12, seed=1
        )
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
            arguments.data, arguments.out = pathlib.Path(folder), pathlib.Path(folder) / "out"
            for name, value in {
                "make_cases": lambda *_: None,
                "views_of": lambda data, anatomy, seed: views[seed],
                "names_of": lambda *_: NAMES,
                "WIDTHS": (4, 4, 8),
                "BATCH": 2,
            }.items():
                stack.enter_context(unittest.mock.patch.object(landmarks, name, value))
            said = stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
            landmarks.run(arguments)
            card = yaml.safe_load((arguments.out / "landmarks-femur.yaml").read_text())
            self.assertEqual(card["outputs"]["heat_maps"]["names"], list(NAMES))
            self.assertTrue((arguments.out / "landmarks-femur.onnx").stat().st_size > 1000)
            self.assertIn("OpenCV differs from PyTorch by", said.getvalue())
            losses = yaml.safe_load((arguments.out / "figures.json").read_text())["losses"]
        self.assertLess(np.mean(losses[-3:]), np.mean(losses[:3]))

    def test_cases_are_drawn_from_their_seed_alone(self):
        bone = landmarks.ANATOMIES["femur"]
        drawn, collimator = landmarks.settings_of(bone, 1007, 3, 288)
        self.assertEqual((drawn, collimator), landmarks.settings_of(bone, 1007, 3, 288))
        self.assertNotEqual(drawn, landmarks.settings_of(bone, 1008, 3, 288)[0])
        self.assertEqual(drawn["bone.side"], "left")
        turns = np.array(yaml.safe_load(drawn["cameras.beta_deg"]))
        self.assertTrue(all(min(abs(turn - side) for side in bone["sides_deg"]) <= 20 for turn in turns))


if __name__ == "__main__":
    torch.set_num_threads(1)
    unittest.main()
