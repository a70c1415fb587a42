# SPDX-License-Identifier: Apache-2.0
"""The training for a user's own surface: its points, shadows and images, whose truth is known, and its smallest case
up to the nodes that use what it exports."""
import json
import unittest
import unittest.mock

import network_cases  # skips where a package is missing
import numpy as np
import shadows
import surface
import surface_images
import surface_points


def box(size_mm, at_mm=(0, 0, 0)):
    """Vertices and triangles of a closed box, normals outward."""
    corners = np.array([[(i >> k & 1) - 0.5 for k in range(3)] for i in range(8)]) * size_mm + at_mm
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def write_stl(file, corners, triangles):
    lines = ["solid box"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex %g %g %g" % tuple(corners[i]) for i in triangle] + ["endloop", "endfacet"]
    file.write_text("\n".join(lines + ["endsolid box"]) + "\n")


class Points(unittest.TestCase):
    def test_the_farthest_come_first(self):
        line = np.array([[x, 0, 0] for x in (0, 1, 2, 3, 10)], float)
        chosen = surface_points.farthest(line, 4)
        self.assertEqual(chosen[:, 0].tolist(), [10, 0, 3, 1])

    def test_an_uneven_part_is_not_symmetric(self):
        vertices = np.array([[0, 0, 0], [60, 0, 0], [0, 35, 0], [0, 0, 20]], float)
        triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        points, is_symmetric = surface_points.points_of(vertices, triangles, 6)
        self.assertFalse(is_symmetric)
        self.assertEqual(list(points), ["p1", "p2", "p3", "p4", "p5", "p6"])

    def test_points_of_a_symmetric_part_lie_in_its_plane(self):
        points, is_symmetric = surface_points.points_of(*box([60, 30, 20]), 8)
        self.assertTrue(is_symmetric)
        spread = np.ptp(np.array(list(points.values())), axis=0)
        self.assertLess(spread.min(), 1.5)  # the middle of 60000 random points is not exactly the box's
        self.assertGreater(np.sort(spread)[1], 15)


def volume_of(corners, triangles):
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


class Holes(unittest.TestCase):
    def test_a_closed_surface_stays_as_it_is(self):
        corners, triangles = box([60, 30, 20])
        same_corners, same_triangles, holes = surface_points.closed(corners, triangles)
        self.assertEqual(holes, 0)
        self.assertIs(same_corners, corners)
        self.assertIs(same_triangles, triangles)

    def test_flat_holes_are_closed_to_the_same_volume(self):
        with unittest.mock.patch.object(surface_points, "LARGEST_HOLE", 1):
            corners, triangles = box([60, 30, 20], (5, -7, 9))
            for missing, count in (([0, 1], 1), ([3], 1), ([0, 3], 2)):  # a face, a triangle, triangles of two faces
                *result, holes = surface_points.closed(corners, np.delete(triangles, missing, axis=0))
                self.assertEqual(holes, count)
                self.assertAlmostEqual(volume_of(*result), 60 * 30 * 20)

    def test_a_large_hole_is_refused(self):
        corners, triangles = box([60, 30, 20])
        with self.assertRaisesRegex(SystemExit, "a hole of 60.0 mm; close it, or give a closed surface"):
            surface_points.closed(corners, triangles[2:])

    def test_a_border_that_is_no_ring_is_refused(self):
        fin = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])
        with self.assertRaisesRegex(SystemExit, "a border that is no ring"):
            surface_points.closed(np.eye(5, 3), fin)


