# SPDX-License-Identifier: Apache-2.0
"""Writes an experiment and its tables, and runs marrow on it."""
import json
import os
import pathlib
import subprocess

PIPELINE = """marrow: 1
inputs: {%(inputs)s}
nodes:
  start: {uses: test.given_start}
  main: {uses: test.given_figures, in: {start: start}, with: {%(table)s, names: %(main)s}}
  may: {uses: test.given_figures, in: {start: start}, with: {%(table)s, names: %(may)s}, may_fail: true}
  verdict: {uses: test.given_verdict, in: {start: start}, with: {%(table)s}}
  pose: {uses: test.given_pose, in: {start: start}, with: {%(table)s}}
outputs: {%(outputs)s}
"""


def pipeline(experiment, table):
    names = {node: [m.name for m in experiment.metrics if m.node == node] for node in ("main", "may")}
    if experiment.has_initial_error:
        names["main"].append("start_error")
    outputs = ["main", "pose"] + ["may"] * bool(names["may"]) + ["verdict"] * experiment.has_verdict
    source = "table: %s, row: $seed" % json.dumps(str(table)) if experiment.has_seeds else "table: $case"
    return PIPELINE % {
        "inputs": "seed: {type: integer, default: 1}" if experiment.has_seeds else "case: {type: path}",
        "table": source,
        "main": json.dumps(names["main"]),
        "may": json.dumps(names["may"]),
        "outputs": ", ".join("%s: %s" % (name, name) for name in outputs),
    }


def experiment_text(experiment):
    """In YAML, of which JSON is a part."""
    columns = {v.swept_from or v.name: v.column for v in experiment.variants}
    if experiment.factors:
        columns = {name: name for name in experiment.factors[0][1]}
    nodes = ["main", "pose"] + ["may"] * any(m.node == "may" for m in experiment.metrics)
    nodes += ["verdict"] * experiment.has_verdict
    text = {
        "experiment": 1,
        "name": experiment.name,
        "pipeline": "p.yaml",
        "cases": {"folders": ["cases/*"]},
        "variants": {name: {node + ".column": column for node in nodes} for name, column in columns.items()},
        "starts": {"node": "start", "count": len(experiment.starts), "translation_mm": 10},
        "metrics": [{"figure": m.path, "label": m.label, "better": m.better} for m in experiment.metrics],
        "baseline": experiment.variants[experiment.baseline].name,
        "timed_cells": experiment.timed_cells,
    }
    if experiment.compare_all:
        text["compare_all"] = True
    if experiment.factors:
        text["matrix"] = {name: levels for name, levels in experiment.factors if name != "variants"}
    if experiment.has_seeds:
        text["cases"] = {"seeds": "1..%d" % len(experiment.cases), "seed_input": ["seed"]}
    if experiment.has_limits:
        text["success"] = {m.path: m.limit for m in experiment.metrics if m.limit is not None}
    if experiment.has_initial_error:
        text["initial_error"] = "main.start_error"
    if experiment.stop:
        text["stop"] = dict(experiment.stop)
        if "variant" in text["stop"]:
            text["stop"]["variant"] = experiment.variants[text["stop"]["variant"]].name
    if experiment.sweep:
        sweep = experiment.sweep
        option = {"range": sweep["range"], "scale": "log" if sweep["is_log"] else "linear"}
        kind = "grid" if "grid" in sweep else "sobol"
        text["sweep"] = {"options": {"main.at": option}, kind: sweep[kind]}
    if experiment.tune:
        optimizer = {"uses": "optimizer.nelder_mead"}
        text["tune"] = {"options": {"main.at": [-1, 2]}, "optimizer": optimizer, **experiment.tune}
    return "\n".join("%s: %s" % (key, json.dumps(value)) for key, value in text.items()) + "\n"


def write(experiment, folder):
    folder = pathlib.Path(folder).resolve()
    folder.mkdir(parents=True)
    lines = {}
    for (case, column, start), texts in experiment.table.items():
        row = case.partition("-")[2] if experiment.has_seeds else "0"
        shift = "%.9g" % experiment.starts[start]
        for name, text in texts.items():
            lines.setdefault(case, []).append(",".join((row, column, shift, name, text)) + "\n")
    if experiment.has_seeds:
        (folder / "table.csv").write_text("".join("".join(own) for own in lines.values()))
    else:
        for case, own in lines.items():
            (folder / "cases" / case).mkdir(parents=True)
            (folder / "cases" / case / "figures.csv").write_text("".join(own))
    (folder / "p.yaml").write_text(pipeline(experiment, folder / "table.csv"))
    (folder / "e.yaml").write_text(experiment_text(experiment))


def run(experiment, folder, build, plugins=None, arguments=()):
    """The ended process of marrow; the answer is in FOLDER/out."""
    folder, build = pathlib.Path(folder), pathlib.Path(build).resolve()
    environment = dict(os.environ)
    environment["MARROW_PLUGIN_PATH"] = str(plugins or build / "tests/given_plugins")
    environment["MARROW_CACHE"] = str(folder / "cache")
    command = [build / "bin/marrow", "compare", "e.yaml", "--out", "out", "--quiet", "--shown", "1", *arguments]
    if experiment.stop and not arguments:
        command += ["--more-cases", "100"]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=folder, env=environment)
