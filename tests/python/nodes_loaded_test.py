# SPDX-License-Identifier: Apache-2.0
"""Every way of changing what a node written in Python has loaded changes the key of its result.

The right value of each case is what plain Python gives. Each case writes the number that it expects into the module.
"""
import json
import os
import pathlib
import py_compile
import subprocess
import sys
import zipfile

from harness.package import main, marrow
from written_nodes import Written, view


class Loaded(Written):
    def kept(self, value):
        """Runs until the result is kept, which it is once everything that it depends on is known."""
        for _ in range(3):
            found = self.found()
            self.assertEqual(found[0], value)
            if not found[1]:
                return
        self.fail("the result is never kept")

    def test_a_module_in_an_archive(self):
        for value in (1, 2):
            with zipfile.ZipFile(self.scratch / "l.zip", "w") as archive:
                archive.writestr("packed.py", "VALUE = %d\n" % value)
            with self.with_variables(PYTHONPATH=self.scratch / "l.zip"):
                if value == 1:
                    self.node("from packed import VALUE")
                self.kept(value)

    def test_a_link_that_leads_elsewhere(self):
        self.module("one.py", "VALUE = 1\n")
        self.module("two.py", "VALUE = 2\n")
        link = self.plugins / "helper.py"
        link.symlink_to(self.scratch / "one.py")
        self.node("from helper import VALUE")
        self.kept(1)
        link.unlink()
        link.symlink_to(self.scratch / "two.py")
        self.kept(2)

    def test_a_relative_search_path_is_of_the_working_folder(self):
        self.node("from helper import VALUE")
        here = os.getcwd()
        try:
            with self.with_variables(PYTHONPATH="modules"):
                for value in (1, 2):
                    self.module("work%d/modules/helper.py" % value, "VALUE = %d\n" % value)
                    os.chdir(self.scratch / ("work%d" % value))
                    self.kept(value)
        finally:
            os.chdir(here)

    def test_folders_of_the_user(self):
        site = "user/lib/python%d.%d/site-packages" % sys.version_info[:2]
        more = self.module(site + "/more.pth", "import sys; sys.path.insert(0, %r)\n" % str(self.scratch / "one"))
        self.module("one/fast.py", "VALUE = 5\n")
        self.module("two/fast.py", "VALUE = 8\n")
        with self.with_variables(PYTHONUSERBASE=self.scratch / "user", PYTHONNOUSERSITE=None):
            self.node("try:\n    from fast import VALUE\nexcept ImportError:\n    VALUE = 500\n")
            self.kept(5)
            with self.with_variables(PYTHONNOUSERSITE="1"):
                self.kept(500)
            self.kept(5)
            more.write_text(more.read_text().replace("one", "two"))
            self.kept(8)

    def test_flags_of_the_interpreter(self):
        self.node("VALUE = 1 if __debug__ else 2")  # assert does nothing with PYTHONOPTIMIZE
        self.kept(1)
        with self.with_variables(PYTHONOPTIMIZE="1"):
            self.kept(2)
        self.kept(1)

    def test_another_interpreter(self):
        self.node("import sys\nVALUE = len(sys.executable)")
        for name in ("python", "python-of-another-name"):
            link = self.scratch / name
            link.symlink_to("/usr/bin/python3")
            with self.with_variables(MARROW_PYTHON=link):
                self.kept(len(str(link)))

    def test_a_distribution_of_another_name_than_its_package(self):
        """As Pillow 9.4 and 9.5: the package is PIL, and its first file is the same in both."""
        for listed, lines in (("top_level.txt", "pictures\n"), ("RECORD", "pictures/__init__.py,,\n")):
            with self.subTest(listed), self.with_variables(PYTHONPATH=self.scratch / listed / "site-packages"):
                site = listed + "/site-packages/"
                self.module(site + "pictures/__init__.py", "from .version import VALUE\n")
                self.module(site + "pictures/version.py", "VALUE = 94\n")
                told = self.module(site + "Cushion-9.4.dist-info/METADATA", "Name: Cushion\nVersion: 9.4\n")
                self.module(site + "Cushion-9.4.dist-info/" + listed, lines)
                self.node("from pictures import VALUE")
                self.kept(94)
                self.module(site + "pictures/version.py", "VALUE = 95\n")
                self.kept(95)
                self.node(VERSION % "Cushion")
                self.kept(9.4)
                told.write_text("Name: Cushion\nVersion: 9.5\n")
                self.kept(9.5)

    def test_an_installed_module_that_is_edited(self):
        with self.with_variables(PYTHONPATH=self.scratch / "site-packages"):
            module = self.module("site-packages/helper/inner.py", "VALUE = 1\n")
            self.module("site-packages/helper/__init__.py", "")
            self.node("from helper.inner import VALUE")
            self.kept(1)
            module.write_text("VALUE = 2\n")
            self.kept(2)

    def test_bytecode_of_the_search_path_is_not_trusted(self):
        with self.with_variables(PYTHONPATH=self.scratch / "path"):
            helper = self.module("path/helper.py", "VALUE = 1\n")
            py_compile.compile(str(helper))
            time = helper.stat().st_mtime_ns
            helper.write_text("VALUE = 2\n")
            os.utime(helper, ns=(time, time))  # as if both were written within one second
            self.node("from helper import VALUE")
            self.kept(2)

    def test_a_shared_library(self):
        library = self.scratch / "libvalue.so"
        self.node("import ctypes\nVALUE = ctypes.CDLL(%r).value()" % str(library))
        for value in (1, 2):
            new = self.scratch / "new.so"
            source = self.module("value.c", "int value(void) { return %d; }\n" % value)
            subprocess.run(["cc", "-shared", "-fPIC", "-o", str(new), str(source)], check=True)
            new.replace(library)
            self.kept(value)

    def test_a_folder_whose_name_is_not_utf_8(self):
        folder = pathlib.Path(os.fsdecode(os.fsencode(self.scratch) + b"/caf\xe9"))
        folder.mkdir()
        (folder / "helper.py").write_text("VALUE = 1\n")
        with self.with_variables(PYTHONPATH=folder):
            self.node("from helper import VALUE")
            self.kept(1)
            (folder / "helper.py").write_text("VALUE = 2\n")
            self.kept(2)


