# SPDX-License-Identifier: Apache-2.0
"""What the tests here share: runs of shipped pipelines on small data, and the program that recomputes their figures."""
import pathlib
import re
import subprocess
import sys

from harness import MARROW, SOURCE, need_scipy
from harness.program import marrow

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
need_scipy()


def run(folder, pipeline, *arguments):
    """The folder of a run of a shipped pipeline."""
    ended = marrow("run", SOURCE / "pipelines" / pipeline, "--out", folder, "--quiet", *arguments, timeout=1200)
    assert ended.returncode in (0, 3), ended.stderr
    return folder


def recompute(folder, *arguments):
    """(exit code, all that the program says)"""
    command = [sys.executable, HERE / "recompute.py", folder, *arguments]
    ended = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=1200)
    return ended.returncode, ended.stdout + ended.stderr


def recompute_all(folder):
    """The same, with the values that the run itself does not write."""
    return recompute(folder, "--marrow", MARROW)


def counts(said):
    """(recomputed, different, not recomputed)"""
    return tuple(int(number) for number in re.findall(r"\d+", said.splitlines()[-1]))


def different(said):
    """{"value figure"} of the lines that tell of a difference."""
    return {" ".join(line.split()[:2]) for line in said.splitlines() if line.endswith("DIFFERENT")}
