# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/python.md, and the notebooks, run as they stand."""
import ast
import contextlib
import importlib.util
import io
import json
import os
import re
import shutil

import numpy
from harness.package import BUILD, SOURCE, Case, main, marrow, small_case

# What makes the cases of the demonstration quick.
COARSE = "    set: {ct.spacing_mm: [1.2, 1.2, 1.5], ct.range_mm: [0, 300]}\n"
HAS_PANDAS = importlib.util.find_spec("pandas") is not None


class Documents(Case):
    def setUp(self):
        super().setUp()
        shutil.copytree(SOURCE / "pipelines", self.scratch / "pipelines")
        demo = self.scratch / "pipelines" / "experiments" / "demo.yaml"
        demo.write_text(demo.read_text().replace("    draw:", COARSE + "    draw:"))
        (self.scratch / "cases").mkdir()
        (self.scratch / "cases" / "7").symlink_to(small_case()[0])
        os.chdir(self.scratch)

    def test_the_examples_run(self):
        text = (SOURCE / "docs" / "python.md").read_text()
        blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
        self.assertGreater(len(blocks), 5)
        names, said = {}, io.StringIO()
        for block in blocks:
            if not HAS_PANDAS:
                block = block.replace(".to_pandas()", "")
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
                exec(compile(block, "docs/python.md", "exec"), names)
        self.assertLess(names["r"]["errors"]["distal"]["final"]["mtre_mm"], 2)
        self.assertIn("edges hihg 'edges.adaptive_relaxation' has no option 'hihg'", said.getvalue())
        self.assertIn("Help on Node", said.getvalue())
        self.assertEqual(len(names["bright"](names["view"])), 512 * 512, "the function of a node is a plain function")
        problem = marrow.Problem(lambda points: (points**2).sum(axis=1), [3, -2], [1, 1])
        self.assertEqual(names["crosses"](problem), "the steps are short")
        self.assertLess(problem.least, 1e-6)
        away = numpy.eye(4)
        away[2, 3] = 600
        camera = marrow.Camera(64, 64, [[1000, 0, 31.5], [0, 1000, 31.5], [0, 0, 1]], away)
        self.assertAlmostEqual(names["ball"]()[0](camera, numpy.eye(4), numpy.array([[31.5, 31.5]]))[0], 40, delta=1e-6)
        self.assertEqual(names["ball"]()[1].shape, (8, 3))
        comparison = names["c"]
        self.assertEqual(len(comparison.cells), 4)
        self.assertEqual({row["variant"] for row in comparison.cells}, {"adaptive_relaxation", "canny"})
        self.assertEqual(len(comparison.differences), 2)
        self.assertTrue(comparison.report.is_file())
        self.assertEqual(len(comparison.variants), 4)
        if HAS_PANDAS:
            self.assertEqual(
                list(comparison.variants.to_pandas()["variant"]), [row["variant"] for row in comparison.variants]
            )

    def test_the_notebook_runs(self):
        file = SOURCE / "docs" / "notebooks" / "femur.ipynb"
        outputs = outputs_of_notebook(file, self.scratch)
        self.assertGreater(len(outputs), 5)
        said = "".join("".join(one.get("text", "")) for cell in outputs for one in cell)
        shown = [one.get("data", {}).get("text/html", "") for cell in outputs for one in cell]
        self.assertRegex(said, r"high: 75: \d+ edge pixels, error [01]\.\d+ mm\nhigh: 85: \d+ edge pixels")
        self.assertEqual(said.count("least cost at"), 6)
        self.assertIn("canny, ", said)
        self.assertTrue(any("<canvas" in html for html in shown))
        self.assertTrue(any(html.count("<polyline") == 6 for html in shown))
        self.assertTrue(any("success_rate" in html for html in shown))


def outputs_of_notebook(file, folder):
    """The outputs of each code cell, in nbformat. Without nbclient the cells are executed here, one after the other."""
    try:
        import ipykernel  # noqa: F401
        import nbclient
        import nbformat
    except ImportError:
        return outputs_of_cells(json.loads(file.read_text())["cells"])
    os.environ["PYTHONPATH"] = str(BUILD / "python")
    notebook = nbformat.read(file, as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(folder)}}).execute()
    return [cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"]


def outputs_of_cells(cells):
    names, outputs = {}, []
    for cell in cells:
        if cell["cell_type"] != "code":
            continue
        tree = ast.parse("".join(cell["source"]))
        last = ast.Expression(tree.body.pop().value) if isinstance(tree.body[-1], ast.Expr) else None
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile(tree, "cell", "exec"), names)
            value = eval(compile(last, "cell", "eval"), names) if last else None
        shown = {"text/html": value._repr_html_()} if hasattr(value, "_repr_html_") else {}
        outputs.append([{"text": said.getvalue()}, {"data": shown}])
    return outputs


class Comparisons(Case):
    def test_faults_of_an_experiment_come_at_once(self):
        file = self.write("wrong.yaml", "experiment: 1\nname: wrong\npipelin: x.yaml\nvariants: {}\n")
        with self.assertRaises(marrow.PipelineError) as caught:
            marrow.compare(file)
        self.assertGreater(len(caught.exception.faults), 1)
        self.assertIn("wrong.yaml:3:1: error: unknown key 'pipelin'", str(caught.exception))

    def test_what_the_program_refuses_is_an_error(self):
        with self.assertRaisesRegex(marrow.Error, "nowhere"):
            marrow.show(self.scratch / "nowhere", open_browser=False)


if __name__ == "__main__":
    main()
