# SPDX-License-Identifier: Apache-2.0
"""tools/studies/short_bones and wrist: the drawn surfaces, and how they count, on motions and errors made here."""
import contextlib
import importlib.machinery
import importlib.util
import io
import json
import math
import pathlib
import sys
import tempfile
import unittest

import numpy as np
from harness import SOURCE

STUDIES = SOURCE / "tools/studies"
sys.path.insert(0, str(STUDIES))


def tool(name):
    loader = importlib.machinery.SourceFileLoader(name, str(STUDIES / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


SHORT_BONES, WRIST = tool("short_bones"), tool("wrist")


class Surface(unittest.TestCase):
    def surface(self, seed):
        return SHORT_BONES.triangles(SHORT_BONES.short_bone(np.random.default_rng(seed)))

    def test_is_closed_and_looks_outward(self):
        for seed in range(5):
            faces = self.surface(seed)
            corners = [[tuple(np.round(c, 6)) for c in face] for face in faces]
            corners = [face for face in corners if len(set(face)) == 3]
            edges = [(face[i], face[(i + 1) % 3]) for face in corners for i in range(3)]
            self.assertEqual(len(set(edges)), len(edges))  # each edge once in each sense
            self.assertTrue(all((b, a) in set(edges) for a, b in edges[:: len(edges) // 50]))
            volume = np.einsum("ij,ij->i", faces[:, 0], np.cross(faces[:, 1], faces[:, 2])).sum() / 6
            self.assertGreater(volume, 1000)

    def test_is_as_long_as_a_metacarpal_and_differs_by_seed(self):
        lengths = [np.ptp(self.surface(seed)[:, :, 2]) for seed in range(5)]
        self.assertTrue(all(45 <= length <= 75 for length in lengths), lengths)
        self.assertEqual(len(set(lengths)), 5)


class Counting(unittest.TestCase):
    def test_shares_within_one_and_two_deviations(self):
        row = {"status": "done", "errors.bone.mtre_mm": 0.1}
        for i, axis in enumerate(SHORT_BONES.AXES):  # the errors are 0.5, 1.5 and 2.5 deviations
            row["errors.bone." + axis], row["errors.bone.predicted_" + axis] = 0.5 + i % 3, 1.0
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "compared").mkdir()
            lines = [json.dumps({**row, "variant": v}) for v in ("right", "by_contour")]
            (pathlib.Path(folder) / "compared/cells.jsonl").write_text("\n".join(lines) + "\n")
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                SHORT_BONES.print_shares(pathlib.Path(folder))
        found = [line.split("within one, two: ")[1].split() for line in said.getvalue().splitlines() if "two:" in line]
        self.assertEqual(found[:3], [["100,", "100", "%"], ["0,", "100", "%"], ["0,", "0", "%"]])

    def test_distance_of_poses_about_and_along_the_axes(self):
        one = {"matrix": np.eye(4), "axes": np.eye(3), "origin_mm": np.array([0, 0, 50.0])}
        c, s = math.cos(math.radians(3)), math.sin(math.radians(3))
        other = {"matrix": np.array([[c, -s, 0, 1], [s, c, 0, 2], [0, 0, 1, -3], [0, 0, 0, 1]])}
        turn, shift = WRIST.apart(one, other)
        np.testing.assert_allclose(turn, [0, 0, 3], atol=1e-9)
        np.testing.assert_allclose(shift, [1, 2, -3], atol=1e-9)


if __name__ == "__main__":
    unittest.main()
