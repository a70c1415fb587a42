# SPDX-License-Identifier: Apache-2.0
"""What the tests of nodes written in Python share: a folder of plugins, small views, and a camera."""
import contextlib
import os
import pathlib
import subprocess

import numpy
from harness.package import MARROW, SCRATCH, TEST_PLUGINS, Refusing, marrow

HEAD = """from typing import Annotated, NamedTuple, Optional
import marrow
import numpy
"""
VALUE_NODE = """
%s
@marrow.node("own.value", summary="a value")
def value(view: Annotated[marrow.View, "view"]) -> Annotated[marrow.Metrics, marrow.named("figures")]:
%s
    return marrow.Metrics({"value": VALUE})
"""


def view(seed=1, width_px=60, height_px=40):
    """A view of noise."""
    pixels = numpy.random.default_rng(seed).integers(0, 60000, (height_px, width_px)).astype("uint16")
    camera = marrow.Camera(width_px, height_px, [[1700, 0, 30], [0, 1700, 20], [0, 0, 1]], numpy.eye(4))
    return marrow.View(pixels, camera, name="frontal")


def camera():
    """A camera 600 mm from the origin of the world."""
    away = numpy.eye(4)
    away[2, 3] = 600
    return marrow.Camera(128, 96, [[1000, 0, 63.5], [0, 1000, 47.5], [0, 0, 1]], away)


def processes(file):
    """The numbers of the Python processes that hold the nodes of a file."""
    found = []
    for folder in pathlib.Path("/proc").iterdir():
        try:
            command = (folder / "cmdline").read_bytes().split(b"\0") if folder.name.isdigit() else []
        except OSError:  # it has just ended
            continue
        is_of_nodes = any(part.endswith(b"/node_process.py") for part in command)
        if is_of_nodes and os.fsencode(str(file)) in command:
            found.append(int(folder.name))
    return found


class Written(Refusing):
    """Each test has its own folder of plugins and cache of descriptions."""

    def setUp(self):
        super().setUp()
        self.plugins = self.scratch / "plugins"
        self.plugins.mkdir()
        os.environ["MARROW_PLUGIN_PATH"] = "%s:%s" % (self.plugins, TEST_PLUGINS)
        os.environ["XDG_CACHE_HOME"] = str(self.scratch / "cache")
        marrow.find_plugins_again()

    def tearDown(self):
        os.environ["MARROW_PLUGIN_PATH"] = str(TEST_PLUGINS)
        marrow.find_plugins_again()

    def plugin(self, text, name="mine.py"):
        """Writes a Python file with nodes, which is then found."""
        file = self.plugins / name
        file.write_text(HEAD + text)
        marrow.find_plugins_again()
        return file

    def node(self, at_import="", in_call=""):
        """A node that gives VALUE, which the code at the import of its file or in its call sets."""
        return self.plugin(VALUE_NODE % (at_import, "".join("    %s\n" % line for line in in_call.splitlines())))

    def module(self, place, text):
        file = self.scratch / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    @contextlib.contextmanager
    def with_variables(self, **variables):
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

    def found(self):
        """The value of the node own.value, and whether it was made again."""
        told = []
        marrow.find_plugins_again()
        figures = marrow.own.value.using(keep=True, progress=told.append)(view())
        return figures["value"], any(event["event"] == "started" for event in told)

    def program(self, *arguments, code=0):
        """Runs marrow's program; returns what it printed."""
        done = subprocess.run([str(MARROW), *map(str, arguments)], capture_output=True, text=True, cwd=self.scratch)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr


__all__ = ["HEAD", "SCRATCH", "Written", "camera", "processes", "view"]
