# SPDX-License-Identifier: Apache-2.0
"""Every way of changing what a node written in Python loads changes the key of its result.

The right value of each case is what plain Python gives: the module that its import rules find first. Each case writes
the number that it expects into that module.
"""
import os
import pathlib
import subprocess
import sys
import zipfile

from harness.package import main
from written_nodes import Written

OPTIONAL = "try:\n    from fast import VALUE\nexcept ImportError:\n    VALUE = 500\n"
DURING = "import importlib\n" + OPTIONAL.replace(
    "from fast import VALUE", "VALUE = importlib.import_module('fa' + 'st').VALUE"
)
VERSION = "import importlib.metadata, pictures\nVALUE = float(importlib.metadata.version('%s'))"
FIVE = "VALUE = 5\n"
# What a node imports, and then in turn: files that appear or, with None, go (places in the test's folder), and values
# that are then right.
FILES = {
    "a part of a package that appears": (
        OPTIONAL.replace("fast", "parts.fast"),
        *(("plugins/parts/__init__.py", ""), 500, ("plugins/parts/fast.py", FIVE), 5),
    ),
    "a folder that becomes a package": (
        "import portion.part\nVALUE = getattr(portion, 'VALUE', 500)",
        *(("plugins/portion/part.py", ""), 500, ("plugins/portion/__init__.py", FIVE), 5),
    ),
    "a module that shadows one of the standard library": (
        "import colorsys\nVALUE = getattr(colorsys, 'VALUE', 1)",
        *(1, ("plugins/colorsys.py", FIVE), 5),
    ),
    "on the search path, an optional module that appears": (OPTIONAL, 500, ("path/fast.py", FIVE), 5),
    "on the search path, a module that shadows another, and a package that comes before a module": (
        "from helper import VALUE",
        *(("second/helper.py", FIVE), 5, ("path/helper.py", "VALUE = 4\n"), 4),
        *(("plugins/helper.py", "VALUE = 6\n"), 6, ("plugins/helper/__init__.py", "VALUE = 7\n"), 7),
    ),
    "on the search path, what runs at the start of the interpreter": (
        "import builtins\nVALUE = getattr(builtins, 'VALUE', 1)",
        *(1, ("path/usercustomize.py", "import builtins\nbuiltins.VALUE = 2\n")),
        2 if not sys.flags.no_user_site else 1,
    ),
    "an installed module that is edited": (
        "from helper.inner import VALUE",
        *(("site-packages/helper/__init__.py", ""), ("site-packages/helper/inner.py", "VALUE = 1\n"), 1),
        *(("site-packages/helper/inner.py", "VALUE = 2\n"), 2),
    ),
}


class Loaded(Written):
    def kept(self, value):
        """Runs until the result is kept, which it is once everything that it depends on is known."""
        for _ in range(3):
            found = self.found()
            self.assertEqual(found[0], value)
            if not found[1]:
                return
        self.fail("the result is never kept")

    def test_an_optional_module_that_appears_beside_the_file(self):
        self.node(OPTIONAL)
        self.assertEqual(self.found(), (500, True))
        self.assertEqual(self.found(), (500, False), "what is looked for and not there is no reason not to keep it")
        module = self.module("plugins/fast.py", "VALUE = 5\n")
        self.kept(5)
        module.unlink()
        self.kept(500)

    def test_files_that_appear_or_change(self):
        for name, (code, *steps) in FILES.items():
            with self.subTest(name):
                self.setUp()  # each has a folder of its own
                path = ":".join(str(self.scratch / folder) for folder in ("path", "second", "site-packages"))
                with self.with_variables(PYTHONPATH=path):
                    self.node(code)
                    for step in steps:
                        if isinstance(step, tuple):
                            self.module(*step)
                        else:
                            self.kept(step)

    def test_an_optional_module_that_appears_during_later_calls(self):
        for name, code in (("named in the text", OPTIONAL), ("named during the call", DURING)):
            with self.subTest(name):
                self.node(in_call=code)
                self.kept(500)
                module = self.module("plugins/fast.py", "VALUE = 5\n")
                self.kept(5)
                module.unlink()

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
        version = "python%d.%d" % sys.version_info[:2]
        site = "user/lib/%s/site-packages" % version
        with self.with_variables(PYTHONUSERBASE=self.scratch / "user", PYTHONNOUSERSITE=None):
            self.node(OPTIONAL)
            self.kept(500)
            self.module(site + "/fast.py", "VALUE = 5\n")  # the folder was not there before
            self.kept(5)
            with self.with_variables(PYTHONNOUSERSITE="1"):
                self.kept(500)
            self.kept(5)
            self.module(site + "/more.pth", "import sys; sys.path.insert(0, %r)\n" % str(self.scratch / "more"))
            self.module("more/fast.py", "VALUE = 8\n")
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

    def test_bytecode_of_the_search_path_is_not_trusted(self):
        import py_compile

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


if __name__ == "__main__":
    main()
