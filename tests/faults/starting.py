# SPDX-License-Identifier: Apache-2.0
"""What the programs of this folder share: their command line, the program under test, and how they end."""
import argparse
import contextlib
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile

from subjects import Program

from harness import BUILD
from harness.sample import ALL, SEED, sample  # noqa: F401

SKIPPED = 77  # ctest's SKIP_RETURN_CODE


def arguments_parser(description):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--build", type=pathlib.Path, default=BUILD, help="the build folder")
    parser.add_argument("--all", action="store_true", help="the whole, not a sample")
    drawn = random.Random(SEED).randrange(10**6)
    said = "of what is drawn by chance (default: the same in each run)"
    parser.add_argument("--seed", type=int, default=drawn, help=said)
    parser.add_argument("--jobs", type=int, default=2, help="how many at once (default: 2)")
    return parser


def is_sanitized(program):
    """A sanitizer's library must be the first that is loaded, and reserves more memory than there is."""
    libraries = subprocess.run(["readelf", "-d", str(program)], capture_output=True, text=True).stdout
    return any(name in libraries for name in ("libasan", "libtsan", "libubsan", "libclang_rt"))


@contextlib.contextmanager
def program_of(options):
    if is_sanitized(options.build / "bin" / "marrow"):
        print("skipped: the program is built with a sanitizer")
        sys.exit(SKIPPED)
    print("drawn with --seed %d" % options.seed, flush=True)
    os.umask(0o022)
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-faults-"))
    try:
        yield Program(options.build.resolve(), scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def conclude(what, failures):
    print("%s, %d failures" % (what, len(failures)))
    return 1 if failures else 0
