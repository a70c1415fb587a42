# SPDX-License-Identifier: Apache-2.0
"""How tests run the program, and a folder of its own for each of them."""
import atexit
import contextlib
import csv
import fcntl
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import time
import unittest

from harness import BUILD, MARROW, TEST_PLUGINS

# A sanitizer makes everything several times slower and larger.
IS_SANITIZED = any(name in MARROW.read_bytes() for name in (b"libasan.so", b"libtsan.so"))
CACHE = pathlib.Path(tempfile.mkdtemp(prefix="marrow-cache-"))  # no test sees what another run left
atexit.register(shutil.rmtree, CACHE, ignore_errors=True)
os.environ["MARROW_CACHE"] = str(CACHE)
# Plugins that tests compile in each run anew come from ccache, if marrow itself is built with it.
LAUNCHER = re.search(r"^CMAKE_CXX_COMPILER_LAUNCHER:\w+=(.*ccache)$", (BUILD / "CMakeCache.txt").read_text(), re.M)
if LAUNCHER:
    os.environ["CMAKE_CXX_COMPILER_LAUNCHER"] = LAUNCHER.group(1)
    os.environ["CCACHE_BASEDIR"] = tempfile.gettempdir()  # the folders in it have other names each time


def marrow(*arguments, plugins=(), cwd=None, timeout=300, extra_environment=None):
    environment = dict(os.environ)
    environment["MARROW_PLUGIN_PATH"] = ":".join(str(folder) for folder in plugins)
    environment.update(extra_environment or {})
    return subprocess.run(
        [str(MARROW), *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=timeout,
        env=environment,
        errors="replace",
    )


def wait_until(condition, what, seconds=300):
    """Returns when the condition holds, which may take long on a machine that has other work."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.05)


@contextlib.contextmanager
def another_run_makes_all(store):
    """As long as this lasts, another run seems to make all that the store lacks: who needs any of it waits."""
    with open(store / "claims", "r+b") as claims:
        fcntl.fcntl(claims, 37, struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0))  # F_OFD_SETLK
        yield


def end(process):
    """Also where a test has ended before it."""
    process.kill()
    process.wait()
    for stream in (process.stdout, process.stderr):
        if stream:
            stream.close()


class Case(unittest.TestCase):
    """A test with a folder of its own, in which it runs the program.

    `plugins` are the folders of plugins that it uses besides the shipped ones, `files` are in its folder by their
    names, `environment` are further variables of all its calls. Its store of results is its own too, or, without
    `has_own_store`, that of all tests of the process.
    """

    plugins = [TEST_PLUGINS]
    environment = {}
    files = {}
    has_own_store = True

    @classmethod
    def shared_folder(cls):
        """A folder that all tests of this class share; it is deleted after them."""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow-shared-"))
        cls.addClassCleanup(shutil.rmtree, folder, ignore_errors=True)
        return folder

    def setUp(self):
        self.scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-cli-"))
        self.addCleanup(shutil.rmtree, self.scratch, ignore_errors=True)
        for name, content in self.files.items():
            self.write(name, content)

    def variables(self):
        store = {"MARROW_CACHE": str(self.scratch / "cache")} if self.has_own_store else {}
        return {**store, **self.environment}

    def marrow(self, *arguments, extra_environment=None, **more):
        """Runs the program in the test's folder."""
        usual = {"plugins": self.plugins, "cwd": self.scratch}
        environment = {**self.variables(), **(extra_environment or {})}
        return marrow(*arguments, extra_environment=environment, **{**usual, **more})

    def expect(self, status, *arguments, **more):
        """The same, for a call that ends with this status."""
        result = self.marrow(*arguments, **more)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result

    def printed(self, *arguments, **more):
        """What a call prints that succeeds."""
        return self.expect(0, *arguments, **more).stdout

    def json_of(self, *arguments, **more):
        return json.loads(self.printed(*arguments, "--json", **more))

    def refused(self, said, *arguments, status=2, **more):
        """Fails for the reason `said`, a text or several, and gives all that is said."""
        told = self.expect(status, *arguments, **more).stderr
        for text in [said] if isinstance(said, str) else said:
            self.assertIn(text, told)
        return told

    def refusals(self, *rows, status=2, **more):
        """Each row: what is said, and the words of the command."""
        for said, *words in rows:
            with self.subTest(said, words=words):
                self.refused(said, *words, status=status, **more)

    def faults(self, *rows, command=("check",), file="p.yaml", status=2):
        """What is wrong in a file: rows of its text, line, column, message and, if there is one, hint."""
        for text, line, column, message, *hints in rows:
            with self.subTest(message):
                self.write(file, text)
                places = ["%s:%d:%d: error: %s\n" % (file, line, column, message)]
                self.refused(places + ["  hint: %s\n" % hint for hint in hints], *command, file, status=status)

    def start(self, *arguments, **more):
        """Starts the program in the test's folder and goes on."""
        plugins = ":".join(map(str, self.plugins))
        usual = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": self.scratch}
        process = subprocess.Popen(
            [str(MARROW), *map(str, arguments)],
            env={**os.environ, "MARROW_PLUGIN_PATH": plugins, **self.variables()},
            **{**usual, **more}
        )
        self.addCleanup(end, process)
        return process

    def write(self, name, content):
        """A file of the test's folder; its folder is made too."""
        path = self.scratch / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def read(self, name):
        return (self.scratch / name).read_text()

    def json(self, name):
        return json.loads(self.read(name))

    def json_lines(self, name):
        return [json.loads(line) for line in self.read(name).splitlines()]

    def csv(self, name):
        with open(self.scratch / name, newline="") as stream:
            return list(csv.DictReader(stream))

    def metric(self, name):
        """The value of a file of one metric."""
        (metric,) = self.json(name)["metrics"]
        return metric["value"]

    def nodes(self, out="out"):
        """What the record of a run says of its nodes."""
        return {node["id"]: node for node in self.json(out + "/run.json")["nodes"]}

    def rows(self, out="out"):
        """The rows of a comparison's table by their cells."""
        return {row["cell"]: row for row in self.csv(out + "/cells.csv")}

    def answer(self, out="out"):
        return self.json(out + "/comparison.json")

    def page_data(self, page="out/report.html"):
        pattern = r'<script type="application/json" id="data">(.*?)</script>'
        return json.loads(re.search(pattern, self.read(page), re.S).group(1))

    def everything(self):
        """The names of all that is in the test's folder."""
        return sorted(str(path.relative_to(self.scratch)) for path in self.scratch.rglob("*"))


class SharedCase(Case):
    """All its tests look at one folder, which `make` fills before the first; what it keeps in `self`, they see."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scratch = cls.shared_folder()
        first = cls()
        first.make()
        for name, value in vars(first).items():
            if not name.startswith("_"):
                setattr(cls, name, value)

    def setUp(self):
        pass


def main():
    unittest.main(verbosity=2)
