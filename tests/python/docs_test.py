# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/python.md and the notebooks run as they stand; the type stubs."""
import ast
import contextlib
import importlib.util
import io
import json
import os
import re
import shutil
import subprocess
import sys
import unittest

import numpy
from harness.package import BUILD, SOURCE, TEST_PLUGINS, Case, main, marrow, small_case

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
            variants = comparison.variants
            self.assertEqual(list(variants.to_pandas()["variant"]), [row["variant"] for row in variants])

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


PACKAGE = BUILD / "python"
USE = """import marrow
edges = marrow.edges.canny(marrow.View([[1]], marrow.Camera(1, 1, [[1]], [[1]])), noise_high=5)
marrow.edges.canny.using(threads=2)
print(marrow.Pipeline("a.yaml", case="b").run(only=["pose"])["pose"], edges)
print(marrow.optimizer.nelder_mead().minimise(lambda x: float(x @ x), [1], [1]).x)

@marrow.optimizer("optimizer.mine", summary="mine")
def mine(problem: marrow.Problem, *, factor: float = 0.5) -> str:
    problem(problem.start)
    return "no reason"
"""
MISTAKES = """import marrow
marrow.edges.canny(5)
marrow.edges.canny(hihg=5)
marrow.Pose([[1]]).matrx
"""


def members(node):
    """The public names that a class of a stub declares."""
    named = [one.name for one in node.body if isinstance(one, ast.FunctionDef)]
    named += [one.target.id for one in node.body if isinstance(one, ast.AnnAssign)]
    return {name for name in named if not name.startswith("_")}


class Stubs(Case):
    """The type stubs say what is there, and type checkers find mistakes by them."""

    def test_the_stub_of_the_extension_has_all_that_is_there(self):
        declared, bases = {}, {}
        for node in ast.parse((PACKAGE / "marrow" / "_core.pyi").read_text()).body:
            if isinstance(node, ast.ClassDef):
                declared[node.name], bases[node.name] = members(node), [base.id for base in node.bases]
            elif isinstance(node, ast.FunctionDef):
                declared[node.name] = None
        core = marrow._core
        there = {name for name in dir(core) if not name.startswith("_")}
        self.assertEqual(there, {name for name in declared if not name.startswith("_")})
        for name in there:
            if declared[name] is None:
                continue
            expected = declared[name].union(*(declared[base] for base in bases[name]))
            self.assertEqual(
                {one for one in dir(getattr(core, name)) if not one.startswith("_")} - {"type"},
                expected - {"type"},
                name,
            )

    def test_the_stub_of_the_package_has_all_that_is_there(self):
        tree = ast.parse((PACKAGE / "marrow" / "__init__.pyi").read_text())
        declared = {alias.asname for node in tree.body for alias in node.names} - {None, "__version__"}
        modules = {file.stem for file in (PACKAGE / "marrow").glob("*.py")}
        self.assertEqual(declared | {"Kind", "Node", "node"}, set(marrow.__all__) - modules)
        for name in marrow._core.node_names():
            if not name.startswith(("test.", "parse.", "judge.")):  # of the tests' own plugins
                self.assertIn("    %s: _" % name.split(".")[1], (PACKAGE / "marrow" / "nodes.pyi").read_text())

    def test_they_are_written_anew_with_ones_own_plugins(self):
        environment = {**os.environ, "PYTHONPATH": str(PACKAGE), "MARROW_PLUGIN_PATH": str(TEST_PLUGINS)}
        file = self.scratch / "nodes.pyi"
        subprocess.run([sys.executable, "-m", "marrow.stubs", file], env=environment, check=True)
        self.assertIn(
            "class _TestAddNode(Node):\n    def __call__(\n        self,\n        a: _One[Metrics],", file.read_text()
        )
        wrong = subprocess.run([sys.executable, "-m", "marrow.stubs"], env=environment, capture_output=True, text=True)
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("python3 -m marrow.stubs FILE", wrong.stderr)

    @unittest.skipUnless(shutil.which("mypy"), "mypy is missing: apt-get install mypy")
    def test_a_type_checker_finds_mistakes_and_nothing_else(self):
        def check(*files):
            command = ["mypy", "--strict", "--cache-dir", self.scratch / "cache", *files]
            environment = {**os.environ, "MYPYPATH": str(PACKAGE)}
            return subprocess.run(command, env=environment, cwd=self.scratch, capture_output=True, text=True).stdout

        self.assertIn("Success", check("-p", "marrow"))
        self.assertIn("Success", check(self.write("use.py", USE)))
        found = check(self.write("mistakes.py", MISTAKES))
        self.assertIn('mistakes.py:2: error: Argument 1 to "__call__"', found)
        self.assertIn('mistakes.py:3: error: Unexpected keyword argument "hihg"', found)
        self.assertIn('mistakes.py:4: error: "Pose" has no attribute "matrx"', found)
        self.assertIn("Found 3 errors", found)


if __name__ == "__main__":
    main()
