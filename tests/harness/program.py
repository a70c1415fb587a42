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


class Case(unittest.TestCase):
    """A test with a folder of its own; `plugins` are the folders of plugins that it uses besides the shipped ones."""

    plugins = [TEST_PLUGINS]

    @classmethod
    def shared_folder(cls):
        """A folder that all tests of this class share; it is deleted after them."""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow-shared-"))
        cls.addClassCleanup(shutil.rmtree, folder, ignore_errors=True)
        return folder

    def setUp(self):
        self.scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-cli-"))

    def tearDown(self):
        shutil.rmtree(self.scratch, ignore_errors=True)

    def marrow(self, *arguments, extra_environment=None, **more):
        """Runs the program in the test's folder, with a store of results of its own."""
        environment = {"MARROW_CACHE": str(self.scratch / "cache"), **(extra_environment or {})}
        usual = {"plugins": self.plugins, "cwd": self.scratch}
        return marrow(*arguments, extra_environment=environment, **{**usual, **more})

    def rows(self, out="out"):
        """The rows of a comparison's table by their cells."""
        with open(self.scratch / out / "cells.csv", newline="") as stream:
            return {row["cell"]: row for row in csv.DictReader(stream)}

    def answer(self, out="out"):
        return json.loads((self.scratch / out / "comparison.json").read_text())

    def page_data(self, page="out/report.html"):
        text = (self.scratch / page).read_text()
        return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S).group(1))

    def write(self, name, text):
        path = self.scratch / name
        path.write_text(text)
        return path


def main():
    unittest.main(verbosity=2)
