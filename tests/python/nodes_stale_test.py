# SPDX-License-Identifier: Apache-2.0
"""Results of nodes written in Python are kept, and made again when anything that decides them has changed."""
import json
import os
import py_compile

from harness.package import main, marrow
from written_nodes import Written, view

NODE = """
@marrow.node("own.value", summary="a value")
def value(view: Annotated[marrow.View, "view"]) -> Annotated[marrow.Metrics, marrow.named("figures")]:
    print("CALLED")
    %s
"""


class Stale(Written):
    def test_a_result_is_kept_until_the_file_changes(self):
        text = NODE % 'return marrow.Metrics({"value": %d})'
        self.plugin(text % 1)
        self.assertEqual(self.found(), (1, True))
        self.assertEqual(self.found(), (1, False))
        self.plugin(text % 2)
        self.assertEqual(self.found(), (2, True))

    def test_an_imported_module_counts(self):
        helper = self.plugins / "helper.py"
        helper.write_text("VALUE = 1\n")
        self.plugin("import helper\n" + NODE % 'return marrow.Metrics({"value": helper.VALUE})')
        self.assertEqual(self.found(), (1, True))
        self.assertEqual(self.found(), (1, False))
        helper.write_text("VALUE = 2\n")
        self.assertEqual(self.found(), (2, True))
        self.assertEqual(self.found(), (2, False))

    def test_a_module_that_is_imported_inside_of_the_call_counts(self):
        (self.plugins / "parts").mkdir()
        helper = self.plugins / "parts" / "helper.py"
        (self.plugins / "parts" / "__init__.py").write_text("")
        helper.write_text("VALUE = 1\n")
        self.plugin(NODE % 'from parts import helper\n    return marrow.Metrics({"value": helper.VALUE})')
        self.assertEqual(self.found(), (1, True))
        self.assertEqual(self.found(), (1, False))
        helper.write_text("VALUE = 2\n")
        self.assertEqual(self.found(), (2, True))

    def test_a_module_whose_name_is_known_only_during_the_call_counts(self):
        helper = self.plugins / "helper.py"
        helper.write_text("VALUE = 1\n")
        self.plugin(
            "import importlib\n"
            + NODE
            % 'helper = importlib.import_module("hel" + "per")\n    return marrow.Metrics({"value": helper.VALUE})'
        )
        self.assertEqual(self.found(), (1, True))
        self.assertEqual(self.found(), (1, True), "the first result had a key without the module, so it was not kept")
        self.assertEqual(self.found(), (1, False))
        helper.write_text("VALUE = 2\n")
        self.assertEqual(self.found(), (2, True))

    def test_bytecode_that_is_kept_is_not_trusted(self):
        helper = self.plugins / "helper.py"
        helper.write_text("VALUE = 1\n")
        py_compile.compile(str(helper))
        time = helper.stat().st_mtime_ns
        helper.write_text("VALUE = 2\n")
        os.utime(helper, ns=(time, time))  # as if both were written within one second
        self.plugin("import helper\n" + NODE % 'return marrow.Metrics({"value": helper.VALUE})')
        self.assertEqual(self.found(), (2, True))

    def test_a_file_that_changes_during_a_program(self):
        file = self.plugin(NODE % 'return marrow.Metrics({"value": 1})')
        node = marrow.own.value
        file.write_text(file.read_text().replace("1}", "2}"))
        with self.assertRaisesRegex(
            marrow.RunError, "mine.py or a module that it imports was changed since this program"
        ):
            node(view())

    def test_a_run_records_the_interpreter(self):
        self.plugin(
            """
@marrow.node("own.value", summary="a value")
def value(camera: Annotated[Optional[marrow.Camera], "none"] = None) -> Annotated[
        marrow.Metrics, marrow.named("figures")]:
    return marrow.Metrics({"value": 3})
"""
        )
        pipeline = self.write("p.yaml", "marrow: 1\nnodes:\n  a: {uses: own.value}\noutputs: {a: a.figures}\n")
        self.program("run", pipeline, "--out", self.scratch / "out")
        record = json.loads((self.scratch / "out" / "run.json").read_text())
        plugin = next(one for one in record["plugins"] if one["file"] == "mine.py")
        self.assertEqual(plugin["interpreter"], os.path.realpath("/usr/bin/python3"))

    def test_what_a_node_depends_on(self):
        file = self.plugin("import json\n" + NODE % 'return marrow.Metrics({"value": 1})')
        info = json.loads(self.program("doctor", "--json"))
        self.assertIn(str(file), [one["file"] for one in info["libraries"]])
        kept = list((self.scratch / "cache" / "marrow" / "libraries").glob("*.json"))
        linked = [one for path in kept for one in json.loads(path.read_text())["linked"]]
        names = {one["path"] for one in linked}
        self.assertTrue(any("python3" in os.path.basename(name) for name in names), "the interpreter")
        self.assertTrue(
            any(name.endswith("PKG-INFO") or name.endswith("METADATA") for name in names), "numpy's version"
        )
        self.assertFalse(any(name.endswith("json/__init__.py") for name in names), "the interpreter stands for it")


if __name__ == "__main__":
    main()
