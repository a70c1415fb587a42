# SPDX-License-Identifier: Apache-2.0
"""Optimizers written in Python: they run in a process, and ask back for the values of the function. Others take an
optimizer themselves."""
import os
import signal
import threading
import time

import numpy
from written_nodes import FunctionNodes, Written, processes
from harness.package import main, marrow

START = marrow.Pose(numpy.eye(4))


def bowl(x):
    return float((x[0] - 1) ** 2 + 2 * (x[1] + 2) ** 2 + 3)


def broken(x):
    raise ValueError("no value here")


class Optimizers(FunctionNodes):
    def minimise(self, function=bowl, does="steps", **limits):
        return marrow.optimizer.steps(does=does).minimise(function, [0, 0], [0.5, 0.5], **limits)

    def test_it_is_described_as_an_optimizer(self):
        info = marrow._core.node_info("optimizer.steps")
        self.assertEqual([(port["name"], port["type"]) for port in info["outputs"]], [("optimizer", "optimizer")])
        self.assertEqual([option["name"] for option in info["options"]], ["does"])
        self.assertEqual(info["inputs"], [])

    def test_it_finds_the_least(self):
        asked = []

        def noted(x):
            asked.append(tuple(x))
            return bowl(x)

        found = self.minimise(noted)
        self.assertLess(numpy.abs(found.x - [1, -2]).max(), 1e-3)
        self.assertEqual(found.value, bowl(found.x))
        self.assertEqual((found.evaluations, found.stopped_because), (len(asked), "the steps are short"))
        self.assertIn(tuple(found.x), asked, "a number is the same on both sides")
        self.assertEqual(asked[:3], [(0, 0), (0.5, 0), (0, 0.5)])

    def test_the_budget_ends_it(self):
        found = self.minimise(max_evaluations=7)
        self.assertEqual((found.evaluations, found.stopped_because), (7, "the budget of 7 evaluations is spent"))

    def test_bounds(self):
        asked = []
        found = self.minimise(lambda x: asked.append(x) or bowl(x), lower=[-5, -1], upper=[0.25, 5])
        self.assertLess(numpy.abs(found.x - [0.25, -1]).max(), 1e-3)
        self.assertGreaterEqual(numpy.array(asked)[:, 1].min(), -1)
        self.assertLessEqual(numpy.array(asked)[:, 0].max(), 0.25)

    def test_values_that_are_not_finite_are_the_worst(self):
        found = self.minimise(lambda x: numpy.nan if x[0] > 0.7 else bowl(x))
        self.assertLess(numpy.abs(found.x - [0.7, -2]).max(), 1e-3)

    def test_a_function_that_is_nowhere_finite_has_no_least_value(self):
        """By hand: the start, and in each of 14 rounds of halved steps four points around it (0.5^14 < 1e-4)."""
        text = "the optimizer found no least value: the function is not finite at any of the 57 points that were tried"
        self.refuses((text, lambda: self.minimise(lambda x: numpy.nan)))

    def test_a_problem_that_makes_no_sense(self):
        for tolerance, text in ((numpy.nan, "nan"), (numpy.inf, "nan"), (-1, "-1"), (0, "0")):
            said = "needs a positive, finite step_tolerance, got %s$" % text
            self.refuses((said, lambda: self.minimise(step_tolerance=tolerance)))
        nowhere = lambda: marrow.optimizer.steps().minimise(bowl, [], [])
        self.refuses(("the optimizer got a start without coordinates; it needs one", nowhere))

    def test_it_registers_with_a_cost(self):
        cost, optimizer = marrow.similarity.near(), marrow.optimizer.steps()
        found = marrow.register.multiresolution(cost=cost, optimizer=optimizer, start=START)
        self.assertLess(numpy.abs(found.pose.matrix[:3, 3] - 3).max(), 0.1)

    def test_what_the_function_raises_is_raised_and_the_next_call_works(self):
        with self.assertRaisesRegex(ValueError, "no value here"):
            self.minimise(lambda x: broken(x) if x[0] > 0 else bowl(x))
        self.assertEqual(self.minimise().stopped_because, "the steps are short")

    def test_an_optimizer_that_swallows_all_exceptions_is_ended(self):
        with self.assertRaisesRegex(ValueError, "no value here"):
            self.minimise(broken, does="swallow")
        self.assertEqual(processes(self.optimizers), [])

    def test_what_it_may_not_do(self):
        for does, text in (
            ("nothing", r"optimizer.steps: it asked for no value of the function; call problem\(points\)"),
            ("silent", "optimizer.steps: it returned None; return in words why it ended"),
            ("raise", "optimizers.py, line [0-9]+, in steps: ValueError: no way down"),
            ("nan", "the optimizer asked for the value of a point that is not finite"),
            ("other size", r"expected points of 2 numbers, \[N, 2\] or \[2\], got 1"),
            ("crash", r"optimizers.py crashed its process \(Aborted\)"),
        ):
            self.refuses((text, lambda: self.minimise(does=does)))
        few_steps = lambda: marrow.optimizer.steps().minimise(bowl, [0, 0], [1])
        self.refuses(("one positive initial step per coordinate", few_steps))

    def test_a_hang(self):
        self.optimizers_in(2)
        text = r"took longer than 2 s, and .* give it more in @marrow.optimizer\(..., seconds=...\)"
        self.refuses((text, lambda: self.minimise(does="hang")))

    def test_the_time_of_the_function_does_not_count(self):
        self.optimizers_in(5)
        asked = []

        def slow(x):
            asked.append(x)
            time.sleep(6 if len(asked) == 1 else 0)  # longer than the optimizer may take
            return bowl(x)

        self.assertEqual(self.minimise(slow).stopped_because, "the steps are short")

    def test_ctrl_c(self):
        begun = threading.Event()

        def interrupt():
            begun.wait()
            os.kill(os.getpid(), signal.SIGINT)

        threading.Thread(target=interrupt, daemon=True).start()
        with self.assertRaises(KeyboardInterrupt):
            self.minimise(lambda x: begun.set() or time.sleep(0.1) or bowl(x), does="endless")

    def test_threads_have_processes_of_their_own(self):
        optimizer = marrow.optimizer.steps()
        found = [None] * 3

        def work(i):
            found[i] = optimizer.minimise(bowl, [0, 0], [0.5, 0.5]).x.tolist()

        threads = [threading.Thread(target=work, args=(i,)) for i in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(found, [self.minimise().x.tolist()] * 3)

    def test_a_declaration_without_a_problem(self):
        self.plugin('@marrow.optimizer("optimizer.none", summary="none")\ndef none() -> str: ...\n', "none.py")
        self.assertIn(
            "optimizer.none: an optimizer, and nothing else, has a parameter 'problem: marrow.Problem'",
            self.program("doctor", code=1).replace("\n", " "),
        )


class Decorators(FunctionNodes):
    """Of another optimizer, which registrations take too."""

    def setUp(self):
        super().setUp()
        self.plain = marrow.optimizer.nelder_mead()

    def test_a_registration_asks_a_cost_and_an_optimizer(self):
        for cost, optimizer, place_mm in (
            (marrow.similarity.near(), self.plain, 3),
            (marrow.similarity.line(marrow.similarity.near(place_mm=-2), offset=5), None, -2),
        ):
            found = marrow.register.own(cost, optimizer or marrow.optimizer.thrice(self.plain), START).pose
            self.assertLess(numpy.abs(found.matrix[:3, 3] - place_mm).max(), 0.01)

    def test_a_node_in_cpp_that_it_calls_asks_them_too(self):
        cost = marrow.similarity.near()
        inside = marrow.register.own(cost, self.plain, START, by="multiresolution").pose
        outside = marrow.register.multiresolution(cost=cost, optimizer=self.plain, start=START).pose
        self.assertEqual(inside.matrix.tolist(), outside.matrix.tolist())

    def test_it_starts_elsewhere(self):
        def two_wells(x):  # the deeper one is to the right
            return float(min((x[0] + 1) ** 2 + 1, 4 * (x[0] - 5) ** 2) + x[1] ** 2)

        alone = self.plain.minimise(two_wells, [-1.5, 1], [1, 1])
        self.assertLess(abs(alone.x[0] + 1), 0.01)
        asked = []
        decorated = marrow.optimizer.thrice(self.plain, apart=8)
        found = decorated.minimise(lambda x: asked.append(x) or two_wells(x), [-1.5, 1], [1, 1])
        self.assertLess(numpy.abs(found.x - [5, 0]).max(), 0.01)
        self.assertIn("all three starts were tried; the last one: ", found.stopped_because)
        self.assertEqual((found.value, found.evaluations), (two_wells(found.x), len(asked)))
        self.assertGreater(found.evaluations, 2 * alone.evaluations)

    def test_the_budget_ends_an_inner_minimisation(self):
        thrice = marrow.optimizer.thrice(self.plain)
        found = thrice.minimise(lambda x: float((x**2).sum()), [3.0, 1.0], [1, 1], max_evaluations=25)
        self.assertEqual((found.evaluations, found.stopped_because), (25, "the budget of 25 evaluations is spent"))

    def test_a_problem_that_is_handed_on_is_the_same_problem(self):
        found = []
        for one in (self.plain, marrow.optimizer.thrice(self.plain, does="hand on")):
            for limits in ({}, {"max_evaluations": 30}, {"lower": [-5, -1], "upper": [0.25, 5]}):
                least = one.minimise(lambda x: float((x[0] - 1) ** 2 + (x[1] + 2) ** 2), [0, 0], [1, 1], **limits)
                found.append((least.x.tolist(), least.value))
        self.assertEqual(found[:3], found[3:])

    def test_what_the_minimised_function_raises(self):
        optimizer = marrow.optimizer.thrice(self.plain, does="hand on")
        with self.assertRaisesRegex(ValueError, "no value here"):
            optimizer.minimise(broken, [0], [1])
        self.assertEqual(processes(self.optimizers), [])
        self.assertLess(abs(optimizer.minimise(lambda x: float(x[0] ** 2), [1], [1]).x[0]), 1e-2)

    def test_what_it_may_not_do(self):
        for does, text in (
            ("own", "optimizers.py, line [0-9]+, in <lambda>: ZeroDivisionError: division by zero"),
            ("no start", "the optimizer got a start without coordinates; it needs one at least"),
            ("exit", "optimizers.py ended its process"),
            ("together", "two minimisations at the same time; run one after the other"),
        ):
            optimizer = marrow.optimizer.thrice(self.plain, does=does)
            self.refuses((text, lambda: optimizer.minimise(lambda x: float(x[0] ** 2), [0.0], [1.0])))

    def test_it_is_checked_as_any_other(self):
        told = self.program("conformance", "optimizer.thrice", "--in", "optimizer=optimizer.nelder_mead")
        self.assertIn("passed", told)


class Problems(Written):
    def test_it_can_be_made_for_tests(self):
        problem = marrow.Problem(lambda points: (points**2).sum(axis=1), [1, 2], [1, 1], max_evaluations=4)
        self.assertEqual(problem([1, 0]), 1)
        self.assertEqual(problem([[1, 1], [0, 2]]).tolist(), [2, 4])
        self.assertEqual((problem.best.tolist(), problem.least, problem.left), ([1, 0], 1, 1))
        self.assertEqual((problem.lower.tolist(), problem.upper.tolist()), ([-numpy.inf] * 2, [numpy.inf] * 2))
        with self.assertRaisesRegex(marrow.BudgetSpent, "the budget of 4 evaluations is spent"):
            problem([[0, 0], [3, 3]])
        self.assertEqual((problem.best.tolist(), problem.evaluations), ([0, 0], 4))

    def test_what_it_refuses(self):
        for arguments, limits, text in (
            (([1], [0]), {}, "one positive initial step per coordinate"),
            (([numpy.nan], [1]), {}, "one positive initial step per coordinate"),
            (([1], [1]), {"lower": [1, 2]}, "bounds for 2 of 1 coordinates"),
            (([1], [1]), {"upper": [0]}, "the optimizer's start lies outside the bounds"),
            (([1], [1]), {"max_evaluations": 0}, "at least one evaluation, got max_evaluations = 0"),
        ):
            self.refuses((text, lambda: marrow.Problem(lambda points: points[:, 0], *arguments, **limits)))
        wide = marrow.Problem(lambda points: points, [0], [1])
        self.refuses(("the function gave 2 x 1 for 2 points", lambda: wide([[0], [1]])))


if __name__ == "__main__":
    main()
