# SPDX-License-Identifier: Apache-2.0
"""Nodes written in Python are described as those in C++ are."""
import functools
import json
import os
import shutil
import subprocess

import numpy
from harness.package import BUILD, MARROW, SOURCE, main, marrow, small_case
from written_nodes import HEAD, Written, view

EXAMPLE = SOURCE / "docs" / "example-plugin"


@functools.cache
def twin():
    """The folder of the example-plugin in C++. It stays in marrow's build folder, and is built again if it must be."""
    build = BUILD / "tests" / "twin"
    configure = ["cmake", "-S", EXAMPLE, "-B", build, "-G", "Ninja", "-Dmarrow_DIR=%s" % BUILD]
    subprocess.run(configure, check=True, capture_output=True)
    subprocess.run(["cmake", "--build", build], check=True, capture_output=True)
    return build


class Declared(Written):
    def with_twins(self):
        os.environ["MARROW_PLUGIN_PATH"] = "%s:%s" % (self.plugins, twin())
        shutil.copy(EXAMPLE / "steepest.py", self.plugins)
        marrow.find_plugins_again()

    def test_ports_and_options_are_those_of_the_twin_in_cpp(self):
        self.with_twins()
        described = [json.loads(self.program("inspect", name, "--json")) for name in self.NAMES]
        for one in described:
            for varying in ("name", "library", "build_id"):
                one.pop(varying, None)
        self.assertEqual(described[0], described[1])
        self.assertIn("edges.steepest_python", self.program("list", "edges"))
        checked = ("check", SOURCE / "pipelines" / "femur" / "femur.yaml", "--set", "edges.uses=edges.steepest_python")
        self.program(*checked)
        self.assertIn("'lowest'", self.program(*checked, "--set", "edges.lowest=3", code=2))
        self.assertIn("below the least allowed, 0", self.program(*checked, "--set", "edges.least=-3", code=2))

    NAMES = ("edges.steepest", "edges.steepest_python")

    def test_results_are_those_of_the_twin_in_cpp(self):
        self.with_twins()
        for seen in [view(1), *small_case()[1].views.values()]:
            for least in (1, 300, 500.5, 1e9):
                found = [marrow.node(name)(seen, least=least) for name in self.NAMES]
                self.assertTrue(numpy.array_equal(found[0].pixels, found[1].pixels))
                self.assertEqual(found[0].width_px, found[1].width_px)
        self.assertGreater(len(marrow.edges.steepest_python(view(1))), 1000)

    def test_conformance(self):
        self.with_twins()
        said = self.program("conformance", "edges.steepest_python", code=1)
        failed = [line.split()[1] for line in said.splitlines() if "FAIL" in line]
        self.assertEqual(failed, ["disc_spread", "bar_spread"], "as in C++: it does not thin its edges")
        self.assertIn("23 passed, 0 do not apply, 2 failed", said)

    def test_all_that_a_signature_may_say(self):
        self.plugin(
            """
from pathlib import Path
from typing import List, Literal

class Found(NamedTuple):
    first: Annotated[marrow.Mesh, "a surface"]
    second: Annotated[Optional[marrow.Pose], "a pose"]
    many: Annotated[marrow.Items[marrow.View], marrow.over("view"), "views"]

@marrow.node("own.all", summary="all", random=True, relations=[marrow.not_above("low", "high_mm")])
def all_of_it(
    mesh: Annotated[marrow.Mesh, "mesh"],
    views: Annotated[Optional[marrow.Items[marrow.View]], marrow.over("view"), "views"] = None,
    from_: Annotated[Optional[marrow.Pose], "pose"] = None,
    *,
    context: marrow.Context,
    low: Annotated[float, marrow.at_least(1), marrow.at_most(9), "low"] = 2,
    high_mm: Annotated[int, "high"] = 3,
    word: Annotated[Literal["a", "b"], "word"] = "b",
    text: Annotated[str, "text"],
    yes: Annotated[bool, "yes"] = True,
    place: Annotated[Path, "place"] = Path("x"),
    axis: Annotated[List[float], marrow.length(3), "axis"] = [0, 0, 1],
    words: Annotated[List[str], "words"] = [],
) -> Found: ...
"""
        )
        info = marrow._core.node_info("own.all")
        ports = [(port["name"], port["type"], port["optional"], port["axis"]) for port in info["inputs"]]
        self.assertEqual(ports, [("mesh", "mesh", 0, ""), ("views", "view", 1, "view"), ("from", "pose", 1, "")])
        ports = [(port["name"], port["type"], port["optional"], port["axis"]) for port in info["outputs"]]
        self.assertEqual(ports, [("first", "mesh", 0, ""), ("second", "pose", 1, ""), ("many", "view", 1, "view")])
        self.assertTrue(info["random"])
        options = {option["name"]: option for option in info["options"]}
        types = {name: option["type"] for name, option in options.items()}
        self.assertEqual(
            types,
            dict(low="number", high_mm="integer", word="text", text="text", yes="boolean", place="path")
            | dict(axis="numbers", words="texts"),
        )
        self.assertEqual((options["low"]["minimum"], options["low"]["maximum"]), (1, 9))
        self.assertEqual((options["high_mm"]["unit"], options["low"]["unit"]), ("mm", ""))
        self.assertEqual((options["word"]["choices"], options["word"]["default"]), (["a", "b"], "b"))
        self.assertEqual([name for name, option in options.items() if option["required"]], ["text"])
        self.assertEqual(options["axis"]["default"], [0, 0, 1])

    def test_the_function_stays_a_function(self):
        scope = {"__name__": "here"}
        text = """
@marrow.node("edges.own", summary="own")
def own(view: marrow.View, *, low: Annotated[float, "low"] = 3) -> marrow.EdgeMap:
    return low + 1
"""
        exec(HEAD + text, scope)
        self.assertEqual(scope["own"](None, low=4), 5)

    def refusal(self, text, name="mine.py"):
        """What doctor says of a file."""
        file = self.plugin(text, name)
        said = self.program("doctor", code=1)
        line = next(one for one in said.splitlines() if "REFUSED" in one)
        self.assertIn(str(file), line)
        return line.partition(str(file) + ": it ")[2]

    def test_files_that_are_refused(self):
        node = '@marrow.node("edges.own", summary="own")\ndef own('
        view, edges = "view: marrow.View", ") -> marrow.EdgeMap: ...\n"
        here = "cannot be used: %s, line " % (self.plugins / "mine.py")
        high = ', *, low: Annotated[float, marrow.at_least(5), "low"] = 3'
        of_no_kind = node.replace("edges.own", "nokind.own")
        for text, expected in (
            (node + view + " -> 3\n", here + "5: SyntaxError: "),
            ("import nosuch  # @marrow.node\n", here + "4, in <module>: ModuleNotFoundError: No module"),
            (node + "view: int" + edges, "input 'view' of edges.own: expected one of marrow's"),
            (
                node + view + ") -> marrow.Cost: ...\n",
                "the output of edges.own is a function; use @marrow.cost, @marrow.optimizer or @marrow.projector",
            ),
            (node + view + "): ...\n", "the output of edges.own: expected one of marrow's values"),
            (
                node + view + ", *, low=3" + edges,
                "option 'low' of edges.own: expected bool, int, float, str, pathlib.Path, Literal of texts, or List of "
                "these, got nothing",
            ),
            (node + view + ", *, low: float = 3" + edges, "option 'low': has no line of help"),
            (node + view + high + edges, "option 'low': its default is outside its own range"),
            (
                node + "view: marrow.Items[marrow.View]" + edges,
                'a list is written Annotated[marrow.Items[marrow.View], marrow.over("view")]',
            ),
            (node + "view: marrow.Mesh" + edges, "the kind 'edges' has it as view, not mesh"),
            (of_no_kind + view + edges, "nokind.own: the kind does not name the output; name it"),
            ("# @marrow.node\n", "it declares no node; write @marrow.node before a function"),
            ("import os  # @marrow.node\nos.kill(os.getpid(), 11)\n", "crashed while being imported (Segmentation"),
            ("import os  # @marrow.node\nos._exit(3)\n", "ended the process that imported it"),
        ):
            with self.subTest(expected):
                self.assertIn(expected, self.refusal(text))

    def test_a_file_that_others_may_write_is_refused(self):
        file = self.plugin("# @marrow.node\n")
        file.chmod(0o666)
        self.assertIn("chmod go-w", self.program("doctor", code=1))

    def test_an_interpreter_that_is_not_there_or_cannot_import_the_package(self):
        self.plugin("# @marrow.node\n")
        for interpreter, text in (
            ("/nowhere/python3", "there is no Python interpreter /nowhere/python3; install"),
            (
                "/bin/false",
                "it cannot be described: /bin/false cannot import marrow's package from .*; it must have numpy and be "
                "of the version for which the package was built",
            ),
        ):
            with self.with_variables(MARROW_PYTHON=interpreter):
                self.assertRegex(self.program("doctor", code=1), text)

    def test_a_file_that_never_ends_is_described_once(self):
        begun = self.scratch / "begun"
        self.plugin("import time  # @marrow.node\nopen(%r, 'a').write('x')\ntime.sleep(1000)\n" % str(begun))
        imports = []
        for _ in range(2):
            self.assertIn("it did not say what it holds within 20 s of being imported", self.program("doctor", code=1))
            imports.append(len(begun.read_text()))
        self.assertEqual(imports[0], imports[1], "it is not imported again")


