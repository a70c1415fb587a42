# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in functions that nodes written in Python take: it costs one call, and is said clearly."""
import numpy
from harness.package import interrupt, main, marrow
from written_nodes import Written, processes

INNER = """
@marrow.cost("similarity.inner", summary="does what it is told")
def inner(*, does: Annotated[str, "what it does"] = "zeros"):
    import os, time
    def costs(poses):
        if does == "raise":
            raise marrow.Error("the views show no bone; take others")
        if does == "crash":
            os.abort()
        if does == "slow":
            time.sleep(5)
        if does == "tenth":
            time.sleep(0.1)
        return numpy.zeros(len(poses))
    return costs
"""
OUTER = """
import time
kept = []

@marrow.cost("similarity.outer", summary="uses another cost", seconds=4)
def outer(cost: marrow.Cost, *, does: Annotated[str, "what it does"] = "asks"):
    kept.append(cost)
    def costs(poses):
        if does == "flat":
            return cost(poses[:, :3, 3])
        if does == "few":
            return cost(poses[:1])
        if does == "other":
            return kept[0](poses)
        if does == "sleep":
            cost(poses)
            time.sleep(60)
        if does == "catch":
            try:
                cost(poses)
            except Exception:
                pass
        return cost(poses) + 1
    return costs

@marrow.optimizer("optimizer.handed", summary="hands the problem on")
def handed(problem: marrow.Problem, optimizer: marrow.Optimizer, *, does: Annotated[str, "what it does"] = "") -> str:
    if does == "own":
        optimizer.minimise(lambda x: 1 / 0, [0], [1])
    if does == "no start":
        optimizer.minimise(lambda x: x[0])
    return optimizer.minimise(problem).stopped_because
"""


class Faults(Written):
    def setUp(self):
        super().setUp()
        self.inner = self.plugin(INNER, "inner.py")
        self.outer = self.plugin(OUTER, "outer.py")

    def cost(self, inner="zeros", outer="asks"):
        return marrow.similarity.outer(marrow.similarity.inner(does=inner), does=outer)

    def value(self, *does):
        return self.cost(*does)(numpy.tile(numpy.eye(4), (2, 1, 1))).tolist()

    def test_what_may_go_wrong(self):
        self.assertEqual(self.value(), [1, 1])
        for inner, outer, text in (
            ("raise", "asks", "^the views show no bone; take others"),
            ("raise", "catch", "^the views show no bone; take others"),
            ("crash", "asks", r"^inner.py crashed its process \(Aborted\)"),
            ("zeros", "flat", "^pose: expected 4 x 4 numbers, got 2 x 3"),
            ("zeros", "few", "^similarity.outer: expected 2 costs, got 1"),
            ("zeros", "sleep", r"^outer.py took longer than 4 s, and .* give it more in @marrow.cost\(..., seconds"),
        ):
            with self.subTest(inner=inner, outer=outer), self.assertRaisesRegex(marrow.Error, text):
                self.value(inner, outer)
        self.assertEqual(self.value(), [1, 1], "the next call works")

    def test_the_time_of_the_inner_function_does_not_count(self):
        self.assertEqual(self.value("slow"), [1, 1])

    def test_ctrl_c(self):
        cost = self.cost("tenth")
        interrupt(self, lambda: cost(numpy.tile(numpy.eye(4), (16000, 1, 1))))  # a batch has 16 poses

    def test_a_function_of_an_earlier_call_is_refused(self):
        self.assertEqual(self.value("zeros", "other"), [0, 0])
        with self.assertRaisesRegex(marrow.Error, "it used a function that an earlier call was given; use only the in"):
            self.value("slow", "other")

    def test_what_the_minimised_function_raises(self):
        def broken(x):
            raise ValueError("no value here")

        optimizer = marrow.optimizer.handed(marrow.optimizer.nelder_mead())
        with self.assertRaisesRegex(ValueError, "no value here"):
            optimizer.minimise(broken, [0], [1])
        self.assertEqual(processes(self.outer), [])
        self.assertLess(abs(optimizer.minimise(lambda x: float(x[0] ** 2), [1], [1]).x[0]), 1e-2)

    def test_what_its_own_function_raises(self):
        for does, text in (
            ("own", "outer.py, line [0-9]+, in <lambda>: ZeroDivisionError: division by zero"),
            ("no start", "the optimizer got a start without coordinates; it needs one at least"),
        ):
            optimizer = marrow.optimizer.handed(marrow.optimizer.nelder_mead(), does=does)
            with self.subTest(does), self.assertRaisesRegex(marrow.Error, text):
                optimizer.minimise(lambda x: float(x[0] ** 2), [0], [1])


if __name__ == "__main__":
    main()
