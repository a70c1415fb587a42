# SPDX-License-Identifier: Apache-2.0
"""tools/studies/short_bones, wrist and searches: the drawn surfaces, and how they count, on motions, errors and
comparisons that are made here."""
import contextlib
import importlib.machinery
import importlib.util
import io
import json
import math
import subprocess
import sys

import numpy as np

from harness import SOURCE
from harness.program import Case, main

STUDIES = SOURCE / "tools/studies"
sys.path.insert(0, str(STUDIES))


def tool(name):
    loader = importlib.machinery.SourceFileLoader(name, str(STUDIES / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


SHORT_BONES, WRIST = tool("short_bones"), tool("wrist")


# A comparison with searches without a start.
CELLS = """cell,variant,status,errors.bone.rotation_deg,errors.bone.translation_mm,in_image.bone.mpd_mm
a,two_views,done,1,2,1
b,two_views,done,3,4,2
c,one_view,done,10,50,3
d,one_view,failed,,,
"""
# Of 2 of 2, the lower end is 0.025 ^ (1 / 2) = 15.8 %, of 1 of 2 it is 1 - 0.975 ^ (1 / 2) = 1.3 % (Clopper, Pearson).
ROWS = """| pelvis | two views | 2 of 2 (16 to 100 %) | 2 of 2 (16 to 100 %) | 2.0, 3.0 | 3.0, 4.0 | 1.5, 2.0 |
| pelvis | one view | 0 of 2 (0 to 84 %) | 1 of 2 (1 to 99 %) | 10.0, 10.0 | 50.0, 50.0 | 3.0, 3.0 |
"""


def surface(seed):
    return SHORT_BONES.triangles(SHORT_BONES.short_bone(np.random.default_rng(seed)))


class Studies(Case):
    def test_a_drawn_surface_is_closed_and_looks_outward(self):
        for seed in range(5):
            faces = surface(seed)
            corners = [[tuple(np.round(c, 6)) for c in face] for face in faces]
            corners = [face for face in corners if len(set(face)) == 3]
            edges = [(face[i], face[(i + 1) % 3]) for face in corners for i in range(3)]
            self.assertEqual(len(set(edges)), len(edges))  # each edge once in each sense
            self.assertTrue(all((b, a) in set(edges) for a, b in edges[:: len(edges) // 50]))
            volume = np.einsum("ij,ij->i", faces[:, 0], np.cross(faces[:, 1], faces[:, 2])).sum() / 6
            self.assertGreater(volume, 1000)

    def test_it_is_as_long_as_a_metacarpal_and_differs_by_seed(self):
        lengths = [np.ptp(surface(seed)[:, :, 2]) for seed in range(5)]
        self.assertTrue(all(45 <= length <= 75 for length in lengths), lengths)
        self.assertEqual(len(set(lengths)), 5)

    def test_shares_within_one_and_two_deviations(self):
        row = {"status": "done", "errors.bone.mtre_mm": 0.1}
        for i, axis in enumerate(SHORT_BONES.AXES):  # the errors are 0.5, 1.5 and 2.5 deviations
            row["errors.bone." + axis], row["errors.bone.predicted_" + axis] = 0.5 + i % 3, 1.0
        lines = [json.dumps({**row, "variant": v}) for v in ("right", "by_contour")]
        self.write("compared/cells.jsonl", "\n".join(lines) + "\n")
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            SHORT_BONES.print_shares(self.scratch)
        found = [line.split("within one, two: ")[1].split() for line in said.getvalue().splitlines() if "two:" in line]
        self.assertEqual(found[:3], [["100,", "100", "%"], ["0,", "100", "%"], ["0,", "0", "%"]])

    def test_distance_of_poses_about_and_along_the_axes(self):
        one = {"matrix": np.eye(4), "axes": np.eye(3), "origin_mm": np.array([0, 0, 50.0])}
        c, s = math.cos(math.radians(3)), math.sin(math.radians(3))
        other = {"matrix": np.array([[c, -s, 0, 1], [s, c, 0, 2], [0, 0, 1, -3], [0, 0, 0, 1]])}
        turn, shift = WRIST.apart(one, other)
        np.testing.assert_allclose(turn, [0, 0, 3], atol=1e-9)
        np.testing.assert_allclose(shift, [1, 2, -3], atol=1e-9)

    def test_the_table_of_searches_counts_and_gives_intervals(self):
        self.write("global-search-pelvis/cells.csv", CELLS)
        command = [str(STUDIES / "searches"), "global-search-pelvis"]
        text = subprocess.check_output(command, cwd=self.scratch, text=True)
        self.assertEqual(text.split("\n", 2)[2], ROWS)


if __name__ == "__main__":
    main()
