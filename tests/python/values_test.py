# SPDX-License-Identifier: Apache-2.0
"""Values are copied, pickled, shown in a line, saved and loaded; transforms know their inverse."""
import copy
import gc
import importlib.util
import multiprocessing
import os
import pickle
import re
import unittest

import numpy
from all_values import MESH, TURN, values
from harness.package import SOURCE, PackageCase, main, marrow

HAS_MATPLOTLIB = importlib.util.find_spec("matplotlib") is not None


def digest_of(value):
    return marrow._core.digest_of(value)


class Values(PackageCase):
    def test_each_value_in_a_line(self):
        for line, value in values().items():
            self.assertEqual(repr(value), line)

    def test_landmarks_as_views_show_them(self):
        landmarks = marrow.Landmarks({"tip": (1, 2, 3)}, {"ap": {"tip": (4, 5)}, "lateral": {"tip": (6, 7, 1.5)}})
        seen = landmarks.seen_px
        self.assertEqual({view: list(seen[view]["tip"]) for view in seen}, {"ap": [4, 5, 0], "lateral": [6, 7, 1.5]})
        again = marrow.Landmarks(landmarks.points_mm, seen)
        self.assertEqual(digest_of(again), digest_of(landmarks))
        negative = lambda: marrow.Landmarks({"tip": (1, 2, 3)}, {"ap": {"tip": (4, 5, -1)}})
        self.refuses(("^landmark 'tip' as seen: its deviation must be positive, or 0", negative))

    def test_what_runs_make_in_a_line(self):
        self.assertRegex(repr(self.case), r"^<marrow.Case of a CT of \d+ x \d+ x \d+, 2 views, 2 fragments>$")
        self.assertRegex(repr(self.case.truth["distal"]), r"^<marrow.Truth world_from_ct, translation \(.*\) mm>$")
        core = marrow._core
        classes = [c for c in vars(core).values() if isinstance(c, type) and isinstance(getattr(c, "type", 0), str)]
        self.assertGreater(len(classes), 18)
        for one in classes:
            self.assertIsNot(one.__repr__, object.__repr__, one)

    def test_copies_are_the_value_itself(self):
        """Nobody can change a value."""
        for value in values().values():
            self.assertIs(copy.copy(value), value)
            self.assertIs(copy.deepcopy([value])[0], value)
        adder = marrow.test.adder(marrow.test.constant(value=1))
        self.assertIs(copy.deepcopy(adder), adder)

    def test_pickled_values_are_the_same(self):
        case = self.case
        for value in [*values().values(), case, case.truth["distal"]]:
            again = pickle.loads(pickle.dumps(value))
            self.assertIs(type(again), type(value))
            self.assertEqual(digest_of(again), digest_of(value))
        views = pickle.loads(pickle.dumps(case.views))
        self.assertEqual((views.axis, list(views)), ("view", list(case.views)))
        numpy.testing.assert_array_equal(views["lateral"].image.array, case.views["lateral"].image.array)

    def test_they_reach_other_processes(self):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            for value in (values()["<marrow.Pose world_from_ct, translation (1, 2, 3) mm>"], self.case.ct):
                self.assertEqual(pool.apply(digest_of, (value,)), digest_of(value))

    def test_what_cannot_be_pickled(self):
        adder = marrow.test.adder(marrow.test.constant(value=1))
        own = marrow.write.obj(values()[MESH])
        self.refuses(
            ("type 'adder' cannot be pickled, because it is a function; make it", lambda: pickle.dumps(adder)),
            ("its type is a plugin's own; marrow.save writes it to a file", lambda: pickle.dumps(own)),
        )

    def test_a_verdict_that_cannot_be(self):
        self.assertIsNone(marrow.Verdict("wrong").failure_probability)
        beyond = lambda: marrow.Verdict("wrong", failure_probability=1.5)
        self.refuses(
            ("^Verdict: expected 'trusted', 'doubtful' or 'wrong', got 'good'$", lambda: marrow.Verdict("good")),
            ("^Verdict: expected a failure_probability from 0 to 1, got 1.5$", beyond),
        )

    def test_damaged_pickles_are_refused(self):
        function, (name, version, size, packed) = marrow.Pose(TURN).__reduce__()
        self.refuses(
            ("was pickled by another version of marrow", lambda: function(name, version + 1, size, packed)),
            ("was pickled by another version of marrow", lambda: function(name, version, size + 8, packed)),
            (".", lambda: function(name, version, size, packed[:-3])),
            ("values of type 'pse' are not known in Python", lambda: function("pse", version, size, packed)),
        )

    def test_the_version(self):
        version = re.search(r"project\(marrow VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
        self.assertEqual(marrow.__version__, version)


class Transforms(PackageCase):
    def test_the_inverse(self):
        found = marrow.Pose(TURN).transform
        self.assertEqual((found.target, found.source), ("world", "ct"))
        back = found.inverse()
        self.assertEqual(repr(back), "<marrow.Transform ct_from_world, translation (-2, 1, -3) mm>")
        numpy.testing.assert_allclose(back.matrix, numpy.linalg.inv(TURN), atol=1e-15)
        whole = back @ found
        self.assertEqual((whole.target, whole.source), ("ct", "ct"))
        numpy.testing.assert_allclose(whole.matrix, numpy.eye(4), atol=1e-15)

    def test_points(self):
        transform = marrow.Transform(TURN)
        numpy.testing.assert_array_equal(transform @ [1, 0, 0], [1, 3, 3])
        points = numpy.arange(24.0).reshape(2, 4, 3)
        numpy.testing.assert_allclose(transform @ points, points @ TURN[:3, :3].T + TURN[:3, 3])

    def test_what_is_no_transform_or_no_points_and_frames_that_do_not_fit(self):
        transform = marrow.Transform(TURN)
        self.refuses(
            (r"points: expected an array \[..., 3\] of x, y, z in mm, got the shape", lambda: transform @ [[1, 2]]),
            ("world.*ct|ct.*world", lambda: transform @ transform),
            ("Transform", lambda: marrow.Transform(2 * TURN)),
        )

    def test_copies(self):
        transform = marrow.Transform(TURN, target="robot", source="world")
        again = pickle.loads(pickle.dumps(transform))
        self.assertEqual((again.target, again.source), ("robot", "world"))
        numpy.testing.assert_array_equal(again.matrix, TURN)
        self.assertIs(copy.deepcopy(transform), transform)


class Files(PackageCase):
    def setUp(self):
        super().setUp()
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.scratch)

    def test_there_and_back(self):
        made = values()
        for line, name in (
            (MESH, "bone.ply"),
            ("<marrow.Volume 4 x 3 x 2, HU, spacing 0.8 x 0.8 x 1.5 mm, frame 'ct'>", "ct.mha"),
            ("<marrow.Image 4 x 3 px, uint16>", "image.png"),
            ("<marrow.Pose world_from_ct, translation (1, 2, 3) mm>", "start.yaml"),
            ("<marrow.Camera 4 x 3 px, focal length 1700 px>", "frontal.yaml"),
        ):
            file = marrow.save(made[line], name)
            self.assertEqual(str(file), name)
            again = marrow.load(file)
            self.assertEqual(repr(again), line)
            if name != "bone.ply":  # PLY has 32-bit numbers
                self.assertEqual(digest_of(again), digest_of(made[line]), name)
        seeds = marrow.load(marrow.save(made["<marrow.Seeds of distal: 2 points, mm>"], "seeds.yaml"))
        numpy.testing.assert_array_equal(seeds["distal"].points_mm, [[1, 2, 3], [4, 5, 6]])
        files = ["bone.ply", "ct.mha", "frontal.yaml", "image.png", "seeds.yaml", "start.yaml"]
        self.assertEqual(sorted(os.listdir()), files)

    def test_the_end_of_the_name(self):
        mesh = values()[MESH]
        self.assertEqual(str(marrow.save(mesh, "bone")), "bone.ply")
        said = "bone.stl: a value of the type mesh is written as .ply; the nodes of the kind write make"
        self.refuses((said, lambda: marrow.save(mesh, "bone.stl")))
        self.assertEqual(str(marrow.save(marrow.write.obj(mesh), "bone.obj")), "bone.obj")
        self.assertEqual(len(marrow.load("bone.obj").triangles), 4)

    def test_a_whole_case(self):
        marrow.save(self.case, "case")
        self.assertEqual(list(marrow.load("case").views), list(self.case.views))
        there = "case: it is there already; remove it, or name another place"
        self.refuses((there, lambda: marrow.save(self.case, "case")))

    def test_a_file_is_replaced_as_a_whole(self):
        marrow.save(marrow.Pose(TURN), "pose.yaml")
        marrow.save(marrow.Pose(numpy.eye(4)), "pose.yaml")
        numpy.testing.assert_array_equal(marrow.load("pose.yaml").matrix, numpy.eye(4))
        self.assertEqual(os.listdir(), ["pose.yaml"])

    def test_what_cannot_be_saved(self):
        adder = marrow.test.adder(marrow.test.constant(value=1))
        pose = marrow.Pose(TURN)
        self.refuses(
            ("save: expected a value of marrow, got int", lambda: marrow.save(5, "x")),
            ("save takes one value, got a list; save its items one by one", lambda: marrow.save([pose], "x")),
            ("adder", lambda: marrow.save(adder, "x")),
            ("nowhere: there is no such folder; make it first", lambda: marrow.save(pose, "nowhere/pose.yaml")),
        )
        self.assertEqual(os.listdir(), [])

    def test_what_cannot_be_loaded(self):
        self.write("notes.txt", "hello")
        unknown = "do not say what it holds; name the node that reads it, as reader='view'"
        self.refuses(
            ("none.ply: there is no such file", lambda: marrow.load("none.ply")),
            (unknown, lambda: marrow.load("notes.txt", None)),
            ("there is no node read.mehs; did you mean 'mesh'?", lambda: marrow.load("notes.txt", "mehs")),
        )

    def test_the_reader_may_be_named(self):
        marrow.save(values()[MESH], "bone.ply")
        self.assertEqual(len(marrow.load("bone.ply", "mesh").triangles), 4)