VERSION = "import importlib.metadata, pictures\nVALUE = float(importlib.metadata.version('%s'))"


class Stale(Written):
    """Results are kept, and made again when anything that decides them has changed."""

    def found_are(self, *expected):
        """What own.value gives, call after call, and whether it was made again."""
        self.assertEqual([self.found() for _ in expected], list(expected))

    def helper(self, value, place="helper.py"):
        (self.plugins / place).parent.mkdir(exist_ok=True)
        (self.plugins / place).write_text("VALUE = %d\n" % value)
        return self.plugins / place

    def test_a_result_is_kept_until_the_file_changes(self):
        self.node(in_call="VALUE = 1")
        self.found_are((1, True), (1, False))
        self.node(in_call="VALUE = 2")
        self.found_are((2, True))

    def test_an_imported_module_counts(self):
        self.helper(1)
        self.node("import helper", "VALUE = helper.VALUE")
        self.found_are((1, True), (1, False))
        self.helper(2)
        self.found_are((2, True), (2, False))

    def test_a_module_that_is_imported_inside_of_the_call_counts(self):
        self.helper(1, "parts/helper.py")
        (self.plugins / "parts" / "__init__.py").write_text("")
        self.node(in_call="from parts import helper\nVALUE = helper.VALUE")
        self.found_are((1, True), (1, False))
        self.helper(2, "parts/helper.py")
        self.found_are((2, True))

    def test_a_module_whose_name_is_known_only_during_the_call_counts(self):
        self.helper(1)
        self.node("import importlib", 'helper = importlib.import_module("hel" + "per")\nVALUE = helper.VALUE')
        # The first result had a key without the module, so it was not kept.
        self.found_are((1, True), (1, True), (1, False))
        self.helper(2)
        self.found_are((2, True))

    def test_bytecode_that_is_kept_is_not_trusted(self):
        helper = self.helper(1)
        py_compile.compile(str(helper))
        time = helper.stat().st_mtime_ns
        self.helper(2)
        os.utime(helper, ns=(time, time))  # as if both were written within one second
        self.node("import helper", "VALUE = helper.VALUE")
        self.found_are((2, True))

    def test_a_file_that_changes_during_a_program(self):
        file = self.node(in_call="VALUE = 1")
        node = marrow.own.value
        file.write_text(file.read_text().replace("VALUE = 1", "VALUE = 2"))
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
        file = self.node("import json", "VALUE = 1")
        info = json.loads(self.program("doctor", "--json"))
        self.assertIn(str(file), [one["file"] for one in info["libraries"]])
        kept = list((self.scratch / "cache" / "marrow" / "libraries").glob("*.json"))
        linked = [one for path in kept for one in json.loads(path.read_text())["linked"]]
        names = {one["path"] for one in linked}
        self.assertTrue(any("python3" in os.path.basename(name) for name in names), "the interpreter")
        self.assertTrue(any(name.endswith(("PKG-INFO", "METADATA")) for name in names), "numpy's version")
        self.assertFalse(any(name.endswith("json/__init__.py") for name in names), "the interpreter stands for it")


if __name__ == "__main__":
    main()
