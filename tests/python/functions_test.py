# SPDX-License-Identifier: Apache-2.0
"""Functions that nodes make, called from Python: costs, optimizers and projectors."""
import itertools
import threading
import time

import numpy
from written_nodes import NEAR, Written, camera, view
from harness.package import interrupt, main, marrow, small_case

_made = {}


def contour():
    """The cost of a small case by contour, its projector and the true pose."""
    if not _made:
        _, case = small_case()
        truth = case.truth["distal"].matrix
        bone = marrow.segment.threshold(case.ct, case.seeds)["distal"]
        model = marrow.mesh.marching_cubes(bone)
        outline = marrow.project.silhouette_edges(model=model, volume=case.ct)
        edges = marrow.edges.canny(case.views)
        cost = marrow.similarity.contour_distance(projector=outline, views=case.views, edges=edges)
        _made["all"] = (cost, outline, truth, case.views)
    return _made["all"]


def moved(matrix, by_mm):
    """The pose, shifted along the axes of the model."""
    shifted = numpy.array(matrix)
    shifted[:3, 3] += shifted[:3, :3] @ by_mm
    return shifted


def ball(radius_mm=20):
    z, y, x = numpy.mgrid[-32:32, -32:32, -32:32] + 0.5
    inside = numpy.sqrt(x**2 + y**2 + z**2) < radius_mm
    values = numpy.where(inside, 0, -1000).astype("float32")
    return marrow.Volume(values, spacing_mm=(1, 1, 1), origin_mm=(-31.5, -31.5, -31.5))


class Costs(Written):
    def test_a_cost_says_what_it_says_in_a_pipeline(self):
        cost, _, truth, _ = contour()
        self.assertEqual((type(cost), cost.type, repr(cost)), (marrow.Cost, "cost", "<marrow cost>"))
        pose = marrow.Pose(truth)
        profiles = marrow.evaluate.landscape(cost, pose, profile_points=5).profiles
        for axis, profile in enumerate(profiles[3:]):
            shifts = [offset * pose.axes[:, axis] for offset in profile.offsets]
            poses = numpy.array([moved(truth, shift) for shift in shifts])
            costs = cost(poses)
            self.assertEqual(costs.shape, (5,))
            self.assertLess(numpy.abs(costs - profile.costs).max(), 1e-12)
            self.assertGreater(costs.max(), costs[2] + 0.01, "the truth is in the middle")

    def test_poses_may_come_in_several_shapes(self):
        cost, _, truth, _ = contour()
        off = moved(truth, [3, 0, 0])
        both = cost(numpy.array([truth, off]))
        self.assertEqual(both.tolist(), cost([marrow.Pose(truth), off]).tolist())
        self.assertEqual(both.tolist(), cost({"a": truth, "b": marrow.Pose(off)}).tolist())
        self.assertEqual(both.tolist(), [cost(truth), cost(marrow.Pose(off))])
        self.assertIsInstance(cost(truth), float)
        self.assertEqual(cost(truth.tolist()), both[0])
        self.assertEqual(cost([]).shape, (0,))
        many = cost(numpy.array([truth, off] * 20))
        self.assertEqual(many.tolist(), both.tolist() * 20)

    def test_what_is_no_pose_is_refused(self):
        cost, _, truth, _ = contour()
        self.refuses(
            ("pose: expected 4 x 4 numbers, got 3 x 3", lambda: cost(numpy.eye(3))),
            ("pose 2: the last row of the matrix must be 0 0 0 1", lambda: cost([truth, 2 * numpy.eye(4)])),
            ("pose", lambda: cost(numpy.diag([2.0, 1, 1, 1]))),
        )

    def test_a_cost_goes_on_to_another_node_and_outlives_its_inputs(self):
        cost = marrow.similarity.normalised_cross_correlation(marrow.project.joseph(ball()), [view()])
        self.assertEqual(cost(numpy.eye(4)), cost(numpy.eye(4)))
        self.assertEqual(len(marrow.evaluate.landscape(cost, marrow.Pose(numpy.eye(4)), profile_points=3).profiles), 6)

    def test_errors_and_ctrl_c_of_a_cost(self):
        self.plugin(NEAR)
        with self.assertRaisesRegex(marrow.Error, "the bowl is broken; take another one"):
            marrow.similarity.near(does="raise")(numpy.eye(4))
        cost = marrow.similarity.near(does="tenth")
        poses = numpy.tile(numpy.eye(4), (32000, 1, 1))  # would take 200 s
        interrupt(self, lambda: cost(poses))

    def test_other_threads_go_on_while_a_cost_is_computed(self):
        self.plugin(NEAR)
        cost = marrow.similarity.near(does="tenth")
        ended = threading.Event()
        thread = threading.Thread(target=lambda: (cost(numpy.tile(numpy.eye(4), (320, 1, 1))), ended.set()))
        thread.start()
        turns = 0
        while not ended.is_set():
            time.sleep(0.01)
            turns += 1
        thread.join()
        self.assertGreater(turns, 5)  # where the cost holds the others up, one or two


