# SPDX-License-Identifier: Apache-2.0
"""Repeats a run with further outputs: the inputs of the nodes whose figures are recomputed."""
import subprocess

import yaml

from run_folder import Missing, for_output, nodes_of


def make(run, needed_by, program, scratch):
    """The folder of the further outputs: what figures are recomputed from, and the figures that no output shows. None
    if the run has all. `needed_by(node, port)`: the inputs that a figure is recomputed from; None if it is not."""
    lacking, seen = set(), set()
    todo = list(run.files) + [figure for figure in run.made() if needed_by(*run.inside(figure)) is not None]
    while todo:
        reference = run.whole(todo.pop())
        if reference in seen:
            continue
        seen.add(reference)
        if not is_there(run, reference):
            lacking.add(reference)
        todo += wires_of(run, reference, needed_by)
    if not lacking:
        return None
    show_in_bodies(run, run.pipeline, lacking)
    run.pipeline["outputs"] = {for_output(wire): wire for wire in sorted(lacking)}
    return repeat(run.pipeline, program, scratch, run.record["seed"])


def wires_of(run, reference, needed_by):
    """The references that the figures of a value need."""
    node, port = run.inside(reference)
    return list(filter(None, (run.wire(node, name) for name in needed_by(node, port) or ())))


def is_there(run, wire):
    try:
        return bool(run.values(wire))
    except Missing:
        return False


def show_in_bodies(run, pipeline, lacking):
    """A value inside a body becomes one of its outputs."""
    for wire in lacking:
        name, _, port = wire.partition(".")
        if name in run.bodies and port.startswith("for_"):
            body = pipeline["nodes"][name]["repeat"]
            wires = {for_output(inner): inner for node in nodes_of(body).values() for inner in node.wires.values()}
            body["outputs"][port] = wires[port]


def repeat(pipeline, program, scratch, seed):
    file, out = scratch / "further.yaml", scratch / "further"
    file.write_text(yaml.safe_dump(pipeline, sort_keys=False))
    command = [program.resolve(), "run", file, "--out", out, "--seed", seed, "--quiet"]
    ended = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if ended.returncode not in (0, 3):  # 3: a verdict is wrong
        raise SystemExit("the run with further outputs ended with %d:\n%s" % (ended.returncode, ended.stderr))
    return out
