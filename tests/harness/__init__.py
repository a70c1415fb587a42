# SPDX-License-Identifier: Apache-2.0
"""What all tests in Python share: where things are. The modules beside it run the program, draw samples and show pages.

A test is started with the folder tests/ in PYTHONPATH, as ctest does. MARROW_BUILD is the build folder (default:
build).
"""
import importlib.util
import os
import pathlib
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("MARROW_BUILD") or SOURCE / "build").resolve()
MARROW = BUILD / "bin" / "marrow"
TEST_PLUGINS = BUILD / "tests" / "plugins"
SHARED_CACHE = BUILD / "tests" / "store"  # of simulated cases, which are the same in many tests


def skip(reason):
    """Ends the whole test: ctest shows it as skipped."""
    print("skipped:", reason)
    sys.exit(77)


def need_scipy(*more):
    """Skips the whole test where numpy, scipy or another module is missing."""
    if not all(importlib.util.find_spec(name) for name in ("numpy", "scipy", *more)):
        skip("numpy, scipy or Pillow is missing: apt-get install python3-scipy python3-pil")