THEIRS = "import sys\nsys.path.insert(0, %r)\n"


class Trust(Written):
    """Of a module that others could change, nothing runs."""

    def setUp(self):
        super().setUp()
        self.open = self.scratch / "open"
        self.open.mkdir()
        self.mark = self.scratch / "mark"
        (self.open / "theirs.py").write_text("open(%r, 'w').close()\n" % str(self.mark))
        self.open.chmod(0o777)
        os.environ.pop("MARROW_TRUST_ALL_PLUGINS", None)
        self.addCleanup(os.environ.pop, "MARROW_TRUST_ALL_PLUGINS", None)

    def untrusted(self, path):
        return (
            "cannot be loaded, because it needs '%s', which is not trusted, because others may write to '%s' (owner "
            % (path, self.open)
        )

    def doctor(self):
        return subprocess.run([str(MARROW), "doctor"], capture_output=True, text=True, cwd=self.scratch).stdout

    def test_what_the_file_imports(self):
        self.node(THEIRS % str(self.open) + "import theirs\nVALUE = 5")
        self.assertIn("module 'theirs' " + self.untrusted(self.open / "theirs.py"), self.doctor())
        self.assertFalse(self.mark.exists())
        self.open.chmod(0o755)  # as the message says
        self.assertEqual(marrow.own.value(view())["value"], 5)
        self.assertTrue(self.mark.exists())
        self.mark.unlink()
        self.open.chmod(0o777)
        self.assertIn(self.untrusted(self.open / "theirs.py"), self.doctor(), "a kept description is no trust")
        self.assertFalse(self.mark.exists())
        os.environ["MARROW_TRUST_ALL_PLUGINS"] = "1"
        marrow.find_plugins_again()
        self.assertEqual(marrow.own.value(view())["value"], 5)

    def test_an_import_whose_error_is_caught(self):
        self.node(THEIRS % str(self.open) + "try:\n    import theirs\nexcept ImportError:\n    VALUE = 5\n")
        self.assertIn("module 'theirs' " + self.untrusted(self.open / "theirs.py"), self.doctor())
        self.assertFalse(self.mark.exists())

    def test_an_import_in_a_call(self):
        self.node(THEIRS % str(self.open), "import theirs\nVALUE = 5")
        said = str(self.fault_of(lambda: marrow.own.value(view()), marrow.RunError))
        self.assertIn("module 'theirs' " + self.untrusted(self.open / "theirs.py"), said)
        self.assertFalse(self.mark.exists())

    def test_a_folder_of_the_search_path(self):
        """The interpreter itself runs sitecustomize.py of such a folder."""
        (self.open / "theirs.py").rename(self.open / "sitecustomize.py")
        with self.with_variables(PYTHONPATH=self.open):
            self.node("VALUE = 5")
            self.assertIn(self.untrusted(self.open), self.doctor())
            self.assertFalse(self.mark.exists())


MEASURES = """
@marrow.node("evaluate.own", summary="two figures")
def own(view: Annotated[marrow.View, "view"], *, also: Annotated[str, "a further figure"] = "") -> Annotated[
        marrow.Metrics, marrow.named("metrics"), marrow.figures("mean_mm", "*.median_px")]:
    figures = {"mean_mm": 1.0, view.name + ".median_px": 2.0}
    return marrow.Metrics({**figures, **({also: 3.0} if also else {})})
"""


class Figures(Written):
    """The names of figures that a node declares, in C++ or in Python."""

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
        outputs = [(node["name"], out) for node in nodes for out in node["outputs"] if out["type"] == "metrics"]
        shipped = [(name, output) for name, output in outputs if not name.startswith(("test.", "judge.", "parse."))]
        self.assertGreater(len(shipped), 20)
        without = [name for name, output in shipped if not output["figures"]]
        self.assertEqual(without, ["run.program_metrics"], "its figures are those of the program that it runs")


if __name__ == "__main__":
    main()
