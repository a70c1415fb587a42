# SPDX-License-Identifier: Apache-2.0
"""The compiler has nothing to say of marrow's sources: each is compiled as the build does it, with warnings as errors.
"""
import json
import pathlib
import re
import shlex
import subprocess
import tempfile
import unittest

from harness import BUILD
from harness.sample import sample

MUST_NOT_COMPILE = ("forgotten_field.cpp",)
HAVE_WARNED = ("plugins/deviations/calibrated.cpp",)  # compiled each time


def launcher():
    """ccache, if marrow is built with it."""
    return re.findall(r"^CMAKE_CXX_COMPILER_LAUNCHER:\w+=(.+ccache)$", (BUILD / "CMakeCache.txt").read_text(), re.M)


class Warnings(unittest.TestCase):
    def test_a_build_prints_no_warning(self):
        units = json.loads((BUILD / "compile_commands.json").read_text())
        units = [unit for unit in units if not unit["file"].endswith(MUST_NOT_COMPILE)]
        with tempfile.TemporaryDirectory(prefix="marrow-warnings-") as scratch:
            for unit in [unit for unit in units if unit["file"].endswith(HAVE_WARNED)] + sample(units, 4):
                words = shlex.split(unit["command"])
                words[words.index("-o") + 1] = str(pathlib.Path(scratch, "unit.o"))
                done = subprocess.run(
                    [*launcher(), *words, "-Werror"], cwd=unit["directory"], capture_output=True, text=True
                )
                with self.subTest(unit["file"]):
                    self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main(verbosity=2)
