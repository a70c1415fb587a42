# SPDX-License-Identifier: Apache-2.0
"""What the tests of nodes written in Python share: a folder of plugins, small views, and a camera."""
import contextlib
import os
import pathlib
import subprocess

import numpy
from harness.package import MARROW, TEST_PLUGINS, Refusing, marrow

HEAD = """from typing import Annotated, NamedTuple, Optional
import marrow
import numpy
"""
VALUE_NODE = """
%s
@marrow.node("own.value", summary="a value")
def value(view: Annotated[marrow.View, "view"]) -> Annotated[marrow.Metrics, marrow.named("figures")]:
%s
    return marrow.Metrics({"value": VALUE})
"""


def view(seed=1, width_px=60, height_px=40):
    """A view of noise."""
    pixels = numpy.random.default_rng(seed).integers(0, 60000, (height_px, width_px)).astype("uint16")
    camera = marrow.Camera(width_px, height_px, [[1700, 0, 30], [0, 1700, 20], [0, 0, 1]], numpy.eye(4))
    return marrow.View(pixels, camera, name="frontal")


def camera():
    """A camera 600 mm from the origin of the world."""
    away = numpy.eye(4)
    away[2, 3] = 600
    return marrow.Camera(128, 96, [[1000, 0, 63.5], [0, 1000, 47.5], [0, 0, 1]], away)


def processes(file):
    """The numbers of the Python processes that hold the nodes of a file."""
    found = []
    for folder in pathlib.Path("/proc").iterdir():
        try:
            command = (folder / "cmdline").read_bytes().split(b"\0") if folder.name.isdigit() else []
        except OSError:  # it has just ended
            continue
        is_of_nodes = any(part.endswith(b"/node_process.py") for part in command)
        if is_of_nodes and os.fsencode(str(file)) in command:
            found.append(int(folder.name))
    return found


class Written(Refusing):
    """Each test has its own folder of plugins and cache of descriptions."""

    def setUp(self):
        super().setUp()
        self.plugins = self.scratch / "plugins"
        self.plugins.mkdir()
        os.environ["MARROW_PLUGIN_PATH"] = "%s:%s" % (self.plugins, TEST_PLUGINS)
        os.environ["XDG_CACHE_HOME"] = str(self.scratch / "cache")
        marrow.find_plugins_again()

    def tearDown(self):
        os.environ["MARROW_PLUGIN_PATH"] = str(TEST_PLUGINS)
        marrow.find_plugins_again()

    def plugin(self, text, name="mine.py"):
        """Writes a Python file with nodes, which is then found."""
        file = self.plugins / name
        file.write_text(HEAD + text)
        marrow.find_plugins_again()
        return file

    def node(self, at_import="", in_call=""):
        """A node that gives VALUE, which the code at the import of its file or in its call sets."""
        return self.plugin(VALUE_NODE % (at_import, "".join("    %s\n" % line for line in in_call.splitlines())))

    def module(self, place, text):
        file = self.scratch / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    @contextlib.contextmanager
    def with_variables(self, **variables):
        """These variables, of which None is not set, for this process and those that it starts."""
        before = dict(os.environ)
        for name, text in variables.items():
            os.environ.pop(name, None)
            if text is not None:
                os.environ[name] = str(text)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)

    def found(self):
        """The value of the node own.value, and whether it was made again."""
        told = []
        marrow.find_plugins_again()
        figures = marrow.own.value.using(keep=True, progress=told.append)(view())
        return figures["value"], any(event["event"] == "started" for event in told)

    def program(self, *arguments, code=0):
        """Runs marrow's program; returns what it printed."""
        done = subprocess.run([str(MARROW), *map(str, arguments)], capture_output=True, text=True, cwd=self.scratch)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr


