# SPDX-License-Identifier: Apache-2.0
"""The training of the network of bones: its smallest case on discs, its figures, and the nodes with its export."""
import contextlib
import io
import json
import pathlib
import subprocess
import tempfile
import unittest
import unittest.mock

import network_cases
import numpy as np
from harness import BUILD
import bones
import cv2
import export
import torch
import training
from model import Head, UNet

TILE_PX = (64, 64)


def planes(count, seed):
    random = np.random.default_rng(seed)
    return [bones.Plane(network_cases.view_of_discs(random)) for _ in range(count)]


class Planes(unittest.TestCase):
    def test_pixels_of_another_size_are_resampled_with_the_borders(self):
        view = network_cases.view_of_discs(np.random.default_rng(1))
        view.intrinsics = view.intrinsics * [[2], [2], [1]]  # pixels of 0.375 mm
        plane = bones.Plane(view)
        self.assertEqual(plane.values.shape, (48, 48))
        self.assertEqual(plane.classes.shape, (48, 48))
        np.testing.assert_allclose(plane.borders_px, (view.borders_px + 0.5) / 2 - 0.5)

    def test_a_tile_moves_image_classes_and_borders_alike(self):
        plane = planes(1, 2)[0]
        with unittest.mock.patch.object(bones, "TRAINING_PX", TILE_PX):
            with unittest.mock.patch.object(bones.images, "changed", lambda random, values: values):
                tiles = [bones.tile_of(np.random.default_rng(seed), plane) for seed in range(6)]
        for image, classes, borders, inside in tiles:
            shown = inside[0] > 0
            bone, background = ((classes == i) & shown for i in (1, 0))
            self.assertGreater(image[0][bone].mean(), image[0][background].mean() + 0.3)
            edge = cv2.morphologyEx(bone.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)) > 0
            on_border = borders[0].astype(bool) & shown
            self.assertGreater(np.mean(edge[on_border]), 0.9)


class Figures(unittest.TestCase):
    def test_hand_computed(self):
        plane = planes(1, 3)[0]
        plane.classes = np.zeros((20, 20), np.uint8)
        plane.classes[:10] = bones.BONE  # 200 pixels
        plane.borders_px = np.array([[u, 10.0] for u in range(20)])
        classes = np.zeros((20, 20), int)
        classes[:5] = bones.BONE  # 100 of them
        strength = np.zeros((20, 20))
        strength[12, :10] = 0.8  # 2 px off, of which half is found
        strength[15, :10] = 0.8  # 5 px off
        figures = bones.Figures()
        figures.add(classes, strength, plane)
        at = figures.at(0.5)
        self.assertAlmostEqual(at["bone_dice"], 2 * 100 / (100 + 200))
        self.assertAlmostEqual(at["border_precision"], 0.5)
        self.assertAlmostEqual(at["border_recall"], 0.5)
        self.assertEqual(figures.at(0.9)["border_recall"], 0)

    def test_half_means_the_threshold_that_was_chosen(self):
        network = UNet(1, {"classes": Head(4), "borders": Head(1)}, widths=(4, 8)).eval()
        image = torch.rand(1, 1, 16, 16)
        with torch.no_grad():
            before = torch.sigmoid(network(image)[1])
            threshold = bones.make_half_the_threshold(network, planes(2, 8))
            after = torch.sigmoid(network(image)[1])
        self.assertTrue(torch.equal(before > threshold, after > 0.5))


class SmallestCase(unittest.TestCase):
    """Trains for some steps on discs, exports, and computes the nodes with the export."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        torch.manual_seed(1)
        cls.network = UNet(1, {"classes": Head(4), "borders": Head(1)}, widths=(6, 12, 16))
        card = {**bones.CARD, "file": "discs", "trained": {"data": "discs", "good_for": "discs", "not_for": "all else"}}
        card["input"] = {**card["input"], "size_px": list(TILE_PX), "overlap_px": 16}
        with unittest.mock.patch.object(bones, "TRAINING_PX", TILE_PX), contextlib.redirect_stdout(io.StringIO()):
            batch = bones.batches(planes(12, 4))
            judge = lambda network: bones.liked(bones.measured(network, planes(3, 5)))
            arguments = {"steps": 80, "seed": 1, "out": cls.folder, "rate": 1e-2, "looks": 2}
            cls.losses = training.train(cls.network, batch, bones.loss_of, judge, **arguments)
            bones.make_half_the_threshold(cls.network, planes(3, 5))
            cls.worst = export.write(cls.network, card, cls.folder)

    def test_loss_falls_and_opencv_gives_the_values_of_pytorch(self):
        self.assertLess(np.mean(self.losses[-10:]), 0.6 * np.mean(self.losses[:10]))
        self.assertLess(self.worst, 1e-4)

    def test_other_discs_are_found(self):
        figures = bones.measured(self.network, planes(6, 6))
        self.assertGreater(figures.dice()[bones.BONE], 0.8)
        self.assertGreater(figures.balance().max(), 0.6)

    def test_the_nodes_find_them_too(self):
        view = network_cases.view_of_discs(np.random.default_rng(7))
        cv2.imwrite(str(self.folder / "image.png"), view.grey)
        camera = {"marrow-camera": 1, "width_px": 96, "height_px": 96, "intrinsics": view.intrinsics.tolist()}
        camera["camera_from_world"] = {"target": "camera", "source": "world", "matrix": view.camera_from_world.tolist()}
        (self.folder / "camera.yaml").write_text(json.dumps(camera))
        network = self.folder / "discs.yaml"
        pipeline = {
            "marrow": 1,
            "nodes": {
                "view": {"uses": "read.view", "with": {"image": "image.png", "camera": "camera.yaml"}},
                "edges": {"uses": "edges.network", "in": {"view": "view"}, "with": {"network": str(network)}},
                "masked": {
                    "uses": "mask.network",
                    "in": {"view": "view"},
                    "with": {"network": str(network), "margin_px": 0},
                },
            },
            "outputs": {"edges": "edges", "masked": "masked"},
        }
        (self.folder / "discs-pipeline.yaml").write_text(json.dumps(pipeline))
        out = self.folder / "run"
        command = [BUILD / "bin/marrow", "run", self.folder / "discs-pipeline.yaml", "--out", out, "--no-cache", "-q"]
        done = subprocess.run([str(word) for word in command], text=True, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = cv2.imread(str(out / "outputs/edges.png"), -1) > 0
        true = np.zeros_like(found)
        at = np.rint(view.borders_px).astype(int)
        true[at[:, 1], at[:, 0]] = True
        self.assertGreater(np.mean(bones.far_from(found)[true] <= 2), 0.7)
        self.assertGreater(np.mean(bones.far_from(true)[found] <= 2), 0.6)
        # The node leaves out what the network in PyTorch calls metal or outside.
        masked = cv2.imread(str(out / "outputs/masked/mask.png"), -1) == 0
        classes, _ = bones.maps_of(self.network, bones.Plane(view))
        self.assertGreater(np.mean(masked == (classes >= bones.METAL)), 0.97)


if __name__ == "__main__":
    unittest.main()
