# SPDX-License-Identifier: Apache-2.0
"""Every way of changing what a node written in Python has loaded changes the key of its result.

The right value of each case is what plain Python gives. Each case writes the number that it expects into the module.
"""
import contextlib
import os
import pathlib
import subprocess
import sys
import zipfile

from harness.package import main
from written_nodes import Written

NODE = """
%s
@marrow.node("own.value", summary="a value")
def value(view: Annotated[marrow.View, "view"]) -> Annotated[marrow.Metrics, marrow.named("figures")]:
%s
    return marrow.Metrics({"value": VALUE})
"""


class Loaded(Written):
    def node(self, at_import="", in_call=""):
        """A node that gives VALUE, which the code at the import of its file or in its call sets."""
        return self.plugin(NODE % (at_import, "".join("    %s\n" % line for line in in_call.splitlines())))

    def module(self, place, text):
        file = self.scratch / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    @contextlib.contextmanager
    def environment(self, **variables):
        """These variables, of which None is not set, for this process and those that it starts."""
        before = dict(os.environ)
        for name, text in variables.items():
            os.environ.pop(name, None)
            if text is not None:
                os.environ[name] = str(text)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)

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
            with self.environment(PYTHONPATH=self.scratch / "l.zip"):
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
            with self.environment(PYTHONPATH="modules"):
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
        with self.environment(PYTHONUSERBASE=self.scratch / "user", PYTHONNOUSERSITE=None):
            self.node("try:\n    from fast import VALUE\nexcept ImportError:\n    VALUE = 500\n")
            self.kept(5)
            with self.environment(PYTHONNOUSERSITE="1"):
                self.kept(500)
            self.kept(5)
            more.write_text(more.read_text().replace("one", "two"))
            self.kept(8)

    def test_flags_of_the_interpreter(self):
        self.node("VALUE = 1 if __debug__ else 2")  # assert does nothing with PYTHONOPTIMIZE
        self.kept(1)
        with self.environment(PYTHONOPTIMIZE="1"):
            self.kept(2)
        self.kept(1)

    def test_another_interpreter(self):
        self.node("import sys\nVALUE = len(sys.executable)")
        for name in ("python", "python-of-another-name"):
            link = self.scratch / name
            link.symlink_to("/usr/bin/python3")
            with self.environment(MARROW_PYTHON=link):
                self.kept(len(str(link)))

    def test_a_distribution_of_another_name_than_its_package(self):
        """As Pillow 9.4 and 9.5: the package is PIL, and its first file is the same in both."""
        for listed, lines in (("top_level.txt", "pictures\n"), ("RECORD", "pictures/__init__.py,,\n")):
            with self.subTest(listed), self.environment(PYTHONPATH=self.scratch / listed / "site-packages"):
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
        with self.environment(PYTHONPATH=self.scratch / "site-packages"):
            module = self.module("site-packages/helper/inner.py", "VALUE = 1\n")
            self.module("site-packages/helper/__init__.py", "")
            self.node("from helper.inner import VALUE")
            self.kept(1)
            module.write_text("VALUE = 2\n")
            self.kept(2)

    def test_bytecode_of_the_search_path_is_not_trusted(self):
        import py_compile

        with self.environment(PYTHONPATH=self.scratch / "path"):
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
        with self.environment(PYTHONPATH=folder):
            self.node("from helper import VALUE")
            self.kept(1)
            (folder / "helper.py").write_text("VALUE = 2\n")
            self.kept(2)


VERSION = "import importlib.metadata, pictures\nVALUE = float(importlib.metadata.version('%s'))"

if __name__ == "__main__":
    main()
