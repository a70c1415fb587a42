# SPDX-License-Identifier: Apache-2.0
"""Nodes written in Python that take projectors, hand a problem on, or ask from several threads."""
import numpy
from harness.package import SOURCE, main, marrow
from written_nodes import Written, camera

# A ball whose radiographs are known by hand, costs with values known by hand, and nodes that take them.
NODES = """
@marrow.projector("project.ball", summary="the chords of a ball")
def ball(*, radius_mm: Annotated[float, "its radius"] = 20):
    def draw(camera, pose, pixels):
        rays = numpy.linalg.inv(camera.intrinsics) @ numpy.column_stack([pixels, numpy.ones(len(pixels))]).T
        middle = (camera.camera_from_world @ pose)[:3, 3:]
        off = numpy.linalg.norm(numpy.cross(rays, middle, axis=0), axis=0) / numpy.linalg.norm(rays, axis=0)
        return 2 * numpy.sqrt(numpy.maximum(radius_mm**2 - off**2, 0))

    ends = (-radius_mm, radius_mm)
    return draw, [(x, y, z) for x in ends for y in ends for z in ends]


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


@marrow.cost("similarity.near", summary="squared distance from 3 mm along each axis")
def near():
    return lambda poses: numpy.square(poses[:, :3, 3] - 3).sum(axis=1)


@marrow.cost("similarity.times", summary="another cost, four times")
def times(cost: marrow.Cost):
    return lambda poses: 4 * cost(poses)


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


@marrow.optimizer("optimizer.starts", summary="another optimizer, from three starts", traits=["needs_start"])
def starts(problem: marrow.Problem, optimizer: marrow.Optimizer) -> str:
    for offset in (0, -2, 2):
        found = optimizer.minimise(problem, start=problem.start + offset, max_evaluations=100)
    return "the last start: " + found.stopped_because


@marrow.optimizer("optimizer.handed", summary="hands the problem on")
def handed(problem: marrow.Problem, optimizer: marrow.Optimizer) -> str:
    return optimizer.minimise(problem).stopped_because
"""

PIPELINE = """marrow: 1
nodes:
  near: {uses: similarity.near}
  times: {uses: similarity.times, in: {cost: near}}
  threads: {uses: own.threads, in: {cost: times}, with: {fails: %s}}
outputs: {figures: threads}
"""


def view_of(depth):
    """A view in which the line integrals are `depth`."""
    return marrow.View(numpy.round(40000 * numpy.exp(-0.02 * depth)).astype("uint16"), camera(), name="frontal")


class Projectors(Written):
    def setUp(self):
        super().setUp()
        self.plugin(NODES)
        self.ball = marrow.project.ball()
        self.expected = self.ball(camera(), numpy.eye(4))
        self.view = view_of(self.expected)

    def test_radiographs(self):
        """By hand: the chord of the ray through the middle of four pixels misses the centre by 0.42 mm."""
        self.assertLess(abs(self.expected.max() - 2 * (20**2 - 0.18) ** 0.5), 1e-3)
        self.assertTrue(numpy.array_equal(marrow.own.drawn(self.ball, self.view).array, self.expected))

    def test_single_pixels(self):
        pixels = [[63, 47], [64, 48], [0, 0], [70, 40]]
        found = self.ball(camera(), numpy.eye(4), pixels=pixels)
        self.assertEqual(found.tolist(), [float(self.expected[v, u]) for u, v in pixels])
        with self.assertRaisesRegex(marrow.Error, "pixels: expected any x 2 numbers, got 3"):
            self.ball(camera(), numpy.eye(4), pixels=[1, 2, 3])

    def test_a_decorator(self):
        found = marrow.project.denser(self.ball)(camera(), numpy.eye(4))
        self.assertTrue(numpy.array_equal(found, 2 * self.expected))

    def test_a_cost_in_cpp_asks_it_there(self):
        cost = marrow.similarity.normalised_cross_correlation(self.ball, [self.view])
        self.assertEqual(marrow.own.compared(self.ball, self.view)["value"], cost(numpy.eye(4)))

    def test_a_smoothed_projector(self):
        """The cost asks for a smoothed projector where there is one: the ball has none."""
        samples = numpy.full((24, 24, 24), -1000, "float32")
        samples[6:18, 6:18, 6:18] = 500
        cube = marrow.project.joseph(volume=marrow.Volume(samples, spacing_mm=(2, 2, 2), origin_mm=(-23, -23, -23)))
        seen = view_of(cube(camera(), numpy.eye(4)))
        cost = marrow.similarity.normalised_cross_correlation(cube, [seen])
        self.assertEqual(marrow.own.compared(cube, seen)["value"], cost(numpy.eye(4)))

    def test_outlines(self):
        corners = [(x, y, z) for x in (-9, 9) for y in (-9, 9) for z in (-9, 9)]
        faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
        faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
        outline = marrow.project.silhouette_edges(model=marrow.Mesh(corners, faces))
        expected = outline(camera(), numpy.eye(4))
        self.assertGreater(len(expected), 50)
        self.assertTrue(numpy.array_equal(marrow.own.outline(outline, self.view).array, expected.astype("float32")))

    def test_a_decorated_cost_says_that_nothing_is_compared(self):
        away = numpy.eye(4)
        away[0, 3] = 500
        cost, texts = marrow.similarity.normalised_cross_correlation(self.ball, [self.view]), []
        for one in (cost, marrow.similarity.times(cost)):
            with self.assertRaises(marrow.RunError) as caught:
                marrow.register.multiresolution(
                    cost=one, optimizer=marrow.optimizer.nelder_mead(), start=marrow.Pose(away)
                )
            texts.append(str(caught.exception))
        self.assertEqual(texts[0], texts[1])


