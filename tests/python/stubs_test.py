# SPDX-License-Identifier: Apache-2.0
"""The type stubs say what is there, and type checkers find mistakes by them."""
import ast
import os
import shutil
import subprocess
import sys
import unittest

from harness.package import BUILD, TEST_PLUGINS, Case, main, marrow

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