class Optimizers(Written):
    def test_it_finds_the_least_of_a_function(self):
        asked = []

        def bowl(x):
            asked.append(x)
            return (x[0] - 1) ** 2 + 2 * (x[1] + 2) ** 2 + 3

        found = marrow.optimizer.nelder_mead().minimise(bowl, [0, 0], [0.5, 0.5], max_evaluations=300)
        self.assertLess(numpy.abs(found.x - [1, -2]).max(), 1e-3)
        self.assertAlmostEqual(found.value, 3, delta=1e-5)
        self.assertEqual(found.evaluations, len(asked))
        self.assertTrue(found.stopped_because)
        self.assertRegex(repr(found), "<marrow.Minimum 3.* after %d evaluations>" % len(asked))

    def test_limits(self):
        optimizer = marrow.optimizer.nelder_mead()
        found = optimizer.minimise(lambda x: x @ x, [2, 2], [1, 1], lower=[0.5, -9], upper=[3, 9])
        self.assertLess(numpy.abs(found.x - [0.5, 0]).max(), 1e-3)
        self.assertEqual(optimizer.minimise(lambda x: x @ x, [2, 2], [1, 1], max_evaluations=7).evaluations, 7)

    def test_it_finds_the_least_cost(self):
        cost, _, truth, _ = contour()
        off = moved(truth, [1, -1, 1])
        found = marrow.optimizer.nelder_mead().minimise(lambda x: cost(moved(off, x)), [0, 0, 0], [1, 1, 1])
        self.assertEqual(found.value, cost(moved(off, found.x)))
        self.assertLess(found.value, cost(off))
        self.assertLess(numpy.abs(found.x - [-1, 1, -1]).max(), 0.6)

    def test_what_the_function_raises_is_raised(self):
        def broken(x):
            raise ValueError("no value here")

        optimizer = marrow.optimizer.nelder_mead()
        with self.assertRaisesRegex(ValueError, "no value here"):
            optimizer.minimise(broken, [0], [1])
        with self.assertRaisesRegex(TypeError, "must be real number, not str"):
            optimizer.minimise(lambda x: "much", [0], [1])
        with self.assertRaisesRegex(marrow.Error, "one positive initial step per coordinate"):
            optimizer.minimise(lambda x: 0, [0, 0], [1])
        falls = itertools.count(0, -1)  # so that it does not end by itself
        interrupt(self, lambda: optimizer.minimise(lambda x: time.sleep(0.1) or next(falls), [0], [1]))


class Projectors(Written):
    def test_a_radiograph_of_a_ball_is_as_thick_as_the_ball(self):
        projector = marrow.project.joseph(ball())
        seen = projector(camera(), numpy.eye(4))
        self.assertEqual((type(projector), seen.shape, seen.dtype), (marrow.RadiographProjector, (96, 128), "float32"))
        self.assertAlmostEqual(seen[47:49, 63:65].mean(), 40, delta=0.8)
        self.assertEqual(seen[0, 0], 0)
        every_fourth = projector(camera(), marrow.Pose(numpy.eye(4)), step_px=4)
        self.assertEqual(every_fourth.shape, (24, 32))
        self.assertLess(numpy.abs(every_fourth - seen[::4, ::4]).max(), 4.5)  # steep at the border
        self.refuses(
            ("step_px: expected a positive number, got 0.0", lambda: projector(camera(), numpy.eye(4), step_px=0)),
            ("camera: expected a marrow.Camera or a marrow.View", lambda: projector(3, numpy.eye(4))),
        )

    def test_an_outline_lies_where_the_surface_is_seen(self):
        _, outline, truth, views = contour()
        seen_by = views["lateral"]
        points = outline(seen_by, truth, spacing_px=2)
        self.assertEqual((type(outline), points.shape[1]), (marrow.OutlineProjector, 7))
        self.assertGreater(len(points), 50)
        self.assertLess(numpy.abs(numpy.hypot(points[:, 2], points[:, 3]) - 1).max(), 1e-3)
        at = truth @ numpy.column_stack([points[:, 4:], numpy.ones(len(points))]).T
        u, v, depth = seen_by.camera.intrinsics @ (seen_by.camera.camera_from_world @ at)[:3]
        self.assertLess(numpy.abs(points[:, 0] - u / depth).max(), 0.1)
        self.assertLess(numpy.abs(points[:, 1] - v / depth).max(), 0.1)
        self.assertGreater(len(outline(seen_by.camera, truth)), 1.5 * len(points))


if __name__ == "__main__":
    main()
