#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures what the tables and the page of large comparisons cost: 10 variants, 10 starts and as many cases as give the
number of cells, with made-up rows, as if all cells had run.

    tests/benchmarks/report_cost.py BUILD [CELLS ...]

Prints a row for each number of cells: the seconds, the seconds of processor time and the peak memory of `marrow
compare`, which finds all cells there and writes tables and page; the size of the page; and how many seconds headless
Chromium takes until the page is ready (the best of three). The load of the machine is printed beside it. Times include
the reading of all rows and the check that they still hold.
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from harness import browser

PIPELINE = """marrow: 1
nodes:
  seed: {uses: test.draw}
  start: {uses: test.displaced}
  c: {uses: test.constant}
  m: {uses: test.add, in: {a: start, b: seed}}
  e: {uses: test.add, in: {a: m, b: c}}
outputs: {m: m, e: e}
"""
EXPERIMENT = """experiment: 1
name: cost
pipeline: pipeline.yaml
cases: {seeds: 1..%d}
metrics: [m.value, e.value]
initial_error: m.value
success: {e.value: 2}
timed_cells: 0
starts: {node: start, count: 10, rotation_deg: 10, translation_mm: 10}
variants:
"""


def measured(command, environment):
    """Seconds, seconds of processor time and peak memory (MB) of a command."""
    begin = time.monotonic()
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0, command
    return time.monotonic() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def measure(build, cells, folder, window):
    (folder / "pipeline.yaml").write_text(PIPELINE)
    names = "".join("  high-%d: {c.value: %d}\n" % (60 + 5 * i, i) for i in range(10))
    experiment, out = folder / "experiment.yaml", folder / "out"
    experiment.write_text(EXPERIMENT % (cells // 100) + names)
    out.mkdir()
    (out / "marrow-comparison").write_text(
        "This folder is a comparison of marrow, which changes and removes what is in it.\nexperiment: cost\n"
    )
    environment = dict(
        os.environ, MARROW_PLUGIN_PATH=str(build / "tests" / "plugins"), MARROW_CACHE=str(folder / "cache")
    )
    rows = {"LD_PRELOAD": str(build / "lib" / "comparison_rows.so")}
    rows |= {"MADE_UP_ROWS_OF": str(experiment), "MADE_UP_ROWS_IN": str(out)}
    subprocess.run([build / "bin" / "marrow"], env=dict(environment, **rows), check=True)
    command = [build / "bin" / "marrow", "compare", experiment, "--out", out, "--shown", "0", "--quiet"]
    seconds, processor_s, memory_mb = measured(command, environment)
    page = out / "report.html"
    ready = min(window.open(page) for _ in range(3)) if window else float("nan")
    size_mb = page.stat().st_size / 1e6
    row = (cells, seconds, processor_s, memory_mb, size_mb, ready)
    print("| %6d | %6.1f | %6.1f | %5.0f | %5.1f | %5.2f |" % row, flush=True)
    print("load %.1f" % os.getloadavg()[0], file=sys.stderr)


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    window = None if browser.missing() else browser.Browser()
    for cells in map(int, sys.argv[2:] or ("100", "1000", "10000", "100000")):
        with tempfile.TemporaryDirectory() as folder:
            measure(build, cells, pathlib.Path(folder), window)
    if window:
        window.close()


if __name__ == "__main__":
    main()
