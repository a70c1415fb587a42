# SPDX-License-Identifier: Apache-2.0
"""tools/studies on data that are drawn here: how deviations counts errors and fits factors, the surfaces of
short_bones, and the errors of motions."""
import contextlib
import importlib.machinery
import importlib.util
import io
import random
import re
import unittest

import numpy as np
from scipy.spatial.transform import Rotation

from harness import SOURCE


def tool(name):
    loader = importlib.machinery.SourceFileLoader(name, str(SOURCE / "tools/studies" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


DEVIATIONS, MOTIONS, SHORT_BONES = tool("deviations"), tool("motions"), tool("short_bones")
# How many times larger than predicted the deviation of the errors is.
TRUE_FACTORS = {"first": [2, 1, 0.5, 1, 1.5, 3], "final": [1, 0.7, 1.2, 4, 0.25, 1]}


def rows(count):
    chance = random.Random(1)
    made = []
    for i in range(count):
        row = {}
        for stage, factors in TRUE_FACTORS.items():
            row["errors.distal.%s.mtre_mm" % stage] = 0.1
            for axis, factor in zip(DEVIATIONS.AXES, factors):
                predicted = chance.uniform(0.01, 0.1)
                row["errors.distal.%s.predicted_%s" % (stage, axis)] = predicted
                row["errors.distal.%s.%s" % (stage, axis)] = chance.gauss(0, predicted * factor)
        made.append(row)
    return made


def printed(call, *arguments):
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream):
        call(*arguments)
    return stream.getvalue()


class Deviations(unittest.TestCase):
    def test_the_factors_are_those_of_the_errors(self):
        text = printed(DEVIATIONS.print_factors, rows(4000))
        found = {
            name: list(map(float, re.findall(r"[\d.]+", numbers)))
            for name, numbers in re.findall(r"(\w+): \[(.*)\]", text)
        }
        self.assertEqual(list(found), list(DEVIATIONS.FACTORS))
        wanted = [TRUE_FACTORS["first"][:3], TRUE_FACTORS["first"][3:], TRUE_FACTORS["final"][:3]]
        for (name, factors), true in zip(found.items(), [*wanted, TRUE_FACTORS["final"][3:]]):
            for got, expected in zip(factors, true):
                self.assertAlmostEqual(got / expected, 1, delta=0.06, msg=name)

    def test_shares_within_one_and_two_deviations(self):
        text = printed(DEVIATIONS.print_stage, rows(4000), "first")
        shares = [tuple(map(int, pair)) for pair in re.findall(r"(\d+) %\s+(\d+) %", text)]
        # Twice, as, half as large as predicted, and so on: of the normal distribution.
        expected = [(38, 68), (68, 95), (95, 100), (68, 95), (50, 82), (26, 50)]
        self.assertEqual(len(shares), len(expected))
        for got, wanted in zip(shares, expected):
            self.assertLessEqual(max(abs(a - b) for a, b in zip(got, wanted)), 3, text)

    def test_factors_are_judged_on_poses_that_they_were_not_fitted_to(self):
        chance = random.Random(2)
        ratios = [abs(chance.gauss(0, 3)) for _ in range(2000)]
        for got, wanted in zip(DEVIATIONS.shares_of_others(ratios), (0.683, 0.954)):
            self.assertAlmostEqual(got, wanted, delta=0.03)
        # One half is five times larger than the other half. Judged by the factor of the other half, all of the
        # small errors lie within one deviation and none of the large ones within two.
        halves = [5 * ratio if i % 2 else ratio for i, ratio in enumerate([1, 1.1, 0.9, 1.2] * 10)]
        self.assertEqual(DEVIATIONS.shares_of_others(halves, 2), [0.5, 0.5])

    def test_the_shares_of_others_are_printed_with_a_fit(self):
        self.assertNotIn("by factors of others", printed(DEVIATIONS.print_stage, rows(200), "first"))
        text = printed(DEVIATIONS.print_stage, rows(1000), "first", True)
        shares = re.findall(r"(\d+) %, +(\d+) %$", text, re.M)
        self.assertEqual(len(shares), 6)
        for one, two in shares:
            self.assertLess(abs(int(one) - 68) + abs(int(two) - 95), 9, text)

    def test_a_pose_that_is_wrong_is_left_out(self):
        some = rows(20)
        some[3]["errors.distal.first.mtre_mm"] = 2.5
        self.assertIn("contour: 19 poses, 1 left out", printed(DEVIATIONS.print_stage, some, "first"))

    def test_poses_of_a_search_without_stages(self):
        row = {"errors.bone.mtre_mm": 0.1}
        for i, axis in enumerate(DEVIATIONS.AXES):  # the errors are 0.5, 1.5 and 2.5 deviations
            row.update({"errors.bone." + axis: 0.5 + i % 3, "errors.bone.predicted_" + axis: 1.0})
        text = printed(DEVIATIONS.print_stage, [row], "")
        shares = re.findall(r"(\d+) % +(\d+) %", text)
        self.assertEqual(shares, [("100", "100"), ("0", "100"), ("0", "0")] * 2)
        self.assertEqual(printed(DEVIATIONS.print_stage, [row], "final"), "")


class Motions(unittest.TestCase):
    def test_errors_are_about_the_turned_axis_whatever_way_the_platform_stands(self):
        turned = lambda axis, deg: Rotation.from_euler(axis, deg, degrees=True)
        told = {"r%s%+d" % (axis, deg): turned(axis, deg) for axis in "xyz" for deg in (-9, -4, 5, 8)}
        stands, neutral = Rotation.from_rotvec([0.4, -0.7, 1.1]), Rotation.from_rotvec([0.2, 0.3, -0.1])
        seen = {**told, "rz+5": turned("z", 5.5), "rx-9": turned("x", -20)}
        found = {name: (stands * turn * stands.inv() * neutral).as_matrix() for name, turn in seen.items()}
        del found["ry+8"]
        poses = lambda turns: {"neutral": np.eye(3), **{name: turn.as_matrix() for name, turn in turns.items()}}
        errors = MOTIONS.errors_of({**found, "neutral": neutral.as_matrix()}, poses(told))
        np.testing.assert_allclose(errors["x"], [-11, 0, 0, 0], atol=1e-6)
        np.testing.assert_allclose(errors["y"], [0, 0, 0, np.nan], atol=1e-6)
        np.testing.assert_allclose(errors["z"], [0, 0, 0.5, 0], atol=1e-6)


class ShortBones(unittest.TestCase):
    def test_a_surface_is_closed_looks_outward_and_differs_by_seed(self):
        lengths = []
        for seed in range(5):
            faces = SHORT_BONES.triangles(SHORT_BONES.short_bone(np.random.default_rng(seed)))
            corners = [[tuple(np.round(c, 6)) for c in face] for face in faces]
            corners = [face for face in corners if len(set(face)) == 3]
            edges = [(face[i], face[(i + 1) % 3]) for face in corners for i in range(3)]
            self.assertEqual(len(set(edges)), len(edges))  # each edge once in each sense
            self.assertTrue(all((b, a) in set(edges) for a, b in edges[:: len(edges) // 50]))
            volume = np.einsum("ij,ij->i", faces[:, 0], np.cross(faces[:, 1], faces[:, 2])).sum() / 6
            self.assertGreater(volume, 1000)
            lengths.append(np.ptp(faces[:, :, 2]))
        self.assertTrue(all(45 <= length <= 75 for length in lengths), "as long as a metacarpal: %s" % lengths)
        self.assertEqual(len(set(lengths)), 5)


if __name__ == "__main__":
    unittest.main()
