# SPDX-License-Identifier: Apache-2.0
"""Costs written in Python: poses come in batches, and an optimizer in C++ finds the least."""
import numpy
from harness.package import main, marrow
from written_nodes import Written, view

COST = """
made = []

@marrow.cost("similarity.near", summary="how far the model is from a place", seconds=5)
def near(
    views: Annotated[marrow.Items[marrow.View], marrow.over("view")],
    mesh: Optional[marrow.Mesh] = None,
    *,
    place_mm: Annotated[float, "where the least cost is, along each axis"] = 3,
    answer: Annotated[str, "what it gives"] = "squares",
):
    made.append(1)
    assert list(views) == ["frontal"]
    if answer == "refuse":
        raise marrow.Error("the views show no bone; take others")

    def costs(poses):
        assert poses.shape[1:] == (4, 4) and (poses[:, 3] == [0, 0, 0, 1]).all()
        if answer == "squares":
            turned = numpy.square(poses[:, :3, :3] - numpy.eye(3)).sum(axis=(1, 2))
            return numpy.square(poses[:, :3, 3] - place_mm).sum(axis=1) + 1000 * turned + 1e6 * (len(made) - 1)
        return {"few": [1.0], "none": poses[:, 0, 0] * numpy.nan, "raise": None}[answer] if answer != "raise" else 1 / 0

    return costs
"""


class Costs(Written):
    def profiles(self, **options):
        """The cost around the identity, along each axis."""
        cost = marrow.similarity.near([view()], **options)
        self.assertEqual(cost.type, "cost")
        return marrow.evaluate.landscape(cost, marrow.Pose(numpy.eye(4))).profiles

    def test_it_is_described_as_a_cost(self):
        self.plugin(COST)
        info = marrow._core.node_info("similarity.near")
        self.assertEqual([(port["name"], port["type"]) for port in info["outputs"]], [("cost", "cost")])
        self.assertIn("similarity.near", self.program("list", "similarity"))

    def test_its_values(self):
        self.plugin(COST)
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
        self.plugin(COST)
        cost = marrow.similarity.near([view()])
        for _ in range(3):
            profiles = marrow.evaluate.landscape(cost, marrow.Pose(numpy.eye(4))).profiles
            self.assertLess(max(profile.costs.max() for profile in profiles), 1e4, "1e6 for each further one")

    def test_what_is_wrong_with_its_inputs_is_said_when_it_is_made(self):
        self.plugin(COST)
        with self.assertRaisesRegex(marrow.RunError, "the views show no bone; take others"):
            marrow.similarity.near([view()], answer="refuse")

    def test_an_optimizer_finds_the_least(self):
        self.plugin(COST)
        found = marrow.register.multiresolution(
            cost=marrow.similarity.near([view()]),
            optimizer=marrow.optimizer.nelder_mead(),
            start=marrow.Pose(numpy.eye(4)),
        )
        self.assertLess(numpy.abs(found.pose.matrix[:3, 3] - 3).max(), 0.1)

    def test_what_it_may_not_give(self):
        self.plugin(COST)
        for answer, text in (
            ("few", "similarity.near: expected [0-9]+ costs, got 1"),
            ("none", "similarity.near: a cost is not finite; give the worst value where nothing can be compared"),
            ("raise", "mine.py, line [0-9]+, in costs: ZeroDivisionError: division by zero"),
        ):
            with self.subTest(answer), self.assertRaisesRegex(marrow.RunError, text):
                self.profiles(answer=answer)


if __name__ == "__main__":
    main()
