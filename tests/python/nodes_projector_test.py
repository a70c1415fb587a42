# SPDX-License-Identifier: Apache-2.0
"""Projectors of radiographs written in Python: marrow asks for the pixels of a picture, and costs compare it."""
import numpy
from harness.package import main, marrow
from written_nodes import Written, camera

BALL = """
@marrow.projector("project.ball", summary="the chords of a ball", seconds=5)
def ball(
    *,
    radius_mm: Annotated[float, "its radius"] = 20,
    answer: Annotated[str, "what it gives"] = "chords",
):
    def draw(camera, pose, pixels):
        if answer in ("few", "below", "not finite"):
            return {"few": [1.0], "below": -numpy.ones(len(pixels)), "not finite": pixels[:, 0] * numpy.nan}[answer]
        if answer == "everywhere":
            return numpy.ones(len(pixels))
        rays = numpy.linalg.inv(camera.intrinsics) @ numpy.column_stack([pixels, numpy.ones(len(pixels))]).T
        middle = (camera.camera_from_world @ pose)[:3, 3:]
        off = numpy.linalg.norm(numpy.cross(rays, middle, axis=0), axis=0) / numpy.linalg.norm(rays, axis=0)
        return 2 * numpy.sqrt(numpy.maximum(radius_mm**2 - off**2, 0))

    corners = radius_mm * (2.0 * numpy.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 1)
    if answer == "no box":
        return draw
    return draw, (corners[:, :2] if answer == "flat box" else corners)
"""


def shifted(x, y, z):
    pose = numpy.eye(4)
    pose[:3, 3] = (x, y, z)
    return pose


class Projectors(Written):
    def setUp(self):
        super().setUp()
        self.plugin(BALL)

    def test_it_is_described_as_a_projector_of_radiographs(self):
        info = marrow._core.node_info("project.ball")
        self.assertEqual(
            [(port["name"], port["type"]) for port in info["outputs"]], [("projector", "radiograph_projector")]
        )

    def test_its_values(self):
        projector = marrow.project.ball()
        self.assertIs(type(projector), marrow.RadiographProjector)
        seen = projector(camera(), numpy.eye(4))
        v, u = numpy.mgrid[0:96, 0:128] - numpy.reshape([47.5, 63.5], (2, 1, 1))
        off = 600 * numpy.sin(numpy.arctan(numpy.hypot(u, v) / 1000))
        self.assertLess(numpy.abs(seen - 2 * numpy.sqrt(numpy.maximum(400 - off**2, 0))).max(), 1e-4)
        self.assertTrue(numpy.array_equal(projector(camera(), numpy.eye(4), step_px=3), seen[::3, ::3]))

    def test_beyond_the_box_it_is_nothing(self):
        projector = marrow.project.ball(answer="everywhere", radius_mm=6)
        seen = projector(camera(), numpy.eye(4))
        self.assertEqual(seen[47, 63], 1)
        reach_px = 6 * 1000 / 594  # of the nearer side of the box
        self.assertLess(abs(seen.sum() - (2 * reach_px + 1) ** 2), 4 * reach_px)
        self.assertEqual(projector(camera(), shifted(500, 0, 0)).max(), 0)
        self.assertEqual(projector(camera(), shifted(0, 0, -900)).max(), 0, "behind the source")
        self.assertEqual(projector(camera(), shifted(0, 0, -600)).min(), 1, "about the source")

    def test_a_cost_compares_its_radiographs(self):
        projector = marrow.project.ball()
        depth = projector(camera(), numpy.eye(4))
        seen = marrow.View(numpy.round(40000 * numpy.exp(-0.02 * depth)).astype("uint16"), camera(), name="frontal")
        cost = marrow.similarity.normalised_cross_correlation(projector, [seen])
        there, *off = cost([shifted(0, 0, 0), shifted(3, 0, 0), shifted(0, -3, 0)])
        self.assertLess(there, 0.01)
        self.assertGreater(min(off), there + 0.02)

    def test_what_it_may_not_give(self):
        for answer, text in (
            ("few", "project.ball: expected the values of 12288 pixels, got 1"),
            ("below", "project.ball: a value of the radiograph is below 0 or not finite; give 0 where the model is"),
            ("not finite", "project.ball: a value of the radiograph is below 0 or not finite"),
        ):
            with self.subTest(answer), self.assertRaisesRegex(marrow.Error, text):
                marrow.project.ball(answer=answer)(camera(), numpy.eye(4))
        for answer, text in (
            ("no box", "project.ball: expected a function that draws, and the corners of a box about the model"),
            ("flat box", r"the corners of the box must be an array \[N, 3\] of finite numbers, in mm"),
        ):
            with self.subTest(answer), self.assertRaisesRegex(marrow.RunError, text):
                marrow.project.ball(answer=answer)


if __name__ == "__main__":
    main()
