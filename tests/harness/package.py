# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package share: where things are, and a small simulated case."""
import atexit
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading

from harness import BUILD, MARROW, SHARED_CACHE, SOURCE, TEST_PLUGINS  # noqa: F401
from harness.program import Case, main, wait_until  # noqa: F401

FEMUR = SOURCE / "pipelines" / "femur" / "femur.yaml"
SCRATCH = pathlib.Path(tempfile.mkdtemp(prefix="marrow-python-"))
atexit.register(shutil.rmtree, SCRATCH, ignore_errors=True)
tempfile.tempdir = str(SCRATCH)  # whatever is left there goes with it
os.environ["MARROW_PLUGIN_PATH"] = str(TEST_PLUGINS)
sys.path.insert(0, str(BUILD / "python"))
SMALL = {"ct.spacing_mm": [1.2, 1.2, 1.5], "ct.range_mm": [0, 300]}  # runs in 2 seconds instead of 7

import marrow  # noqa: E402  (the path to it is set above)

_made = {}


def small_case():
    """A simulated case, made once for all tests: its folder, and the case itself."""
    if not _made:
        own = os.environ["MARROW_CACHE"]
        os.environ["MARROW_CACHE"] = str(SHARED_CACHE)
        try:
            pipeline = marrow.Pipeline(SOURCE / "pipelines" / "simulate" / "simulate.yaml").set(SMALL)
            result = pipeline.run(folder=SCRATCH / "simulated")
        finally:
            os.environ["MARROW_CACHE"] = own
        _made["case"] = (SCRATCH / "simulated" / "outputs" / "case", result["case"])
    return _made["case"]


class Refusing(Case):
    """A test of calls that fail."""

    def refuses(self, *rows, kind=marrow.Error):
        """Each row: a pattern of what is said, and a call that fails for this reason."""
        for text, call in rows:
            with self.subTest(text), self.assertRaisesRegex(kind, text):
                call()

    def fault_of(self, call, kind=marrow.PipelineError):
        """What the call raises."""
        with self.assertRaises(kind) as caught:
            call()
        return caught.exception


class PackageCase(Refusing):
    """A test with the small case, and the pipeline of the femur on it."""

    def setUp(self):
        super().setUp()
        self.folder, self.case = small_case()
        self.pipeline = marrow.Pipeline(FEMUR, case=self.folder)


def interrupt(test, call, after_s=0.5):
    """Calls while a SIGINT comes, which must end the call."""
    timer = threading.Timer(after_s, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with test.assertRaises(KeyboardInterrupt):
        call()
    timer.join()


def program(*arguments, cwd=None):
    """Runs marrow's program, which must succeed."""
    done = subprocess.run([str(MARROW), *map(str, arguments)], capture_output=True, text=True, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout
