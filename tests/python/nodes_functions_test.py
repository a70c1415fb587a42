# SPDX-License-Identifier: Apache-2.0
"""Nodes written in Python that take functions: costs and optimizers, of C++ and of Python, and decorators of them."""
import numpy
from harness.package import main, marrow, small_case
from written_nodes import Written, view

NODES = """
import os
import threading
import time


@marrow.cost("similarity.bowl", summary="squares about a place")
def bowl(*, place_mm: Annotated[float, "where the least is"] = 3, sleep_s: Annotated[float, "of each batch"] = 0,
         fails: Annotated[bool, "whether it fails"] = False):
    def costs(poses):
        time.sleep(sleep_s)
        if fails:
            raise marrow.Error("the bowl is broken; take another one")
        return numpy.square(poses[:, :3, 3] - place_mm).sum(axis=1) + numpy.square(poses[:, 0, 1]) * 1000

    return costs


@marrow.cost("similarity.line", summary="another cost, times a factor, and an offset", seconds=4)
def line(cost: marrow.Cost, other: Optional[marrow.Cost] = None, *,
         factor: Annotated[float, "factor"] = 1, offset: Annotated[float, "offset"] = 0):
    def costs(poses):
        return factor * cost(poses) + offset + (0 if other is None else other(poses))

    return costs


@marrow.optimizer("optimizer.thrice", summary="another optimizer, from three starts", traits=["needs_start"])
def thrice(problem: marrow.Problem, optimizer: marrow.Optimizer, *, left: Annotated[int, "evaluations of each"] = 200,
           apart: Annotated[float, "steps between the starts; 0: each starts where the last one ended"] = 0,
           does: Annotated[str, "what it does"] = "all") -> str:
    if does == "exit":
        optimizer.minimise(lambda x: os._exit(3), problem.start, problem.initial_step)
    if does == "together":
        def work():
            optimizer.minimise(lambda x: time.sleep(0.05) or 1.0, problem.start, problem.initial_step)
        threads = [threading.Thread(target=work) for _ in range(2)]
        for one in threads:
            one.start()
        for one in threads:
            one.join()
    for side in (0, -apart, apart):
        start = (problem.start if apart else problem.best) + side * problem.initial_step
        optimizer.minimise(problem, start, problem.initial_step, max_evaluations=left)
    return "all three starts were tried"


class Found(NamedTuple):
    pose: marrow.Pose
    stages: Annotated[marrow.Items[marrow.Pose], marrow.over("stage")]


@marrow.node("register.own", summary="moves the start along its axes")
def register_own(cost: marrow.Cost, optimizer: marrow.Optimizer, start: marrow.Pose, *,
                 by: Annotated[str, "which way"] = "own") -> Found:
    if by == "multiresolution":
        return Found(*marrow.register.multiresolution(cost=cost, optimizer=optimizer, start=start))

    def moved(x):
        matrix = numpy.array(start.matrix)
        matrix[:3, 3] += x
        return matrix

    found = optimizer.minimise(lambda x: cost(moved(x)), numpy.zeros(3), numpy.ones(3))
    pose = marrow.Pose(moved(found.x))
    return Found(pose, {"final": pose})


@marrow.node("own.sum", summary="the sum of some costs at the identity")
def total(costs: Annotated[marrow.Items[marrow.Cost], marrow.over("item")]) -> Annotated[
    marrow.Metrics, marrow.named("sum"), marrow.figures("value")
]:
    return marrow.Metrics({"value": sum(cost(numpy.eye(4)) for cost in costs.values())})
"""


def moved(*translation_mm):
    matrix = numpy.eye(4)
    matrix[:3, 3] = translation_mm
    return matrix


POSES = [moved(0, 0, 0), moved(1, 2, 3), moved(-2, 0.5, 7)]
START = marrow.Pose(numpy.eye(4))


class Functions(Written):
    def setUp(self):
        super().setUp()
        self.plugin(NODES)

    def test_a_decorator_of_a_cost(self):
        inner = marrow.similarity.bowl(place_mm=2)
        outer = marrow.similarity.line(inner, factor=3, offset=1)
        self.assertLess(numpy.abs(outer(POSES) - 3 * inner(POSES) - 1).max(), 1e-12)
        self.assertEqual(inner(POSES[1]), 1 + 0 + 1)
        twice = marrow.similarity.line(outer, marrow.similarity.bowl(place_mm=0), factor=2)
        self.assertLess(abs(twice(POSES[1]) - (2 * (3 * 2 + 1) + 14)), 1e-12)
        self.assertIn("similarity.line", self.program("list", "similarity"))

    def test_a_list_of_costs(self):
        costs = {"a": marrow.similarity.bowl(place_mm=1), "b": marrow.similarity.bowl(place_mm=2)}
        self.assertEqual(marrow.own.sum(costs)["value"], 3 + 12)

    def test_a_registration_asks_a_cost_and_an_optimizer(self):
        cost, optimizer = marrow.similarity.bowl(place_mm=3), marrow.optimizer.nelder_mead()
        found = marrow.register.own(cost, optimizer, START).pose
        self.assertLess(numpy.abs(found.matrix[:3, 3] - 3).max(), 0.01)

    def test_a_node_in_cpp_that_it_calls_asks_them_too(self):
        cost, optimizer = marrow.similarity.bowl(place_mm=3), marrow.optimizer.nelder_mead()
        inside = marrow.register.own(cost, optimizer, START, by="multiresolution").pose
        outside = marrow.register.multiresolution(cost=cost, optimizer=optimizer, start=START).pose
        self.assertEqual(inside.matrix.tolist(), outside.matrix.tolist())

    def test_a_decorator_of_an_optimizer(self):
        def two_wells(x):  # the deeper one is to the right
            return float(min((x[0] + 1) ** 2 + 1, 4 * (x[0] - 5) ** 2) + x[1] ** 2)

        inner = marrow.optimizer.nelder_mead()
        alone = inner.minimise(two_wells, [-1.5, 1], [1, 1])
        self.assertLess(abs(alone.x[0] + 1), 0.01)
        decorated = marrow.optimizer.thrice(inner, apart=8).minimise(two_wells, [-1.5, 1], [1, 1])
        self.assertLess(numpy.abs(decorated.x - [5, 0]).max(), 0.01)
        self.assertEqual(decorated.stopped_because, "all three starts were tried")
        self.assertGreater(decorated.evaluations, 2 * alone.evaluations)

    def test_the_budget_ends_an_inner_minimisation(self):
        optimizer = marrow.optimizer.thrice(marrow.optimizer.nelder_mead())
        found = optimizer.minimise(lambda x: float((x**2).sum()), [3.0, 1.0], [1, 1], max_evaluations=25)
        self.assertEqual((found.evaluations, found.stopped_because), (25, "the budget of 25 evaluations is spent"))

    def test_both_in_python(self):
        cost = marrow.similarity.line(marrow.similarity.bowl(place_mm=-2), offset=5)
        optimizer = marrow.optimizer.thrice(marrow.optimizer.nelder_mead())
        found = marrow.register.own(cost, optimizer, START).pose
        self.assertLess(numpy.abs(found.matrix[:3, 3] + 2).max(), 0.01)

    def test_a_cost_that_changes_nothing_registers_alike(self):
        """Levels, blocks of the images and so the predicted deviations are those of the cost inside."""
        case = marrow.read.case(path=str(small_case()[0]))
        bone = marrow.segment.threshold(case.ct, case.seeds)["distal"]
        drr = marrow.project.siddon_jacobs(volume=case.ct, field=bone)  # no derivatives, which Python does not get
        plain = marrow.similarity.gradient_correlation(projector=drr, views=case.views)
        optimizer = marrow.optimizer.nelder_mead()
        start = marrow.Pose(case.truth["distal"].matrix)
        arguments = {"optimizer": optimizer, "start": start, "pixel_step": [16, 8, 8], "scan_rotation_deg": 0}
        found = [
            marrow.register.multiresolution(cost=cost, **arguments).pose
            for cost in (plain, marrow.similarity.line(plain))
        ]
        self.assertEqual(found[0].matrix.tolist(), found[1].matrix.tolist())
        self.assertIsNotNone(found[0].covariance)
        self.assertLess(numpy.abs(found[0].covariance / found[1].covariance - 1).max(), 1e-6)

    def test_results_are_kept_by_what_made_the_function(self):
        def made(**options):
            told = []
            node = marrow.own.sum.using(keep=True, progress=told.append)
            node({"a": marrow.similarity.bowl(**options)})
            return any(event["event"] == "started" and event["node"] == "sum" for event in told)

        made(place_mm=1)
        self.assertFalse(made(place_mm=1))
        self.assertTrue(made(place_mm=2))

    def test_what_the_function_inside_does_wrong_is_said(self):
        cost = marrow.similarity.line(marrow.similarity.bowl(fails=True))
        with self.assertRaisesRegex(marrow.Error, "the bowl is broken; take another one"):
            cost(POSES)

    def test_the_time_of_the_function_inside_does_not_count(self):
        cost = marrow.similarity.line(marrow.similarity.bowl(sleep_s=5))
        self.assertEqual(cost(POSES[0]), 27)

    def test_a_process_that_ends_while_it_is_asked(self):
        optimizer = marrow.optimizer.thrice(marrow.optimizer.nelder_mead(), does="exit")
        with self.assertRaisesRegex(marrow.Error, "mine.py ended its process"):
            optimizer.minimise(lambda x: 0.0, [0.0], [1.0])

    def test_two_minimisations_at_once(self):
        optimizer = marrow.optimizer.thrice(marrow.optimizer.nelder_mead(), does="together")
        with self.assertRaisesRegex(marrow.Error, "two minimisations at the same time; run one after the other"):
            optimizer.minimise(lambda x: 0.0, [0.0], [1.0])

    def test_it_is_checked_as_any_other(self):
        told = self.program("conformance", "optimizer.thrice", "--in", "optimizer=optimizer.nelder_mead")
        self.assertIn("passed", told)


if __name__ == "__main__":
    main()
