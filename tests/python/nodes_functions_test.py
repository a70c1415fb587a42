# SPDX-License-Identifier: Apache-2.0
"""Costs and projectors written in Python, decorators of them, and nodes that take them."""
import numpy
from written_nodes import DECORATORS, NEAR, PROJECTORS, FunctionNodes, Written, camera, view
from harness.package import SOURCE, interrupt, main, marrow, small_case

PIPELINE = """marrow: 1
nodes:
  near: {uses: similarity.near}
  times: {uses: similarity.line, in: {cost: near}, with: {factor: 4}}
  threads: {uses: own.threads, in: {cost: times}, with: {fails: true}}
outputs: {figures: threads}
"""


def shifted(*translation_mm):
    matrix = numpy.eye(4)
    matrix[:3, 3] = translation_mm
    return matrix


POSES = [shifted(0, 0, 0), shifted(1, 2, 3), shifted(-2, 0.5, 7)]
START = marrow.Pose(numpy.eye(4))


def outputs_of(node):
    return [(port["name"], port["type"]) for port in marrow._core.node_info(node)["outputs"]]


class Costs(FunctionNodes):
    def profiles(self, **options):
        """The cost around the identity, along each axis."""
        cost = marrow.similarity.near([view()], **options)
        self.assertEqual(cost.type, "cost")
        return marrow.evaluate.landscape(cost, START).profiles

    def test_it_is_described_as_a_cost(self):
        self.assertEqual(outputs_of("similarity.near"), [("cost", "cost")])
        listed = self.program("list", "similarity")
        self.assertIn("similarity.near", listed)
        self.assertIn("similarity.line", listed)

    def test_its_values(self):
        profiles = self.profiles(place_mm=3)
        moved = [profile for profile in profiles if profile.unit == "mm"]
        self.assertEqual(len(moved), 3)
        for profile in moved:
            self.assertLess(numpy.abs(profile.costs - (profile.offsets - 3) ** 2 - 18).max(), 1e-9)
        for profile in profiles:
            if profile.unit == "deg":  # |R - I|^2 = 4 - 4 cos(angle)
                turned = 4000 * (1 - numpy.cos(numpy.radians(profile.offsets)))
                self.assertLess(numpy.abs(profile.costs - turned - 27).max(), 1e-6)

    def test_it_is_made_once_for_many_batches(self):
        cost = marrow.similarity.near([view()], does="count")
        for _ in range(3):
            profiles = marrow.evaluate.landscape(cost, START).profiles
            self.assertLess(max(profile.costs.max() for profile in profiles), 1e4, "1e6 for each further one")

    def test_what_is_wrong_with_its_inputs_is_said_when_it_is_made(self):
        refusing = lambda: marrow.similarity.near([view()], does="refuse")
        self.refuses(("the views show no bone; take others", refusing), kind=marrow.RunError)

    def test_an_optimizer_in_cpp_finds_the_least(self):
        found = marrow.register.multiresolution(
            cost=marrow.similarity.near([view()]), optimizer=marrow.optimizer.nelder_mead(), start=START
        )
        self.assertLess(numpy.abs(found.pose.matrix[:3, 3] - 3).max(), 0.1)

    def test_what_it_may_not_give(self):
        for does, text in (
            ("few", "similarity.near: expected [0-9]+ costs, got 1"),
            ("none", "similarity.near: a cost is not finite; give the worst value where nothing can be compared"),
            ("divide", "near.py, line [0-9]+, in costs: ZeroDivisionError: division by zero"),
        ):
            self.refuses((text, lambda: self.profiles(does=does)), kind=marrow.RunError)


