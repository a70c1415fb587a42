# SPDX-License-Identifier: Apache-2.0
"""Values are copied, pickled, shown in a line, saved and loaded; transforms know their inverse."""
import copy
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
        classes = [
            one for one in vars(core).values() if isinstance(one, type) and isinstance(getattr(one, "type", 0), str)
        ]
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


if __name__ == "__main__":
    main()
