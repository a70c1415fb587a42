# SPDX-License-Identifier: Apache-2.0
"""The names of figures that a node declares, in C++ or in Python."""
import json

from harness.package import main, marrow
from written_nodes import Written, view

MEASURES = """
@marrow.node("evaluate.own", summary="two figures")
def own(view: Annotated[marrow.View, "view"], *, also: Annotated[str, "a further figure"] = "") -> Annotated[
        marrow.Metrics, marrow.named("metrics"), marrow.figures("mean_mm", "*.median_px")]:
    figures = {"mean_mm": 1.0, view.name + ".median_px": 2.0}
    return marrow.Metrics({**figures, **({also: 3.0} if also else {})})
"""


class Figures(Written):
    def test_a_node_in_python_says_what_it_makes(self):
        self.plugin(MEASURES)
        described = json.loads(self.program("inspect", "evaluate.own", "--json"))
        self.assertEqual([output["figures"] for output in described["outputs"]], [["mean_mm", "*.median_px"]])
        self.assertIn("figures: mean_mm, *.median_px\n", self.program("inspect", "evaluate.own"))

    def test_another_figure_is_a_fault(self):
        self.plugin(MEASURES)
        made = marrow.evaluate.own(view())
        self.assertEqual((made["mean_mm"], made["frontal.median_px"]), (1, 2))
        said = (
            "it gave an output 'metrics' that cannot be: the figure 'mean_m' is not among those that its declaration "
        )
        self.refuses((said + "names", lambda: marrow.evaluate.own(view(), also="mean_m")), kind=marrow.RunError)

    def test_they_belong_to_figures(self):
        self.plugin(
            """
@marrow.node("edges.own", summary="no figures")
def own(view: Annotated[marrow.View, "view"]) -> Annotated[marrow.EdgeMap, marrow.figures("mean_mm")]:
    return marrow.EdgeMap(numpy.zeros((0, 5)), width_px=1, height_px=1)
"""
        )
        self.assertIn("marrow.figures", self.program("doctor", code=1))

    def test_each_shipped_output_of_figures_says_which(self):
        """So that an experiment that asks for another one is refused before it runs."""
        nodes = json.loads(self.program("list", "--json"))
        outputs = [
            (node["name"], output) for node in nodes for output in node["outputs"] if output["type"] == "metrics"
        ]
        shipped = [(name, output) for name, output in outputs if not name.startswith(("test.", "judge.", "parse."))]
        self.assertGreater(len(shipped), 20)
        without = [name for name, output in shipped if not output["figures"]]
        self.assertEqual(without, ["run.program_metrics"], "its figures are those of the program that it runs")


if __name__ == "__main__":
    main()