class Plots(PackageCase):
    @unittest.skipUnless(HAS_MATPLOTLIB, "matplotlib is missing: apt-get install python3-matplotlib")
    def test_a_landscape(self):
        import matplotlib

        matplotlib.use("agg")
        self.pipeline.set("landscape.in.truth", "case.truth")
        landscape = next(iter(self.pipeline.run(only=["profiles"])["profiles"].values()))
        self.assertEqual(repr(landscape), "<marrow.Landscape of 6 profiles>")
        figure = landscape.plot()
        for axes, profile in zip(figure.axes, landscape.profiles):
            line = axes.get_lines()[0]
            numpy.testing.assert_array_equal(line.get_xdata(), profile.offsets)
            numpy.testing.assert_array_equal(line.get_ydata(), profile.costs)
            self.assertEqual(axes.get_xlabel(), "%s / %s" % (profile.axis, profile.unit))
            truth = [one.get_xdata()[0] for one in axes.get_lines()[1:]]
            self.assertEqual(truth, [profile.truth] if profile.truth is not None else [])
        self.assertEqual(len(figure.axes), 6)
        figure.savefig(self.scratch / "landscape.png")
        self.assertIs(landscape.plot(matplotlib.pyplot.figure()).axes[0].get_ylabel(), "cost")

    @unittest.skipIf(HAS_MATPLOTLIB, "matplotlib is there")
    def test_without_matplotlib(self):
        missing = "plots need matplotlib, which is missing: apt-get install"
        self.refuses((missing, lambda: marrow.plots.plot_landscape(None)))


def address(array):
    return array.__array_interface__["data"][0]


class Arrays(PackageCase):
    """Without a copy, longer alive than their owner, never changed; and arrays as values."""

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