class Shadows(unittest.TestCase):
    def test_chords_of_a_box_and_its_points(self):
        package = shadows.marrow()
        corners, triangles = box([40, 30, 20], (5, -7, 9))
        mesh = package.Mesh(corners, triangles)
        seen = shadows.shadows_of(mesh, corners, ([np.eye(3)], [800.0]), 0.5)
        chords = seen.chords_mm[0].astype(float)
        middle = 0.5 * (np.array(chords.shape) - 1)
        v, u = np.nonzero(chords > 10)
        self.assertAlmostEqual(float(chords[tuple(middle.astype(int))]), 20, delta=0.3)
        # The near side, 790 mm away, is 40 mm wide and 30 mm high: 81.0 by 60.8 pixels.
        self.assertAlmostEqual(np.ptp(u) + 1, 81.0, delta=1.5)
        self.assertAlmostEqual(np.ptp(v) + 1, 60.8, delta=1.5)
        near = seen.points_px[0][corners[:, 2] < 9]
        self.assertAlmostEqual(np.ptp(near[:, 0]), 40 / 0.5 * 800 / 790, places=3)
        np.testing.assert_allclose(near.mean(axis=0), middle, atol=1e-3)

    def test_rotations_are_rotations_and_stay_in_their_range(self):
        random = np.random.default_rng(1)
        for deg in (20, 180):
            turns = [shadows.turned_by(random, deg) for _ in range(50)]
            for turn in turns:
                np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
                self.assertGreater(np.linalg.det(turn), 0)
            angles = [np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))) for turn in turns]
            self.assertLessEqual(max(angles), deg + 1e-6)
            self.assertGreater(max(angles), 0.8 * deg)


def sources():
    """A disc of metal with a point at its middle, before nothing."""
    v, u = np.mgrid[:41, :41]
    chords = np.where(np.hypot(u - 20, v - 20) < 15, 10, 0).astype(np.float16)
    disc = shadows.Shadows(chords[None], np.array([[[20, 20]]], np.float32))
    return surface_images.Sources(disc, np.zeros((0, 8, 8), np.float16), [], "metal")


class Images(unittest.TestCase):
    def test_mask_points_and_image_agree(self):
        with_part = darker = 0
        for seed in range(30):
            one = surface_images.picture(np.random.default_rng(seed), sources(), 96, 1.5)
            self.assertTrue(np.all((one.grey >= 0) & (one.grey <= 1)))
            if not one.mask.any():
                continue
            with_part += 1
            v, u = np.nonzero(one.mask)
            if min(v.min(), u.min()) > 0 and max(v.max(), u.max()) < 95 and len(v) > 400:
                np.testing.assert_allclose([u.mean(), v.mean()], one.points_px[0], atol=3)
            darker += np.median(one.grey[one.mask > 0]) < np.median(one.grey[one.mask == 0])
        self.assertGreater(with_part, 20)
        self.assertGreater(darker, 0.6 * with_part)

    def test_the_same_seed_gives_the_same_image(self):
        a, b = (surface_images.picture(np.random.default_rng(5), sources(), 96, 1.5) for _ in range(2))
        np.testing.assert_array_equal(a.grey, b.grey)

    def test_a_heat_map_is_high_where_the_point_is(self):
        maps = surface.heat_maps(np.array([[20.5, 60.5], [-1000, 5]], np.float32))
        self.assertEqual(np.unravel_index(maps[0].argmax(), maps[0].shape), (30, 10))
        self.assertAlmostEqual(float(maps[0].max()), 1, places=5)
        self.assertLess(maps[1].max(), 1e-6)


class SmallestTraining(network_cases.InAFolder):
    def test_a_wedge_ends_as_a_network_that_the_nodes_read(self):
        folder = self.folder
        corners, triangles = box([60, 40, 20])
        corners[4:, 0] *= 0.3  # a wedge
        write_stl(folder / "wedge.stl", corners, triangles)
        words = ["--data", folder / "data", "--out", folder / "out", "--steps", 2, "--shadows", 16]
        done = network_cases.train("surface", folder / "wedge.stl", *words, "--anatomies", 1, "--points", 5)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        figures = json.loads((folder / "out/figures.json").read_text())
        self.assertEqual(len(figures["losses"]), 2)
        self.assertIn("points_median_mm", figures["judgement"])
        package = shadows.marrow()
        camera = package.Camera(200, 220, [[900, 0, 99.5], [0, 900, 109.5], [0, 0, 1]], np.eye(4))
        grey = np.random.default_rng(1).integers(0, 60000, (220, 200)).astype("uint16")
        view = package.View(grey, camera, name="front")
        masked = package.mask.network(
            view, network=folder / "out/wedge.yaml", leave_out=["background"], object_distance_mm=900, margin_px=0
        )
        self.assertEqual(np.asarray(masked.mask).shape, (220, 200))
        points = package.read.landmarks(path=folder / "out/wedge-points.yaml", fragment="part")
        self.assertEqual(list(points["part"].points_mm), ["p1", "p2", "p3", "p4", "p5"])


if __name__ == "__main__":
    unittest.main()
