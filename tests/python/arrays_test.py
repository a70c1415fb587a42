# SPDX-License-Identifier: Apache-2.0
"""Values as numpy arrays: without a copy, longer alive than their owner, never changed; and arrays as values."""
import gc

import numpy
from harness.package import PackageCase, main, marrow


def address(array):
    return array.__array_interface__["data"][0]


class Arrays(PackageCase):
    def test_no_copy(self):
        case, mesh = self.case, marrow.mesh.marching_cubes(field_of_a_ball(20))
        edges = marrow.edges.canny(case.views["frontal"])
        owners = [
            (case.ct, "array"),
            (case.views["frontal"].image, "array"),
            (mesh, "vertices_mm"),
            (mesh, "triangles"),
            (edges, "pixels"),
        ]
        for owner, name in owners:
            one, other = getattr(owner, name), getattr(owner, name)
            self.assertEqual(address(one), address(other), name)
            self.assertGreater(one.size, 100)
            self.assertFalse(one.flags.owndata)
        self.assertEqual(address(numpy.asarray(case.ct)), address(case.ct.array))
        image = case.views["frontal"].image
        self.assertEqual(address(numpy.asarray(image)), address(image.array))
        self.assertEqual(address(image.array), address(image.array[0]))

    def test_arrays_outlive_their_owner(self):
        result = self.pipeline.run(only=["model", "edges"])
        mesh = result["model"]["distal"]
        arrays = [mesh.vertices_mm, mesh.triangles, result["edges"]["lateral"].pixels]
        case = marrow.read.case(path=self.folder)
        arrays.append(numpy.asarray(case.ct))
        copies = [array.copy() for array in arrays]
        del result, mesh, case
        gc.collect()
        rubbish = [numpy.full(array.shape, 7, array.dtype) for array in arrays for _ in range(3)]
        for array, copy in zip(arrays, copies):
            self.assertTrue(numpy.array_equal(array, copy))
        del rubbish

    def test_nobody_changes_a_value(self):
        ct, view = self.case.ct, self.case.views["frontal"]
        for array in (ct.array, view.image.array, numpy.asarray(ct)):
            with self.assertRaisesRegex(ValueError, "read-only"):
                array[0] = 0
        with self.assertRaises(AttributeError):
            view.name = "other"

    def test_a_volume_of_an_array(self):
        samples = numpy.arange(24, dtype="int16").reshape(2, 3, 4)
        volume = marrow.Volume(samples, spacing_mm=(1, 2, 3), origin_mm=(10, 20, 30))
        self.assertEqual((volume.size, volume.spacing_mm, volume.origin_mm), ((4, 3, 2), (1, 2, 3), (10, 20, 30)))
        self.assertTrue(numpy.array_equal(volume.array, samples))
        samples[:] = 0
        self.assertEqual(volume.array[1, 2, 3], 23)  # a copy
        self.assertTrue(numpy.array_equal(marrow.Volume(samples.T, spacing_mm=[1, 1, 1]).array, samples.T))
        of = lambda array, spacing_mm=(1, 1, 1): lambda: marrow.Volume(array, spacing_mm=spacing_mm)
        cube = numpy.zeros((2, 2, 2))
        self.refuses(
            ("Volume: expected an array of 3 axes, z, y and x, got 2 x 2", of(cube[0])),
            ("spacing_mm: expected 3 numbers, got 2", of(cube, (1, 1))),
            ("spacing", of(cube, (1, 1, 0))),
            ("Volume", of(cube * numpy.nan)),
            ("Volume: expected numbers, got str", of("air")),
        )

    def test_the_order_of_bytes_is_no_matter(self):
        for kind in ("u2", "f4"):
            for order in "<>":
                given = numpy.array([[1, 258]], order + kind)
                self.assertEqual(marrow.Image(given).array.tolist(), [[1, 258]])

    def test_arrays_of_which_something_would_get_lost(self):
        """What is lost is counted by hand: 2 of 8 values are masked, and 2**24 + 1 = 16777217 is the first whole number
        that has no 32-bit floating-point number (IEEE 754: 24 bits of significand)."""
        cube = numpy.zeros((2, 2, 2))
        masked = numpy.ma.masked_array(cube, mask=numpy.arange(8).reshape(2, 2, 2) < 2)
        large, exact = numpy.full((2, 2, 2), 2**24 + 1), numpy.full((2, 2, 2), 2**25)
        self.assertTrue(numpy.array_equal(marrow.Volume(exact, spacing_mm=(1, 1, 1)).array, exact))
        no_mask = numpy.ma.masked_array(cube, mask=False)
        self.assertEqual(marrow.Volume(no_mask, spacing_mm=(1, 1, 1)).size, (2, 2, 2))
        camera = marrow.Camera(2, 2, [[1000, 0, 1], [0, 1000, 1], [0, 0, 1]], numpy.eye(4))
        flat = numpy.ma.masked_array(numpy.ones((2, 2), "uint8"), mask=[[1, 0], [0, 0]])
        pose = numpy.ma.masked_array(numpy.eye(4), mask=numpy.eye(4) == 0)
        corners = numpy.ma.masked_array(numpy.eye(3), mask=numpy.eye(3) == 1)
        volume = lambda array: lambda: marrow.Volume(array, spacing_mm=(1, 1, 1))
        of = lambda make, *arguments, **more: lambda: make(*arguments, **more)
        self.refuses(
            ("2 of its values are masked", of(marrow.SignedField, masked, spacing_mm=(1, 1, 1))),
            ("^Volume: 2 of its values are masked, and a mask is not ", volume(masked)),
            ("^Volume: expected real numbers, got complex128, ", volume(cube + 1j)),
            ("^Volume: 16777217 cannot be held by a 32-bit floating", volume(large)),
            ("^Volume: a number is beyond what a 32-bit ", volume(cube + 1e300)),
            ("got an array of object; convert it with", volume(cube.astype(object))),
            ("^Image: 1 of its values is masked, and a mask is not kept; give array.filled", of(marrow.Image, flat)),
            ("^Image: expected real numbers, got complex128", of(marrow.Image, flat.filled(1) * 1j)),
            ("^image of the view: 1 of its values is masked", of(marrow.View, flat, camera)),
            ("^mask of the view: 1 of its values is masked", of(marrow.View, flat.filled(1), camera, mask=flat)),
            ("^Pose: 12 of its values are masked", of(marrow.Pose, pose)),
            ("^vertices_mm: 3 of its values are masked", of(marrow.Mesh, corners, [[0, 1, 2]])),
            ("^vertices_mm: 1 of its values is masked", of(marrow.Mesh, list(corners), [[0, 1, 2]])),
            ("^vertices_mm: expected real numbers, got complex128", of(marrow.Mesh, numpy.eye(3) * 1j, [[0, 1, 2]])),
            ("^landmark a: 1 of its values is masked", of(marrow.Landmarks, {"a": corners[0]})),
            ("^points_mm: 9007199254740993 cannot be held by a 64-bit ", of(marrow.Seeds, "a", [[2**53 + 1, 0, 0]])),
            ("^figure 'a': expected real numbers, got complex128", of(marrow.Metrics, {"a": 1j})),
            ("^figure 'a': 1 of its values is masked", of(marrow.Metrics, {"a": numpy.ma.masked})),
            ("^the optimizer: start: 2 of its values", of(marrow.Problem, lambda points: points, masked[0, 0], [1, 1])),
        )

    def test_images_and_views_of_arrays(self):
        for kind in ("uint8", "uint16", "float32"):
            pixels = numpy.arange(12).reshape(3, 4).astype(kind)
            image = marrow.Image(pixels[:, ::-1])
            self.assertEqual((image.width, image.height, image.array.dtype), (4, 3, kind))
            self.assertTrue(numpy.array_equal(image.array, pixels[:, ::-1]))
        self.assertEqual(marrow.Image(numpy.zeros((2, 2))).array.dtype, "float32")
        of = lambda *shape_and_kind: lambda: marrow.Image(numpy.zeros(*shape_and_kind))
        self.refuses(
            (r"got int64; convert them with array.astype\(...\)", of((2, 2), "int64")),
            ("expected an array of 2 axes, rows and columns, got 2 x 2 x 3", of((2, 2, 3), "uint8")),
        )
        camera = marrow.Camera(4, 3, [[1000, 0, 2], [0, 1000, 1.5], [0, 0, 1]], numpy.eye(4))
        view = marrow.View(pixels, camera, mask=pixels > 3, name="frontal")
        self.assertEqual((view.name, view.image.width, int(view.mask.sum())), ("frontal", 4, 8))
        self.refuses(("5 x 3", lambda: marrow.View(numpy.zeros((3, 5), "uint8"), camera)))

    def test_poses_and_meshes_of_arrays(self):
        matrix = numpy.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]], float)
        self.assertTrue(numpy.array_equal(marrow.Pose(matrix).matrix, matrix))
        self.refuses(
            ("last row", lambda: marrow.Pose(2 * numpy.eye(4))),
            ("Pose", lambda: marrow.Pose(numpy.diag([2, 1, 1, 1]))),
            ("Pose: expected 4 x 4 numbers, got 3 x 3", lambda: marrow.Pose(numpy.eye(3))),
        )
        corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        mesh = marrow.Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        self.assertEqual((mesh.vertices_mm.tolist(), mesh.triangles[3].tolist()), (corners, [1, 2, 3]))
        self.refuses(
            ("Mesh", lambda: marrow.Mesh(corners, [[0, 1, 4]])),
            ("triangles: expected indices of vertices, got 0.5", lambda: marrow.Mesh(corners, [[0, 1, 0.5]])),
        )


def field_of_a_ball(radius_mm):
    z, y, x = numpy.mgrid[-30:31, -30:31, -30:31]
    return marrow.SignedField(numpy.sqrt(x**2 + y**2 + z**2) - radius_mm, spacing_mm=(1, 1, 1))


if __name__ == "__main__":
    main()
