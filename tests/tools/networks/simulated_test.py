# SPDX-License-Identifier: Apache-2.0
"""Simulated cases: what is drawn, and whether images, labels, borders, cameras and surfaces agree."""
import contextlib
import io
import pathlib
import tempfile
import unittest
import unittest.mock

import network_cases
import numpy as np
import cv2
import simulated


class Drawing(unittest.TestCase):
    def test_anatomies_of_the_parts_and_of_experiments_differ(self):
        parts = [set(seeds) for seeds in simulated.SEEDS.values()] + [set(range(1, 51))]
        self.assertEqual(len(set().union(*parts)), sum(map(len, parts)))

    def test_depends_on_the_seed_alone(self):
        one, again, other = (simulated.settings_of("femur", seed, 2, 64) for seed in (1000, 1000, 1001))
        self.assertEqual(one, again)
        self.assertNotEqual(one, other)

    def test_half_of_the_metal_is_off(self):
        drawn = [simulated.settings_of("femur", seed, 2, 64)[0] for seed in range(1000, 1400)]
        for name in ("pin", "plate", "clamp", "cable", "table"):
            off = np.mean([one["clutter." + name] == "off" for one in drawn])
            self.assertTrue(0.45 < off < 0.65, (name, off))


class Case(unittest.TestCase):
    """One small case of each bone, made with marrow."""

    def case(self, kind, seed=1003, size_px=128):
        with tempfile.TemporaryDirectory() as data, contextlib.redirect_stderr(io.StringIO()):
            simulated.make_cases(data, kind, [seed], views=2, size_px=size_px, surfaces=True)
            case = simulated.read_case(data, kind, seed)
            vertices = {fragment.name: fragment.vertices_mm() for fragment in case.fragments}
        return case, vertices

    def check(self, case, vertices):
        self.assertEqual([view.name for view in case.views], ["v0", "v1"])
        for view in case.views:
            self.assertEqual(view.grey.shape, (128, 128))
            self.assertEqual(view.classes.shape, (128, 128))
            self.assertLess(view.classes.max(), len(simulated.CLASSES))
            np.testing.assert_allclose(view.project([[0, 0, 0]]), [[63.5, 63.5]], atol=1e-6)
            bone = (view.classes == 1) | (view.classes == 2)  # metal may hide it
            shown = cv2.dilate((view.classes > 0).astype(np.uint8), np.ones((3, 3), np.uint8))
            # The projected surface covers the bone of the fragments, and borders lie beside pixels that are not bone.
            for fragment in case.fragments:
                world = vertices[fragment.name] @ fragment.world_from_model[:3, :3].T + fragment.world_from_model[:3, 3]
                at = np.rint(view.project(world)).astype(int)
                at = at[((at >= 0) & (at < 128)).all(axis=1)]
                if len(at) > 100:  # one of a broken bone may be out of view
                    self.assertGreater(np.mean(shown[at[:, 1], at[:, 0]]), 0.99)
            at = view.borders_px.astype(int)
            self.assertTrue((view.classes[at[:, 1], at[:, 0]] < 2).all())
            near = cv2.dilate(bone.astype(np.uint8), np.ones((3, 3), np.uint8))
            self.assertTrue(near[at[:, 1], at[:, 0]].all())
        self.assertGreater(sum(len(view.borders_px) for view in case.views), 50)

    def test_broken_femur(self):
        case, vertices = self.case("femur")
        self.assertEqual([fragment.name for fragment in case.fragments], ["distal", "proximal"])
        self.check(case, vertices)

    def test_vertebra(self):
        case, vertices = self.case("vertebra")
        self.assertEqual([fragment.name for fragment in case.fragments], ["bone"])
        self.check(case, vertices)


class Messages(unittest.TestCase):
    def test_a_build_is_needed(self):
        with unittest.mock.patch.object(simulated, "ROOT", pathlib.Path("/nowhere")):
            with self.assertRaisesRegex(SystemExit, "^train: build marrow first, with tools/setup$"):
                simulated.make_case(pathlib.Path("/nowhere/1"), "femur", 1)

    def test_a_simulation_that_fails_is_named(self):
        drawn = ({"bone.uses": "simulate.femur", "bone.no_such_option": 1}, "off")
        with tempfile.TemporaryDirectory() as data, unittest.mock.patch.object(
            simulated, "settings_of", lambda *_: drawn
        ):
            with self.assertRaisesRegex(SystemExit, "simulation of femur, seed 7, failed:\n.*no_such_option"):
                simulated.make_case(pathlib.Path(data) / "7", "femur", 7)


if __name__ == "__main__":
    unittest.main()
