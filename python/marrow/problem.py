# SPDX-License-Identifier: Apache-2.0
"""What an optimizer written in Python gets: a function of n numbers, where to begin, and how far it may go."""
from typing import Any, Callable

import numpy

from . import _core
from .errors import Error


class BudgetSpent(Exception):
    """No more values may be asked for. An optimizer lets it pass: the best point so far is the result."""


class Problem:
    """A function of n numbers to minimise. problem(points) gives the values of an array of points [N, n], or of one
    point [n]. A point out of bounds, or whose value is not finite, has the value inf. `best` is the best point so far,
    and `least` its value: they are the result.

    One that you make yourself, for tests, calls your function with arrays [N, n]."""

    def __init__(
        self,
        function: Callable[[Any], Any],
        start: Any,
        initial_step: Any,
        *,
        lower: Any = None,
        upper: Any = None,
        max_evaluations: int = 1000,
        step_tolerance: float = 1e-4
    ) -> None:
        self._function = function
        self.start = _numbers(start, "start")
        """Where to begin [n]."""
        self.initial_step = _numbers(initial_step, "initial_step")
        """A positive number for each coordinate [n]: how far the first steps should go."""
        self.lower = _bound(lower, -numpy.inf, len(self.start))
        """The least value of each coordinate [n]; -inf where there is none."""
        self.upper = _bound(upper, numpy.inf, len(self.start))
        """The greatest value of each coordinate [n]; inf where there is none."""
        self.max_evaluations = int(max_evaluations)
        """How many values may be asked for."""
        self.step_tolerance = float("nan" if step_tolerance is None else step_tolerance)
        """It is time to end when steps are shorter than this fraction of initial_step."""
        self.evaluations = 0
        """How many values were asked for."""
        self.best = self.start
        self.least = numpy.inf
        self._check()

    @property
    def left(self) -> int:
        """How many values may still be asked for."""
        return self.max_evaluations - self.evaluations

    def __call__(self, points: Any) -> Any:
        """Raises BudgetSpent if there are more points than values left; as many as are left are asked for first."""
        asked = _numbers(points, "points")
        size = len(self.start)
        if asked.ndim not in (1, 2) or asked.shape[-1] != size:
            got = shape_text(asked)
            raise Error("expected points of %d numbers, [N, %d] or [%d], got %s" % (size, size, size, got))
        rows = asked.reshape(-1, size)
        if not numpy.isfinite(rows).all():
            raise Error("the optimizer asked for the value of a point that is not finite")
        values = numpy.full(len(rows), numpy.inf)
        within = numpy.flatnonzero(((rows >= self.lower) & (rows <= self.upper)).all(axis=1))
        chosen = within[: max(self.left, 0)]
        if len(chosen):
            values[chosen] = self._values(rows[chosen])
        if len(chosen) < len(within):
            raise BudgetSpent("the budget of %d evaluations is spent" % self.max_evaluations)
        return values if asked.ndim == 2 else float(values[0])

    def _values(self, points: Any) -> Any:
        values = _numbers(self._function(points), "values of the function")
        if values.shape != (len(points),):
            raise Error("the function gave %s for %d points" % (shape_text(values), len(points)))
        self.evaluations += len(points)
        values[~numpy.isfinite(values)] = numpy.inf
        least = int(values.argmin())
        if values[least] < self.least:
            self.best, self.least = points[least].copy(), float(values[least])
        return values

    def _check(self) -> None:
        size = self.start.shape
        if size == (0,):
            raise Error("the optimizer got a start without coordinates; it needs one at least")
        good = len(size) == 1 and self.initial_step.shape == size and bool((self.initial_step > 0).all())
        if not (good and numpy.isfinite(self.start).all() and numpy.isfinite(self.initial_step).all()):
            raise Error("the optimizer needs a finite start and one positive initial step per coordinate")
        if ((self.lower > self.start) | (self.upper < self.start)).any():
            raise Error("the optimizer's start lies outside the bounds")
        if self.max_evaluations < 1:
            raise Error("the optimizer needs at least one evaluation, got max_evaluations = %d" % self.max_evaluations)
        if not 0 < self.step_tolerance < numpy.inf:
            raise Error("the optimizer needs a positive, finite step_tolerance, got %g" % self.step_tolerance)


def shape_text(array: Any) -> str:
    """The shape of an array in words."""
    return " x ".join(map(str, array.shape)) or "one number"


def _numbers(given: Any, what: str) -> Any:
    """A copy as an array of numbers. Raises Error if a number would get lost."""
    return numpy.array(_core.array_of_real(given, "float64", "the optimizer: " + what))


def _bound(given: Any, none: float, size: int) -> Any:
    """The bound of each coordinate. None, nothing and NaN stand for no bound."""
    bound = _numbers([numpy.nan if one is None else one for one in ([] if given is None else given)], "bounds")
    if bound.shape not in ((0,), (size,)):
        raise Error("the optimizer got bounds for %d of %d coordinates" % (bound.size, size))
    return numpy.where(numpy.isnan(bound), none, bound) if len(bound) else numpy.full(size, none)
