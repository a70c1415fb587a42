#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Recomputes the figures of a run by numpy and scipy, without marrow, and compares them with those that the run has
written: errors of poses, distances, predicted deviations, probabilities of failures, ways of bones, plans and
calibrations.

    tests/recompute/recompute.py RUN [--case FOLDER] [--marrow PROGRAM]

It reads the run's folder and the case. For values that a run does not write by itself, such as the surface of a bone
or the pose before another step, --marrow gives the program that made the run. It repeats the run with further outputs,
most of it from the store. The figures among them are compared, too. Prints a line for each figure: what marrow says,
what is recomputed, how far they are apart, and how far they may be. Figures that are not recomputed are listed with the
reason. Ends with 1 if a figure differs, or if none could be recomputed.
"""
import argparse
import json
import pathlib
import sys
import tempfile

import further_outputs
import of_calibrations
import of_fractures
import of_outlines
import of_plans
import of_poses
import of_sequences
import of_shafts
import of_surfaces
import of_verdicts
from figures import NotRecomputed, exactly, rows_of, table
from run_folder import Call, Missing, Run
from values import number, read_metrics, read_pose, read_verdict, read_way, read_yaml

# (node, port): how its figures are computed, and the inputs that it takes.
RECOMPUTED = {
    ("evaluate.pose_error", "metrics"): (of_poses.pose_error, ("pose", "truth", "model")),
    ("evaluate.pose_difference", "metrics"): (of_poses.pose_difference, ("pose", "reference", "model")),
    ("evaluate.mtre", "metrics"): (of_poses.mtre, ("pose", "truth", "model", "landmarks")),
    ("evaluate.projection_distance", "metrics"): (
        of_poses.projection_distance,
        ("pose", "truth", "model", "landmarks", "views"),
    ),
    ("evaluate.reprojection_distance", "metrics"): (
        of_poses.reprojection_distance,
        ("pose", "truth", "model", "landmarks", "views"),
    ),
    ("evaluate.outline_distance", "metrics"): (
        of_outlines.outline_distance,
        ("pose", "views", "edges", "projector.model", "projector.volume"),
    ),
    ("evaluate.shaft_lines", "metrics"): (of_shafts.shaft_lines, ("lines", "view", "models", "truths")),
    ("evaluate.dice", "metrics"): (of_surfaces.dice, ("field", "reference")),
    ("evaluate.surface_distance", "metrics"): (of_surfaces.surface_distance, ("mesh", "reference")),
    ("evaluate.frames", "metrics"): (of_sequences.frames, ("metrics", "states")),
    ("evaluate.calibration", "metrics"): (of_calibrations.calibration, ("calibration", "true_calibration")),
    ("evaluate.reduced", "metrics"): (of_fractures.reduced, ("truths", "models")),
    ("evaluate.reduction_gap", "metrics"): (of_fractures.reduction_gap, ("poses", "truths", "models")),
    ("evaluate.locking", "holes"): (of_plans.locking, ("plan", "implant", "truth")),
    ("evaluate.locking", "metrics"): (of_plans.locking, ("plan", "implant", "truth")),
    ("camera.bead_board", "metrics"): (of_calibrations.report, ()),
    ("deviations.calibrated", "pose"): (of_poses.calibrated, ("stages", "model")),
    ("fracture.misalignment", "metrics"): (of_fractures.misalignment, ("poses", "models")),
    ("fracture.reduction", "metrics"): (of_fractures.reduction_motion, ("poses", "models")),
    ("plan.locking", "plan"): (of_plans.plan, ("implant", "pose")),
    ("plan.locking", "verdict"): (of_plans.plan_verdict, ("implant", "pose")),
    ("track.joint", "metrics"): (of_sequences.joint, ("proximal", "distal")),
    ("track.trajectory", "trajectory"): (of_sequences.trajectory, ("states", "verdicts", "@model")),
    ("verdict.predicted", "verdict"): (of_verdicts.predicted, ("pose", "model", "prior")),
    ("verdict.evidence", "verdict"): (of_verdicts.evidence, ("pose", "model", "stages", "contour_pose")),
}


def printed_in(file):
    """The figures of a file by name; empty if it holds none."""
    if file.suffix == ".csv":
        return of_sequences.way_file(read_way(file))
    if file.suffix == ".json":
        values = json.loads(file.read_text())
        return (
            read_metrics(file) if "metrics" in values else of_plans.plan_figures(values) if "drills" in values else {}
        )
    if file.suffix != ".yaml":
        return {}
    values = read_yaml(file)
    if "marrow-verdict" in values:
        return read_verdict(file)
    if "marrow-pose" in values:
        return dict(zip(of_poses.names_of_deviations(), read_pose(file).deviations))
    return {name: values[name] for name in ("width_mm", "width_deviation_mm", "log_likelihood") if name in values}


def expected_of(call, port, printed):
    """(recomputed figures, why others are not)"""
    expected = of_poses.pose_file(read_pose(call.file)) if is_pose(call.file) else {}
    key = known(call.node, port)
    if not key:
        return expected, "%s is not known here" % call.node.uses
    try:
        return expected | RECOMPUTED[key][0](call), "they need more than the values that are written"
    except Missing as missing:
        return expected, "no file holds %s; give --marrow" % missing
    except NotRecomputed as why:
        return expected, str(why)


def known(node, port):
    """The entry of RECOMPUTED for a value; None if there is none. A wire may leave out the only port."""
    keys = [key for key in RECOMPUTED if key[0] == node.uses and port in ("", key[1])]
    return keys[0] if len(keys) == 1 else None


def needed_by(node, port):
    """The inputs of a node from which a value of it is recomputed; None if it is not."""
    key = known(node, port)
    return RECOMPUTED[key][1] if key else None


def is_pose(file):
    return file.suffix == ".yaml" and "marrow-pose" in read_yaml(file)


def rows_of_run(run):
    """Of all figures that the run has written, and of those among the further outputs that are known here."""
    rows = []
    for reference, files in [*run.files.items(), *run.further.items()]:
        node, port = run.inside(reference)
        for item, file in files.items():
            is_figures = file.is_file() and (reference in run.files or known(node, port))
            printed = printed_in(file) if is_figures else {}
            if printed:
                expected, reason = expected_of(Call(run, node, item, file, printed), port, printed)
                rows += rows_of("/".join(filter(None, [reference, item])), printed, expected, reason)
    return rows + rows_of_record(run)


def rows_of_record(run):
    """What the run's record repeats of its verdicts."""
    rows = []
    for verdict in run.record.get("verdicts", []):
        file = run.verdict_file(verdict["output"], verdict["item"])
        written = read_verdict(file)
        printed = {"judgement": verdict["judgement"], "failure_probability": number(verdict["failure_probability"])}
        expected = {name: value if isinstance(value, str) else exactly(value) for name, value in written.items()}
        place = "/".join(filter(None, ["run.json", verdict["output"], verdict["item"]]))
        rows += rows_of(place, printed, {name: expected[name] for name in printed}, "")
    return rows


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="folder of the run")
    parser.add_argument("--case", type=pathlib.Path, help="folder of the case, if it has moved since the run")
    parser.add_argument("--marrow", type=pathlib.Path, help="program that repeats the run with further outputs")
    given = parser.parse_args(arguments)
    run = Run(given.run, case=given.case)
    with tempfile.TemporaryDirectory(prefix="marrow-recompute-") as scratch:
        if given.marrow:
            further = further_outputs.make(run, needed_by, given.marrow, pathlib.Path(scratch))
            run = Run(given.run, further, given.case)
        rows = rows_of_run(run)
    print("\n".join(table(rows)))
    recomputed = [row for row in rows if row.is_recomputed()]
    return 0 if recomputed and all(row.is_right() for row in recomputed) else 1


if __name__ == "__main__":
    sys.exit(main())
