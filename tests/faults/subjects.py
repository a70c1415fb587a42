# SPDX-License-Identifier: Apache-2.0
"""What is disturbed: a small run, a small comparison and a tidying of the store, and how to see that nothing half was
left."""
import csv
import json
import os
import re
import shutil
import subprocess

from harness import formats

SENTENCE = re.compile(r"^(marrow: (error: |stopped)|\S+: error: ).{8}", re.MULTILINE)
# A folder of libraries with the few plugins that are used: the manifests of all of them are most of a small run's work.
PLUGINS = ("read", "read_more", "write")

PIPELINE = """marrow: 1
name: small
inputs: {data: {type: path}, value: {type: number, default: 1}}
nodes:
  chance: {uses: test.draw}
  fixed: {uses: test.constant, with: {value: $value, path: $data}}
  sum: {uses: test.add, in: {a: chance, b: fixed}}
  picture: {uses: read.image, with: {path: %(data)s/picture.png}}
  mesh: {uses: read.mesh, with: {path: %(data)s/mesh.stl}}
  case: {uses: faults.case}
outputs: {sum: sum, value: fixed, picture: picture, mesh: mesh, case: case}
"""
VOLUME = """marrow: 1
name: volume
nodes:
  ct: {uses: read.volume, with: {path: %(data)s/ct.mha}}
outputs: {ct: ct}
"""
SIMULATION = """marrow: 1
inputs: {seed: {type: number, default: 1}}
nodes:
  case: {uses: faults.case, with: {seed: $seed}}
outputs: {case: case}
"""
EXPERIMENT = """experiment: 1
pipeline: %(data)s/small.yaml
cases: {simulate: {pipeline: %(data)s/simulation.yaml, seeds: 1..2, seed_input: [seed]}, input: data}
variants: {one: {fixed.value: 1}, two: {fixed.value: %(second)d}}
metrics: [value.value]
success: {value.value: 10}
pictures: [picture]
timed_cells: 1
"""


def stl(facets):
    facet = "facet normal 0 0 1\nouter loop\nvertex %d 0 0\nvertex %d 10 0\nvertex %d 10 9\nendloop\nendfacet\n"
    return "solid a\n" + "".join(facet % (i, i, i + 1) for i in range(facets)) + "endsolid a\n"


def write_data(folder):
    (folder / "other").mkdir(parents=True)  # an experiment of the same name with other values
    (folder / "text").write_text("a file that counts by its content")
    grey = [(7 * u + 13 * v) % 256 for v in range(12) for u in range(16)]
    (folder / "picture.png").write_bytes(formats.png(16, 12, grey))
    (folder / "ct.mha").write_bytes(formats.mha(formats.straight((4, 4, 4)), range(64), "MET_FLOAT"))
    (folder / "mesh.stl").write_text(stl(5))
    small = PIPELINE % {"data": folder}
    (folder / "small.yaml").write_text(small)
    slow = "  work: {uses: test.work, with: {value: 0.2}}\noutputs: {work: work, "
    (folder / "slow.yaml").write_text(small.replace("outputs: {", slow))
    (folder / "volume.yaml").write_text(VOLUME % {"data": folder})
    (folder / "simulation.yaml").write_text(SIMULATION)
    (folder / "small-experiment.yaml").write_text(EXPERIMENT % {"data": folder, "second": 4})
    (folder / "other" / "small-experiment.yaml").write_text(EXPERIMENT % {"data": folder, "second": 7})


class Program:
    """The program that was built, with its library and the few plugins of the subjects in a folder of their own."""

    def __init__(self, build, scratch):
        self.marrow, self.scratch, self.data = build / "bin" / "marrow", scratch, scratch / "data"
        self.fault_library = build / "tests" / "faults" / "libfault.so"
        libraries = scratch / "lib"
        (libraries / "marrow").mkdir(parents=True)
        for file in (build / "lib").glob("libmarrow*"):
            shutil.copy2(file, libraries / file.name, follow_symlinks=False)
        shutil.copy2(build / "lib" / "marrow" / "marrow-worker", libraries / "marrow")
        for name in PLUGINS:
            for file in (build / "lib" / "marrow").glob("marrow_%s.*" % name):
                (libraries / "marrow" / file.name).symlink_to(file)
        for pattern in ("plugins/marrow_test_*", "fault_plugins/marrow_small_case.*"):
            for file in (build / "tests").glob(pattern):
                (libraries / "marrow" / file.name).symlink_to(file)
        (scratch / "home").mkdir()
        foreign = ("MARROW_", "FAULT_", "XDG_")
        self.environment = {key: value for key, value in os.environ.items() if not key.startswith(foreign)}
        self.environment.update(LD_LIBRARY_PATH=str(libraries), HOME=str(scratch / "home"))
        write_data(self.data)

    def environment_of(self, folder, **more):
        return {**self.environment, "MARROW_CACHE": str(folder / "store"), **more}

    def run(self, arguments, folder, **more):
        how = {"capture_output": True, "text": True, "errors": "replace", "stdin": subprocess.DEVNULL, "timeout": 400}
        command = [str(self.marrow), *map(str, arguments)]
        return subprocess.run(command, cwd=folder, env=self.environment_of(folder, **more), **how)

    def damaged_entries(self, folder):
        result = self.run(["cache", "info"], folder)
        damaged = result.returncode != 0 or "damaged" in result.stdout + result.stderr
        return ["the store holds what is not whole: " + result.stdout + result.stderr] if damaged else []