NEAR = """
import os, time
made = []

@marrow.cost("similarity.near", summary="how far the model is from a place")
def near(
    views: Annotated[Optional[marrow.Items[marrow.View]], marrow.over("view")] = None,
    mesh: Optional[marrow.Mesh] = None,
    *,
    place_mm: Annotated[float, "where the least cost is, along each axis"] = 3,
    does: Annotated[str, "what it does"] = "squares",
):
    made.append(1)
    assert views is None or list(views) == ["frontal"]
    if does == "refuse":
        raise marrow.Error("the views show no bone; take others")

    def costs(poses):
        assert poses.shape[1:] == (4, 4) and (poses[:, 3] == [0, 0, 0, 1]).all()
        if does == "raise":
            raise marrow.Error("the bowl is broken; take another one")
        if does == "crash":
            os.abort()
        if does in ("few", "none"):
            return {"few": [1.0], "none": poses[:, 0, 0] * numpy.nan}[does]
        if does == "divide":
            return 1 / 0
        time.sleep({"slow": 5, "tenth": 0.1}.get(does, 0))
        turned = numpy.square(poses[:, :3, :3] - numpy.eye(3)).sum(axis=(1, 2))
        again = 1e6 * (len(made) - 1) if does == "count" else 0
        return numpy.square(poses[:, :3, 3] - place_mm).sum(axis=1) + 1000 * turned + again

    return costs
"""
DECORATORS = """
import time
kept = []

@marrow.cost("similarity.line", summary="another cost, times a factor, and an offset", seconds=4)
def line(cost: marrow.Cost, other: Optional[marrow.Cost] = None, *, factor: Annotated[float, "factor"] = 1,
         offset: Annotated[float, "offset"] = 0, does: Annotated[str, "what it does"] = "asks"):
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
        return factor * cost(poses) + offset + (0 if other is None else other(poses))

    return costs

@marrow.node("own.sum", summary="the sum of some costs at the identity")
def total(costs: Annotated[marrow.Items[marrow.Cost], marrow.over("item")]) -> Annotated[
    marrow.Metrics, marrow.named("sum"), marrow.figures("value")
]:
    return marrow.Metrics({"value": sum(cost(numpy.eye(4)) for cost in costs.values())})

@marrow.node("own.threads", summary="costs by several threads", seconds=60)
def threads(cost: marrow.Cost, *, fails: Annotated[bool, "whether it fails"] = False) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    import concurrent.futures

    def of(x):
        pose = numpy.eye(4)
        pose[0, 3] = x
        return cost(pose)

    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        figures = {str(i): found for i, found in enumerate(pool.map(of, range(50)))}
    if fails:
        raise marrow.Error("as told")
    return marrow.Metrics(figures)
"""
OPTIMIZERS = """
import os, threading, time

@marrow.optimizer("optimizer.steps", summary="steps along each axis", traits=["needs_start"], seconds=SECONDS)
def steps(problem: marrow.Problem, *, does: Annotated[str, "what it does"] = "steps") -> str:
    if does == "nothing":
        return "it is of no use"
    if does == "nan":
        problem(problem.start * numpy.nan)
    if does == "other size":
        problem([1.0])
    while does == "swallow":
        try:
            problem(problem.start)
        except Exception:
            pass
    problem(problem.start)
    if does == "silent":
        return None
    if does == "raise":
        raise ValueError("no way down")
    if does == "hang":
        time.sleep(1000)
    if does == "crash":
        os.abort()
    while does == "endless":
        problem(problem.start)
    step = problem.initial_step
    while (step > problem.step_tolerance * problem.initial_step).any():
        around = numpy.vstack([problem.best + numpy.diag(step), problem.best - numpy.diag(step)])
        before = problem.least
        problem(around)
        if problem.least >= before:
            step = step / 2
    return "the steps are short"

@marrow.optimizer("optimizer.thrice", summary="another optimizer, from three starts", traits=["needs_start"])
def thrice(problem: marrow.Problem, optimizer: marrow.Optimizer, *, left: Annotated[int, "evaluations of each"] = 200,
           apart: Annotated[float, "steps between the starts; 0: each starts where the last one ended"] = 0,
           does: Annotated[str, "what it does"] = "all") -> str:
    if does == "exit":
        optimizer.minimise(lambda x: os._exit(3), problem.start, problem.initial_step)
    if does == "hand on":
        return optimizer.minimise(problem).stopped_because
    if does == "own":
        optimizer.minimise(lambda x: 1 / 0, [0], [1])
    if does == "no start":
        optimizer.minimise(lambda x: x[0])
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
        of_its_own = [problem.initial_step] if side > 0 else []
        found = optimizer.minimise(problem, start, *of_its_own, max_evaluations=left)
    return "all three starts were tried; the last one: " + found.stopped_because

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
"""
PROJECTORS = """
@marrow.projector("project.ball", summary="the chords of a ball", seconds=5)
def ball(*, radius_mm: Annotated[float, "its radius"] = 20, does: Annotated[str, "what it gives"] = "chords"):
    def draw(camera, pose, pixels):
        if does in ("few", "below", "not finite"):
            return {"few": [1.0], "below": -numpy.ones(len(pixels)), "not finite": pixels[:, 0] * numpy.nan}[does]
        if does == "everywhere":
            return numpy.ones(len(pixels))
        rays = numpy.linalg.inv(camera.intrinsics) @ numpy.column_stack([pixels, numpy.ones(len(pixels))]).T
        middle = (camera.camera_from_world @ pose)[:3, 3:]
        off = numpy.linalg.norm(numpy.cross(rays, middle, axis=0), axis=0) / numpy.linalg.norm(rays, axis=0)
        return 2 * numpy.sqrt(numpy.maximum(radius_mm**2 - off**2, 0))

    corners = radius_mm * (2.0 * numpy.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 1)
    if does == "no box":
        return draw
    return draw, (corners[:, :2] if does == "flat box" else corners)

@marrow.projector("project.denser", summary="another projector's model, denser")
def denser(projector: marrow.RadiographProjector, *, times: Annotated[float, "how many times"] = 2):
    def draw(camera, pose, pixels):
        return times * projector(camera, pose, pixels=pixels)

    return draw, [(x, y, z) for x in (-20, 20) for y in (-20, 20) for z in (-20, 20)]

@marrow.node("own.drawn", summary="a radiograph")
def drawn(projector: marrow.RadiographProjector, view: marrow.View) -> Annotated[marrow.Image, marrow.named("image")]:
    return marrow.Image(projector(view, numpy.eye(4)))

@marrow.node("own.outline", summary="an outline, a row for each point")
def outline(projector: marrow.OutlineProjector, view: marrow.View) -> Annotated[marrow.Image, marrow.named("image")]:
    return marrow.Image(projector(view, numpy.eye(4)).astype("float32"))

@marrow.node("own.compared", summary="what a cost of marrow's own says of a projector")
def compared(projector: marrow.RadiographProjector, view: marrow.View) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    cost = marrow.similarity.normalised_cross_correlation(projector, [view])
    return marrow.Metrics({"value": cost(numpy.eye(4))})
"""


class FunctionNodes(Written):
    """Nodes that make functions or take them: costs, optimizers, projectors, and decorators of them. Their values are
    known by hand; `does` says what else they do. The files near.py, costs.py and optimizers.py are there in each test.
    """

    def setUp(self):
        super().setUp()
        self.near = self.plugin(NEAR, "near.py")
        self.costs = self.plugin(DECORATORS, "costs.py")
        self.optimizers = self.optimizers_in(600)

    def optimizers_in(self, seconds):
        return self.plugin(OPTIMIZERS.replace("SECONDS", str(seconds)), "optimizers.py")
