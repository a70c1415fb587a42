# SPDX-License-Identifier: Apache-2.0
"""What the tests of trainings share: they end with 77 where a package of the trainings is missing."""
import importlib
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from harness import SOURCE

TRAIN = SOURCE / "tools/networks/train"
sys.path.insert(0, str(TRAIN.parent))

for module, package in {"torch": "python3-torch", "onnx": "python3-onnx", "cv2": "python3-opencv"}.items():
    try:
        importlib.import_module(module)
    except ImportError:
        print("skipped: a training needs %s, which is not installed" % package)
        sys.exit(77)


class InAFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


def train(*words, **environment):
    """Runs tools/networks/train."""
    command = [sys.executable, str(TRAIN), *map(str, words)]
    return subprocess.run(command, text=True, capture_output=True, env={**os.environ, **environment})


def view_of_discs(random, size_px=96):
    """A simulated.View whose truth is exact: a disc of bone, one of metal upon it, and a dark rim of the collimator.
    Its pixels are those of the network, 0.75 mm at the world's origin."""
    import simulated

    v, u = np.mgrid[:size_px, :size_px]
    distance = lambda at: np.hypot(u - at[0], v - at[1])
    bone, metal = random.uniform(35, 60, 2), random.uniform(35, 60, 2)
    radius_px, rim_px = random.uniform(15, 25), int(random.integers(3, 8))
    classes = np.zeros((size_px, size_px), np.uint8)
    classes[distance(bone) < radius_px] = 1
    classes[distance(metal) < 5] = 2
    classes[:, :rim_px] = 3
    line_integral = np.choose(classes, [0.5, 1.5, 4.0, 5.0]) + random.normal(0, 0.05, classes.shape)
    around = np.linspace(0, 2 * np.pi, 300)
    borders = bone + radius_px * np.column_stack([np.cos(around), np.sin(around)])
    at = np.rint(borders).astype(int)
    borders = borders[classes[at[:, 1], at[:, 0]] < 2]
    intrinsics = np.array([[800, 0, 47.5], [0, 800, 47.5], [0, 0, 1]])
    camera_from_world = np.eye(4)
    camera_from_world[2, 3] = 600
    grey = (60000 * np.exp(-line_integral)).astype(np.uint16)
    return simulated.View("discs", grey, intrinsics, camera_from_world, classes, borders)
