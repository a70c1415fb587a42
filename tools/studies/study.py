# SPDX-License-Identifier: Apache-2.0
"""What the studies share: they run marrow, read its figures of merit, and write a new folder with a table of all
runs."""
import concurrent.futures
import csv
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
MARROW = ROOT / "build" / "bin" / "marrow"


def marrow(*parts, log):
    """Runs a command of marrow, with its messages in the file `log`. Returns the exit code."""
    with open(log, "w") as stream:
        return subprocess.run([str(MARROW), *map(str, parts)], stdout=stream, stderr=subprocess.STDOUT).returncode


def overrides(settings):
    """Arguments that set these options, each a text NODE.OPTION=VALUE."""
    return [part for setting in settings for part in ("--set", setting)]


def figures_in(path):
    """name -> value, from a file with figures of merit."""
    return {one["name"]: one["value"] for one in json.loads(path.read_text())["metrics"]}


def new_folder(study, given):
    """The folder to write: `given`, or runs/STUDY. Ends the program if it is not empty, or if marrow is not built."""
    if not MARROW.exists():
        sys.exit("%s: build marrow first, with tools/setup" % study)
    out = pathlib.Path(given or ROOT / "runs" / study)
    if out.exists() and any(out.iterdir()):
        sys.exit("%s: %s is already there and not empty; choose another with --out, or remove it" % (study, out))
    out.mkdir(parents=True, exist_ok=True)
    return out


def results_of(work, jobs, title="", at_once=2):
    """work(job) of each job, in the order of the jobs. Shows how many are done."""
    results = []
    with concurrent.futures.ThreadPoolExecutor(at_once) as pool:
        for result in pool.map(work, jobs):
            results.append(result)
            print("\r%s%d of %d" % (title, len(results), len(jobs)), end="", file=sys.stderr)
    print(file=sys.stderr)
    return results


def write_rows(path, rows, fields=None):
    """Writes rows as CSV. Default of the fields: all that any row has, in the order of their first occurrence."""
    with open(path, "w", newline="") as stream:
        writer = csv.DictWriter(stream, fields or list(dict.fromkeys(field for row in rows for field in row)))
        writer.writeheader()
        writer.writerows(rows)
