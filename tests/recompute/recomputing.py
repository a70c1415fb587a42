# SPDX-License-Identifier: Apache-2.0
"""What the tests here share: runs of shipped pipelines on small data, and the program that recomputes their figures."""
import contextlib
import io
import re
import sys

from harness import MARROW, SOURCE, need_scipy
from harness.program import marrow

sys.dont_write_bytecode = True
need_scipy("PIL")  # before the module below
import recompute as program  # noqa: E402


def run(folder, pipeline, *arguments):
    """The folder of a run of a shipped pipeline."""
    ended = marrow("run", SOURCE / "pipelines" / pipeline, "--out", folder, "--quiet", *arguments, timeout=1200)
    assert ended.returncode in (0, 3), ended.stderr
    return folder


def recompute(folder, *arguments):
    """(exit code, all that the program says)"""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        code = program.main([str(word) for word in (folder, *arguments)])
    return code, said.getvalue()


def recompute_all(folder):
    """The same, with the values that the run itself does not write."""
    return recompute(folder, "--marrow", MARROW)


def counts(said):
    """(recomputed, different, not recomputed)"""
    return tuple(int(number) for number in re.findall(r"\d+", said.splitlines()[-1]))


def different(said):
    """{"value figure"} of the lines that tell of a difference."""
    return {" ".join(line.split()[:2]) for line in said.splitlines() if line.endswith("DIFFERENT")}