class Others(Written):
    def setUp(self):
        super().setUp()
        self.plugin(NODES)

    def test_several_threads_ask_at_once(self):
        """By hand: (x - 3)^2 + 2 * 3^2."""
        figures = marrow.own.threads(marrow.similarity.near())
        self.assertEqual([figures[str(x)] for x in range(50)], [(x - 3) ** 2 + 18 for x in range(50)])

    def test_a_problem_is_handed_on_with_another_start(self):
        """The derivative of (x^2 - 1)^2 + 0.3 x is 0 at -1.0355, the least, and at 0.9601."""

        def two_minima(x):
            return float((x[0] ** 2 - 1) ** 2 + 0.3 * x[0])

        plain, asked = marrow.optimizer.nelder_mead(), []
        self.assertLess(abs(plain.minimise(two_minima, [1], [0.1]).x[0] - 0.9601), 1e-3)
        found = marrow.optimizer.starts(plain).minimise(lambda x: asked.append(x) or two_minima(x), [1], [0.1])
        self.assertLess(abs(found.x[0] + 1.0355), 1e-3)
        self.assertEqual((found.value, found.evaluations), (two_minima(found.x), len(asked)))
        self.assertIn("the last start: ", found.stopped_because)

    def test_a_problem_that_is_handed_on_is_the_same_problem(self):
        plain, found = marrow.optimizer.nelder_mead(), []
        for one in (plain, marrow.optimizer.handed(plain)):
            for limits in ({}, {"max_evaluations": 30}, {"lower": [-5, -1], "upper": [0.25, 5]}):
                least = one.minimise(lambda x: float((x[0] - 1) ** 2 + (x[1] + 2) ** 2), [0, 0], [1, 1], **limits)
                found.append((least.x.tolist(), least.value))
        self.assertEqual(found[:3], found[3:])

    def test_the_decorator_of_the_documents(self):
        """By hand: 3 * 3^2 at the origin, and a hundredth of the 5 mm to the start."""
        self.plugin((SOURCE / "docs" / "example-plugin" / "held.py").read_text(), "held.py")
        start = numpy.eye(4)
        start[:3, 3] = (3, 4, 0)
        held = marrow.similarity.held(marrow.similarity.near(), marrow.Pose(start))
        self.assertAlmostEqual(held(numpy.eye(4)), 27.05, delta=1e-12)

    def test_the_program_checks_lists_and_replays_them(self):
        pipeline = self.write("fails.yaml", PIPELINE % "true")
        self.program("check", pipeline)
        self.assertIn("similarity.times", self.program("list", "--fits", pipeline, "near"))
        self.assertIn("as told", self.program("run", pipeline, "--out", self.scratch / "out", code=1))
        said = self.program("replay", self.scratch / "out" / "failed" / "threads", code=1)
        self.assertIn("as told", said)


if __name__ == "__main__":
    main()
