# SPDX-License-Identifier: Apache-2.0
"""Functions that nodes written in Python make, in the process that holds the nodes."""
from typing import Any, Callable, Dict, List

import numpy

from . import _core
from .declaration import Declaration
from .errors import Error
from .problem import BudgetSpent, Problem, shape_text

_MOST = 8  # functions that are kept; others are made again


class Functions:
    """The functions that were made, by their numbers."""

    def __init__(self) -> None:
        self._made: Dict[int, Any] = {}

    def get(self, number: int, node: Declaration, make: Callable[[], Any]) -> Any:
        if number not in self._made:
            made = make()
            while len(self._made) >= _MOST:
                self._made.pop(next(iter(self._made)))
            self._made[number] = _checked(node, made)
        return self._made[number]


def _checked(node: Declaration, made: Any) -> Any:
    name = node.manifest["name"]
    if node.makes == "cost":
        if not callable(made):
            raise Error("%s: expected a function from poses to costs, got %s" % (name, type(made).__name__))
        return made
    if not isinstance(made, tuple) or len(made) != 2 or not callable(made[0]):
        raise Error("%s: expected a function that draws, and the corners of a box about the model" % name)
    corners = _core.array_of_real(made[1], "float64", "%s: corners of the box" % name)
    if corners.ndim != 2 or corners.shape[1] != 3 or not len(corners) or not numpy.isfinite(corners).all():
        raise Error("%s: the corners of the box must be an array [N, 3] of finite numbers, in mm" % name)
    return made[0], corners


def said_of(node: Declaration, made: Any) -> Dict[str, Any]:
    """What marrow must know of a function besides its values."""
    return {} if node.makes == "cost" else {"corners_mm": made[1].ravel().tolist()}


class Instead:
    """The value that one of the costs among a node's inputs has at a pose without a part of the images."""

    def __init__(self, request: Dict[str, Any]) -> None:
        self.input = request["input"]
        self.pose = numpy.array(request["poses"])
        self.value = 0.0

    def reply(self, question: Dict[str, Any], ask: Callable[[Dict[str, Any]], Any]) -> Any:
        """The reply to a question about a function, with this value at this pose."""
        if question.get("function") != self.input or question["do"] != "values" or "changes" in question:
            return ask(question)
        poses = numpy.reshape(question["poses"], (-1, 12))
        here = numpy.isclose(poses, self.pose, rtol=0, atol=1e-9).all(axis=1)
        if here.all():
            return [self.value] * len(here)
        return [self.value if at else value for at, value in zip(here, ask(question))]


def costs_instead(node: Declaration, cost: Any, request: Dict[str, Any], instead: Instead) -> List[float]:
    """The costs of one pose with each of the values of `request` in turn."""
    values = []
    for instead.value in request["instead"]:
        values += costs(node, cost, request)
    return values


def costs(node: Declaration, cost: Any, request: Dict[str, Any]) -> List[float]:
    """The costs of a batch of poses."""
    name = node.manifest["name"]
    poses = _transforms(request["poses"])
    values = _core.array_of_real(cost(poses), "float64", "%s: costs" % name)
    if values.shape != (len(poses),):
        raise Error("%s: expected %d costs, got %s" % (name, len(poses), shape_text(values)))
    if not numpy.isfinite(values).all():
        raise Error("%s: a cost is not finite; give the worst value where nothing can be compared" % name)
    listed: List[float] = values.tolist()
    return listed


def radiograph(node: Declaration, made: Any, request: Dict[str, Any]) -> Any:
    """The values of the pixels, as an image of one row."""
    camera = request["camera"]
    seen_by = _core.Camera(
        camera["width_px"],
        camera["height_px"],
        numpy.reshape(camera["intrinsics"], (3, 3)),
        _transforms(camera["camera_from_world"])[0],
    )
    pixels = _pixels(request)
    name = node.manifest["name"]
    drawn = made[0](seen_by, _transforms(request["pose"])[0], pixels)
    values = _core.array_of_real(drawn, "float32", "%s: values of the pixels" % name)
    if values.shape != (len(pixels),):
        raise Error("%s: expected the values of %d pixels, got %s" % (name, len(pixels), shape_text(values)))
    if not numpy.isfinite(values).all() or (values < 0).any():
        raise Error("%s: a value of the radiograph is below 0 or not finite; give 0 where the model is missed" % name)
    return _core.Image(values[None])


def minimum(node: Declaration, arguments: Dict[str, Any], request: Dict[str, Any], ask: Callable[[Any], Any]) -> str:
    """Minimises. Returns why it ended; the best point is known to who answers `ask`."""
    name = node.manifest["name"]
    limits = {key: request[key] for key in ("lower", "upper", "max_evaluations", "step_tolerance")}
    problem = Problem(ask, request["start"], request["initial_step"], **limits)
    try:
        reason = node.function(**{**arguments, str(node.problem): problem})
    except BudgetSpent as spent:
        reason = str(spent)
    if not problem.evaluations:
        raise Error("%s: it asked for no value of the function; call problem(points)" % name)
    if not numpy.isfinite(problem.least):
        raise Error(
            "the optimizer found no least value: the function is not finite at any of the %d points that were tried"
            % problem.evaluations
        )
    if not isinstance(reason, str) or not reason:
        raise Error("%s: it returned %r; return in words why it ended" % (name, reason))
    return reason


def _transforms(numbers: Any) -> Any:
    """4 x 4 matrices from 12 numbers each."""
    matrices = numpy.zeros((len(numbers) // 12, 4, 4))
    matrices[:, :3] = numpy.reshape(numbers, (-1, 3, 4))
    matrices[:, 3, 3] = 1
    return matrices


def _pixels(request: Dict[str, Any]) -> Any:
    if "pixels" in request:
        return numpy.reshape(numpy.array(request["pixels"], float), (-1, 2))
    u_px, v_px, step_px = request["grid"]
    rows, columns = numpy.mgrid[0 : request["rows"], 0 : request["columns"]]
    return numpy.column_stack([u_px + step_px * columns.ravel(), v_px + step_px * rows.ravel()])