def bytes_below(folder):
    """All files but hidden and temporary ones."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith(".") or ".tmp" in part for part in path.relative_to(folder).parts)
    }


def broken_json(folder):
    for name, content in bytes_below(folder).items():
        if name.endswith(".json"):
            try:
                json.loads(content)
            except ValueError:
                yield "%s is no whole JSON: %r" % (name, content[-60:])


class Run:
    """A run that reads a picture and a mesh, computes a little and writes five outputs, a case's folder among them."""

    name = "run"

    def __init__(self, program, pipeline="small.yaml"):
        self.program, self.pipeline = program, pipeline

    def arguments(self, out, seed=1, threads=2):
        data = self.program.data
        words = ["run", data / self.pipeline, "data=%s" % (data / "text"), "--seed", seed, "--threads", threads]
        return words + (["--out", out] if out else [])

    def prepare(self, folder):
        pass

    def command(self, folder):
        return self.arguments(folder / "out")

    def second_command(self, folder):
        return self.arguments(folder / "again")

    def reference(self, seed=1):
        folder = self.program.scratch / ("reference-%s-%d" % (self.pipeline, seed))
        if not folder.exists():
            folder.mkdir()
            result = self.program.run(self.arguments(folder / "out", seed), folder)
            assert result.returncode == 0, result.stderr
        return {name: content for name, content in bytes_below(folder / "out").items() if name.startswith("outputs")}

    def complaints_of(self, out, is_whole, seed=1):
        """What a run's folder holds that it should not; all of its outputs where it said that all went well."""
        reference = self.reference(seed)
        found = bytes_below(out).items() if out.is_dir() else []
        outputs = {name: content for name, content in found if name.startswith("outputs")}
        wrong = [(name, len(content)) for name, content in outputs.items() if reference.get(name) != content]
        complaints = ["%s is not what it should be (%d bytes)" % one for one in wrong]
        complaints += broken_json(out)
        if is_whole:
            complaints += ["%s is not there" % name for name in reference if name not in outputs]
            record = out / "run.json"
            if not record.exists() or json.loads(record.read_text())["status"] != "done":
                complaints.append("run.json does not say that it is done")
        return complaints

    def complaints(self, folder, code):
        return self.complaints_of(folder / "out", code == 0) + self.program.damaged_entries(folder)

    def second_complaints(self, folder):
        return self.complaints_of(folder / "again", True)


class Compare:
    """Two variants on two cases, with times, pictures and a report."""

    name = "compare"
    files = ("cells.csv", "cells.jsonl", "comparison.json", "report.html", "experiment.yaml")

    def __init__(self, program):
        self.program = program

    def arguments(self, out, experiment="small-experiment.yaml", more=()):
        words = ["compare", self.program.data / experiment, "--jobs", 2, "--time-limit", 60, *more]
        return words + (["--out", out] if out else [])

    def prepare(self, folder):
        pass

    def command(self, folder):
        return self.arguments(folder / "out")

    second_command = command

    def rows(self, out):
        """All of each cell but times, tries and the key, which has the library in it that injects the faults."""
        with open(out / "cells.csv", newline="") as stream:
            return {
                row["cell"]: {key: value for key, value in row.items() if key not in ("seconds", "tries", "key")}
                for row in csv.DictReader(stream)
            }

    def reference(self, experiment="small-experiment.yaml"):
        folder = self.program.scratch / ("reference-" + experiment.replace("/", "-"))
        if not folder.exists():
            folder.mkdir()
            result = self.program.run(self.arguments(folder / "out", experiment), folder)
            assert result.returncode == 0 and "failed cells" not in result.stdout, result.stdout + result.stderr
        return self.rows(folder / "out")

    def complaints_of(self, out, is_ended, is_undisturbed, experiment="small-experiment.yaml"):
        reference, complaints = self.reference(experiment), list(broken_json(out))
        if is_ended:
            complaints += ["%s is not there" % name for name in self.files if not (out / name).exists()]
        if (out / "cells.csv").exists():
            rows = self.rows(out)
            if rows.keys() != reference.keys():
                complaints.append("cells.csv has the cells " + ", ".join(rows))
            for name, row in rows.items():
                is_failed = row["status"] == "failed" and len(row["reason"]) > 8 and not is_undisturbed
                if row != reference.get(name) and not is_failed:
                    complaints.append("the cell %s is %s" % (name, row))
        report = out / "report.html"
        if report.exists() and not report.read_text(errors="replace").rstrip().endswith("</html>"):
            complaints.append("report.html has no end")
        return complaints

    def complaints(self, folder, code):
        return self.complaints_of(folder / "out", code == 0, False) + self.program.damaged_entries(folder)

    def second_complaints(self, folder):
        return self.complaints_of(folder / "out", True, True)


class Collect:
    """marrow cache gc on a store of a few results and what a killed process left."""

    name = "gc"

    def __init__(self, program):
        self.program = program

    def prepare(self, folder):
        template = self.program.scratch / "filled"
        if not template.exists():
            template.mkdir()
            run = Run(self.program)
            assert self.program.run(run.arguments(template / "out"), template).returncode == 0
            for path in list((template / "store").glob("??/*"))[:1]:
                left = shutil.copy(path, str(path) + ".tmp-999999999-0")
                os.utime(left, (0, 0))  # nobody writes it any more
        shutil.copytree(template / "store", folder / "store")

    def command(self, folder):
        return ["cache", "gc", "--keep-gb", 0]

    second_command = command

    def entries(self, folder):
        return [path for path in (folder / "store").glob("??/*") if path.is_file()]

    def complaints(self, folder, code):
        complaints = self.program.damaged_entries(folder)
        if code == 0 and self.entries(folder):
            complaints.append("it said that all went well, but %d entries are still there" % len(self.entries(folder)))
        return complaints

    def second_complaints(self, folder):
        return ["%s is still there" % path for path in self.entries(folder)]