class Decorators(FunctionNodes):
    """By hand: the squared distance of the identity from 3 mm along each axis is 3 * 3^2 = 27."""

    def value(self, inner="squares", outer="asks"):
        cost = marrow.similarity.line(marrow.similarity.near(does=inner), does=outer)
        return cost(numpy.tile(numpy.eye(4), (2, 1, 1))).tolist()

    def test_it_asks_another_cost(self):
        inner = marrow.similarity.near(place_mm=2)
        outer = marrow.similarity.line(inner, factor=3, offset=1)
        self.assertLess(numpy.abs(outer(POSES) - 3 * inner(POSES) - 1).max(), 1e-12)
        self.assertEqual(inner(POSES[1]), 1 + 0 + 1)
        twice = marrow.similarity.line(outer, marrow.similarity.near(place_mm=0), factor=2)
        self.assertLess(abs(twice(POSES[1]) - (2 * (3 * 2 + 1) + 14)), 1e-12)

    def test_both_may_be_in_one_file(self):
        self.plugin((NEAR + DECORATORS).replace('("similarity.', '("similarity.my_').replace('"own.', '"own.my_'))
        outer = marrow.similarity.my_line(marrow.similarity.my_near(place_mm=2), factor=3, offset=1)
        self.assertEqual(outer(POSES[1]), 7)

    def test_a_list_of_costs(self):
        costs = {"a": marrow.similarity.near(place_mm=1), "b": marrow.similarity.near(place_mm=2)}
        self.assertEqual(marrow.own.sum(costs)["value"], 3 + 12)

    def test_several_threads_ask_at_once(self):
        """By hand: (x - 3)^2 + 2 * 3^2."""
        figures = marrow.own.threads(marrow.similarity.near())
        self.assertEqual([figures[str(x)] for x in range(50)], [(x - 3) ** 2 + 18 for x in range(50)])

    def test_a_cost_that_changes_nothing_registers_alike(self):
        """Levels, blocks of the images and so the predicted deviations are those of the cost inside."""
        case = marrow.read.case(path=str(small_case()[0]))
        bone = marrow.segment.threshold(case.ct, case.seeds)["distal"]
        drr = marrow.project.siddon_jacobs(volume=case.ct, field=bone)  # no derivatives, which Python does not get
        plain = marrow.similarity.gradient_correlation(projector=drr, views=case.views)
        optimizer = marrow.optimizer.nelder_mead()
        start = marrow.Pose(case.truth["distal"].matrix)
        arguments = {"optimizer": optimizer, "start": start, "pixel_step": [16, 8, 8], "scan_rotation_deg": 0}
        costs = (plain, marrow.similarity.line(plain))
        found = [marrow.register.multiresolution(cost=cost, **arguments).pose for cost in costs]
        self.assertEqual(found[0].matrix.tolist(), found[1].matrix.tolist())
        self.assertIsNotNone(found[0].covariance)
        self.assertLess(numpy.abs(found[0].covariance / found[1].covariance - 1).max(), 1e-6)

    def test_results_are_kept_by_what_made_the_function(self):
        def made(**options):
            told = []
            node = marrow.own.sum.using(keep=True, progress=told.append)
            node({"a": marrow.similarity.near(**options)})
            return any(event["event"] == "started" and event["node"] == "sum" for event in told)

        made(place_mm=1)
        self.assertFalse(made(place_mm=1))
        self.assertTrue(made(place_mm=2))

    def test_what_may_go_wrong(self):
        self.assertEqual(self.value(), [27, 27])
        for inner, outer, text in (
            ("raise", "asks", "^the bowl is broken; take another one"),
            ("raise", "catch", "^the bowl is broken; take another one"),
            ("crash", "asks", r"^near.py crashed its process \(Aborted\)"),
            ("squares", "flat", "^pose: expected 4 x 4 numbers, got 2 x 3"),
            ("squares", "few", "^similarity.line: expected 2 costs, got 1"),
            ("squares", "sleep", r"^costs.py took longer than 4 s, and .* give it more in @marrow.cost\(..., seconds"),
        ):
            self.refuses((text, lambda: self.value(inner, outer)))
        self.assertEqual(self.value(), [27, 27], "the next call works")

    def test_the_time_of_the_function_inside_does_not_count(self):
        self.assertEqual(self.value("slow"), [27, 27])

    def test_ctrl_c(self):
        cost = marrow.similarity.line(marrow.similarity.near(does="tenth"))
        interrupt(self, lambda: cost(numpy.tile(numpy.eye(4), (16000, 1, 1))))  # a batch has 16 poses

    def test_a_function_of_an_earlier_call_is_refused(self):
        self.assertEqual(self.value("squares", "other"), [27, 27])
        with self.assertRaisesRegex(marrow.Error, "it used a function that an earlier call was given; use only the in"):
            self.value("tenth", "other")

    def test_the_decorator_of_the_documents(self):
        """By hand: a hundredth of the 5 mm to the start more."""
        self.plugin((SOURCE / "docs" / "example-plugin" / "held.py").read_text(), "held.py")
        held = marrow.similarity.held(marrow.similarity.near(), marrow.Pose(shifted(3, 4, 0)))
        self.assertAlmostEqual(held(numpy.eye(4)), 27.05, delta=1e-12)

    def test_the_program_checks_lists_and_replays_them(self):
        pipeline = self.write("fails.yaml", PIPELINE)
        self.program("check", pipeline)
        self.assertIn("similarity.line", self.program("list", "--fits", pipeline, "near"))
        self.assertIn("as told", self.program("run", pipeline, "--out", self.scratch / "out", code=1))
        self.assertIn("as told", self.program("replay", self.scratch / "out" / "failed" / "threads", code=1))


