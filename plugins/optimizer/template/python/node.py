# SPDX-License-Identifier: Apache-2.0
"""A simplex of n + 1 points that moves downhill: Nelder and Mead, with the factors of Gao and Han (2012) for many
variables."""
import marrow
import numpy as np


@marrow.optimizer(
    "optimizer.new_node",
    summary="Downhill simplex (Nelder and Mead, Computer Journal 1965), in Python",
    traits=["needs_start"],
)
def new_node(problem: marrow.Problem) -> str:
    count = len(problem.start)
    points = first_simplex(problem)
    values = problem(points)  # all of them in one batch
    while True:
        order = np.argsort(values, kind="stable")
        points, values = points[order], values[order]
        if (np.ptp(points, axis=0) <= problem.step_tolerance * problem.initial_step).all():
            return "the simplex is smaller than the tolerance"
        middle = points[:-1].mean(axis=0)

        def at(factor: float) -> np.ndarray:
            """A point on the line from the worst point through the middle of the others: -1 is the worst."""
            return np.clip(middle + factor * (middle - points[-1]), problem.lower, problem.upper)

        new = at(1)
        value = problem(new)
        if value < values[0]:
            further = at(1 + 2 / count)
            value_further = problem(further)
            if value_further < value:
                new, value = further, value_further
        elif value >= values[-2]:
            near = at((0.75 - 0.5 / count) * (1 if value < values[-1] else -1))
            value_near = problem(near)
            if value_near < min(value, values[-1]):
                new, value = near, value_near
            elif value >= values[-1]:
                points[1:] = points[0] + shrinkage(count) * (points[1:] - points[0])
                values[1:] = problem(points[1:])
                continue
        points[-1], values[-1] = new, value


def first_simplex(problem: marrow.Problem) -> np.ndarray:
    """The start, and one step from it along each coordinate: backward where forward is out of bounds."""
    steps = np.diag(problem.initial_step)
    forward = problem.start + steps
    is_out = (forward > problem.upper).any(axis=1)
    forward[is_out] = np.maximum(problem.start - steps, problem.lower)[is_out]
    return np.vstack([problem.start, forward])


def shrinkage(count: int) -> float:
    return 1 - 1 / count if count > 1 else 0.5
