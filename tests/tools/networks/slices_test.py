# SPDX-License-Identifier: Apache-2.0
"""The training of the network of slices: what is drawn, its figures, its smallest case, the node with its export."""
import contextlib
import io
import json
import tempfile
import unittest
import unittest.mock
import zlib

import network_cases
import numpy as np
import scanned
import slices
import torch
import yaml
from harness import formats
from harness.program import marrow

SPACING_MM = (0.8, 0.8, 1.0)


def rods(seed, slices_of=12, side=72):
    """HU of a hollow rod of bone in tissue, and where it is, with its marrow."""
    random = np.random.default_rng(seed)
    v, u = np.mgrid[:side, :side]
    distance = np.hypot(u - random.uniform(26, 46), v - random.uniform(26, 46))
    radius = random.uniform(12, 18)
    plane = np.where(distance < radius, np.where(distance < radius - 5, -20, 1300), 50)
    values = plane + random.normal(0, 30, (slices_of, side, side))
    return values.astype(np.float32), np.broadcast_to(distance < radius, values.shape)


def write_mha(path, values):
    """A volume as marrow writes it."""
    packed = zlib.compress(values.astype(np.float32).tobytes())
    size = " ".join(map(str, values.shape[::-1]))
    header = "ObjectType = Image\nNDims = 3\nCompressedData = True\nElementSpacing = %g %g %g\n" % SPACING_MM
    path.write_bytes((header + "DimSize = %s\nElementDataFile = LOCAL\n" % size).encode() + packed)


def write_case(data, seed):
    folder = data / "ct" / str(seed)
    folder.mkdir(parents=True)
    values, bone = rods(seed)
    write_mha(folder / "ct.mha", values)
    write_mha(folder / "truth.mha", bone * 1450.0)


class Weights(unittest.TestCase):
    def test_only_a_narrow_gap_counts_more(self):
        bone = np.zeros((40, 60), np.float32)
        bone[10:30, 5:20] = bone[10:30, 24:40] = bone[10:30, 52:60] = 1  # 4 and 12 pixels apart
        weights = slices.weights_of(bone)
        self.assertTrue((weights[14:26, 20:24] == slices.GAP_WEIGHT).all())
        self.assertTrue((weights[14:26, 41:51] == 1).all())
        self.assertTrue((weights[bone > 0] == 1).all())
        self.assertTrue((weights[:8] == 1).all())


class Drawing(unittest.TestCase):
    def test_depends_on_the_seed_alone(self):
        self.assertEqual(scanned.settings_of(1000), scanned.settings_of(1000))
        self.assertNotEqual(scanned.settings_of(1000), scanned.settings_of(1008))

    def test_ct_and_truth_are_scanned_alike(self):
        for seed in range(1000, 1016):
            drawn = scanned.settings_of(seed)
            for option in ("spacing_mm", "range_mm"):
                self.assertEqual(drawn["ct." + option], drawn["truth." + option])

    def test_a_case_is_made_by_marrow(self):
        with tempfile.TemporaryDirectory() as data, contextlib.redirect_stderr(io.StringIO()):
            drawn = scanned.settings_of(1004)
            self.assertEqual(scanned.kind_of(1004), "vertebra")
            coarse = {node + ".spacing_mm": "[2, 2, 2]" for node in ("ct", "truth")}
            with unittest.mock.patch.object(scanned, "settings_of", lambda seed: {**drawn, **coarse}):
                scanned.make_cases(data, [1004])
            values, bone, spacing_mm = scanned.read_case(data, 1004)
        np.testing.assert_array_equal(spacing_mm, [2, 2, 2])
        self.assertEqual(values.shape, bone.shape)
        self.assertGreater(bone.sum(), 2000)
        self.assertGreater(values[bone].mean(), values[~bone].mean() + 150)


class Figures(unittest.TestCase):
    def test_distances_of_two_squares(self):
        one, other = np.zeros((20, 20), bool), np.zeros((20, 20), bool)
        one[5:15, 5:15], other[5:15, 5:17] = True, True  # one side is 2 pixels farther
        away = slices.distances_mm(one, other)
        self.assertAlmostEqual(away.max(), 2 * slices.PIXEL_MM)
        self.assertEqual(len(slices.distances_mm(one, one & False)), 0)

    def test_a_perfect_network(self):
        scan = slices.Scan(*rods(1), SPACING_MM)
        with unittest.mock.patch.object(slices, "found_in", lambda network, scan, z: scan.bone[z]):
            figures = slices.measured(None, [scan])
        self.assertEqual((figures["dice"], figures["mean_mm"]), (1, 0))

    def test_pieces_and_holes_of_the_truth(self):
        values, bone = rods(2)
        bone = bone.copy()
        bone[5, 2, 2] = True  # of a vessel
        bone[5, 35:37, 35:37] = False  # of a screw
        scan = slices.Scan(values, bone, SPACING_MM)
        self.assertEqual(scan.bone[5, 2, 2], 0)
        self.assertEqual(scan.bone[5, 36, 36], 1)


class SmallestCase(network_cases.InAFolder):
    def test_a_network_is_trained_exported_and_used(self):
        folder = self.folder
        for seed in (1000, 1001, 2000, 3000):
            write_case(folder, seed)
        words = ["--data", folder, "--out", folder / "out", "--training", 2, "--choice", 1, "--judgement", 1]
        ran = network_cases.train("slices", *words, "--steps", 60)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        figures = json.loads((folder / "out/figures.json").read_text())
        self.assertEqual(set(figures), {"training", "choice", "judgement"})
        self.assertGreater(figures["judgement"]["dice"], 0.8)
        card = yaml.safe_load((folder / "out/slices.yaml").read_text())
        self.assertEqual(card["input"]["slices"], 3)
        # segment.network finds the rod with the exported network, within what the figures say.
        values, bone = rods(3001)
        grid = formats.straight(values.shape[::-1], spacing_mm=SPACING_MM)
        (folder / "ct.mha").write_bytes(formats.mha(grid, values.round().astype(int).ravel()))
        middle = np.argwhere(bone[6]).mean(axis=0)[::-1] * SPACING_MM[:2]
        seeds = "marrow-seeds: 1\nfragments: {rod: {seeds: [[%.2f, %.2f, 6]]}}\n" % tuple(middle)
        (folder / "seeds.yaml").write_text(seeds)
        (folder / "pipeline.yaml").write_text(
            "marrow: 1\nnodes:\n  ct: {uses: read.volume, with: {path: ct.mha}}\n"
            "  seeds: {uses: read.seeds, with: {path: seeds.yaml}}\n"
            "  rod: {uses: segment.network, in: {volume: ct, seeds: seeds}, with: {network: out/slices.yaml}}\n"
            "  surface: {uses: mesh.marching_cubes, in: {field: rod}}\noutputs: {rod: rod, surface: surface}\n"
        )
        ran = marrow("run", "pipeline.yaml", "--out", "run", "--no-cache", cwd=folder)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        (field,) = (folder / "run/outputs/rod").glob("*.mha")
        found = scanned.read_mha(field)[0] < 0
        self.assertGreater(2 * (found & bone).sum() / (found.sum() + bone.sum()), 0.8)


if __name__ == "__main__":
    unittest.main()