def view_of(depth):
    """A view in which the line integrals are `depth`."""
    return marrow.View(numpy.round(40000 * numpy.exp(-0.02 * depth)).astype("uint16"), camera(), name="frontal")


class Projectors(Written):
    def setUp(self):
        super().setUp()
        self.plugin(PROJECTORS)
        self.ball = marrow.project.ball()
        self.expected = self.ball(camera(), numpy.eye(4))
        self.view = view_of(self.expected)

    def test_it_is_described_as_a_projector_of_radiographs(self):
        self.assertEqual(outputs_of("project.ball"), [("projector", "radiograph_projector")])
        self.assertIs(type(self.ball), marrow.RadiographProjector)

    def test_radiographs(self):
        """By hand: the chord of the ray through the middle of four pixels misses the centre by 0.42 mm."""
        self.assertLess(abs(self.expected.max() - 2 * (20**2 - 0.18) ** 0.5), 1e-3)
        v, u = numpy.mgrid[0:96, 0:128] - numpy.reshape([47.5, 63.5], (2, 1, 1))
        off = 600 * numpy.sin(numpy.arctan(numpy.hypot(u, v) / 1000))
        self.assertLess(numpy.abs(self.expected - 2 * numpy.sqrt(numpy.maximum(400 - off**2, 0))).max(), 1e-4)
        every_third = self.ball(camera(), numpy.eye(4), step_px=3)
        self.assertTrue(numpy.array_equal(every_third, self.expected[::3, ::3]))
        self.assertTrue(numpy.array_equal(marrow.own.drawn(self.ball, self.view).array, self.expected))

    def test_single_pixels(self):
        pixels = [[63, 47], [64, 48], [0, 0], [70, 40]]
        found = self.ball(camera(), numpy.eye(4), pixels=pixels)
        self.assertEqual(found.tolist(), [float(self.expected[v, u]) for u, v in pixels])
        with self.assertRaisesRegex(marrow.Error, "pixels: expected any x 2 numbers, got 3"):
            self.ball(camera(), numpy.eye(4), pixels=[1, 2, 3])

    def test_beyond_the_box_it_is_nothing(self):
        projector = marrow.project.ball(does="everywhere", radius_mm=6)
        seen = projector(camera(), numpy.eye(4))
        self.assertEqual(seen[47, 63], 1)
        reach_px = 6 * 1000 / 594  # of the nearer side of the box
        self.assertLess(abs(seen.sum() - (2 * reach_px + 1) ** 2), 4 * reach_px)
        self.assertEqual(projector(camera(), shifted(500, 0, 0)).max(), 0)
        self.assertEqual(projector(camera(), shifted(0, 0, -900)).max(), 0, "behind the source")
        self.assertEqual(projector(camera(), shifted(0, 0, -600)).min(), 1, "about the source")

    def test_a_cost_compares_its_radiographs(self):
        cost = marrow.similarity.normalised_cross_correlation(self.ball, [self.view])
        there, *off = cost([shifted(0, 0, 0), shifted(3, 0, 0), shifted(0, -3, 0)])
        self.assertLess(there, 0.01)
        self.assertGreater(min(off), there + 0.02)
        self.assertEqual(marrow.own.compared(self.ball, self.view)["value"], there)

    def test_a_decorator(self):
        found = marrow.project.denser(self.ball)(camera(), numpy.eye(4))
        self.assertTrue(numpy.array_equal(found, 2 * self.expected))

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
        self.plugin(DECORATORS, "costs.py")
        cost, texts = marrow.similarity.normalised_cross_correlation(self.ball, [self.view]), []
        for one in (cost, marrow.similarity.line(cost, factor=4)):
            with self.assertRaises(marrow.RunError) as caught:
                marrow.register.multiresolution(
                    cost=one, optimizer=marrow.optimizer.nelder_mead(), start=marrow.Pose(shifted(500, 0, 0))
                )
            texts.append(str(caught.exception))
        self.assertEqual(texts[0], texts[1])

    def test_what_it_may_not_give(self):
        for does, text in (
            ("few", "project.ball: expected the values of 12288 pixels, got 1"),
            ("below", "project.ball: a value of the radiograph is below 0 or not finite; give 0 where the model is"),
            ("not finite", "project.ball: a value of the radiograph is below 0 or not finite"),
        ):
            self.refuses((text, lambda: marrow.project.ball(does=does)(camera(), numpy.eye(4))))
        for does, text in (
            ("no box", "project.ball: expected a function that draws, and the corners of a box about the model"),
            ("flat box", r"the corners of the box must be an array \[N, 3\] of finite numbers, in mm"),
        ):
            self.refuses((text, lambda: marrow.project.ball(does=does)), kind=marrow.RunError)


if __name__ == "__main__":
    main()
