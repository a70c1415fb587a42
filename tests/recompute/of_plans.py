# SPDX-License-Identifier: Apache-2.0
"""Plans for locking a nail, and their errors (docs/nailing.md)."""
import json

import numpy as np
from scipy.optimize import minimize

from figures import exactly
from rigid import Frame, in_other_frame
from values import number, read_pose, read_truth, read_yaml


def read_holes(path):
    """{name: (centre [mm], axis, of length 1)} of an implant's folder."""
    holes = read_yaml(path / "holes.yaml")["holes"]
    return {
        name: (np.array(hole["centre_mm"], float), np.array(hole["axis"], float) / np.linalg.norm(hole["axis"]))
        for name, hole in holes.items()
    }


def read_plan(path):
    return json.loads(path.read_text())


def between_lines_deg(one, other):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other)), abs(one @ other)))


def viewing_direction(alpha_deg, beta_deg):
    """Of the rays through the middle of the image (docs/method.md, "Camera")."""
    alpha, beta = np.radians([alpha_deg, beta_deg])
    return np.array([np.cos(alpha) * np.sin(beta), -np.cos(alpha) * np.cos(beta), np.sin(alpha)])


def deviations(pose, centre_mm, axis):
    """Root mean squares of the axis' angle [deg], and of its distance at the hole's centre [mm]."""
    at_hole = in_other_frame(pose.covariance, pose.frame, Frame(centre_mm, np.eye(3)))
    across = np.eye(3) - np.outer(axis, axis)
    turn, shift = (np.trace(across @ part @ across) for part in (at_hole[:3, :3], at_hole[3:, 3:]))
    return np.degrees(np.sqrt(turn)), np.sqrt(shift)


def drills_come_from(options):
    """The outer side of the leg, a little from the front, unless a direction is given."""
    if len(options["from"]):
        return np.asarray(options["from"], float)
    return np.array([1.0 if options["side"] == "left" else -1.0, -0.5, 0])


def plan(call):
    """Printed as {"hole/figure": value}."""
    pose, holes = call.one("pose", read_pose), call.one("implant", read_holes)
    options, place = call.options, pose.world_from_ct
    result = {}
    for hole, (centre, axis) in holes.items():
        direction = place.rotation @ axis
        direction = -direction if direction @ drills_come_from(options) > 0 else direction
        figures = {"centre_" + name: value for name, value in zip("xyz", place(centre))}
        figures |= {"direction_" + name: value for name, value in zip("xyz", direction)}
        guide = place(centre) - options["guide_mm"] * direction
        figures |= {"guide_" + name: value for name, value in zip("xyz", guide)}
        if pose.covariance is not None:
            names = ("predicted_deviation_deg", "predicted_deviation_mm")
            figures |= dict(zip(names, deviations(pose, centre, axis)))
        result |= {"%s/%s" % (hole, name): exactly(value) for name, value in figures.items()}
        result |= {
            "%s/%s" % (hole, name): value
            for name, value in aimed(call.printed, hole, place(centre), direction, options)
        }
    return result


def aimed(printed, hole, centre_mm, direction, options):
    """The printed angles of the C-arm, if the ray through the hole runs along its axis there. Else the nearest angles
    at which it does."""
    isocentre = np.asarray(options["isocentre_mm"], float)

    def off_deg(angles):
        source = isocentre - options["source_to_isocentre_mm"] * viewing_direction(*angles)
        return between_lines_deg(centre_mm - source, direction)

    names = ("alpha_deg", "beta_deg")
    start = np.array([printed["%s/%s" % (hole, name)] for name in names])
    best = start if off_deg(start) < 1e-6 else minimize(off_deg, start, method="Nelder-Mead").x
    return [(name, exactly(value)) for name, value in zip(names, best)]


def plan_figures(values):
    result = {}
    for drill in values["drills"]:
        for key, name in (("centre_mm", "centre_"), ("direction", "direction_"), ("guide_mm", "guide_")):
            result |= {"%s/%s%s" % (drill["hole"], name, axis): value for axis, value in zip("xyz", drill[key])}
        for name in ("predicted_deviation_deg", "predicted_deviation_mm", "alpha_deg", "beta_deg"):
            result["%s/%s" % (drill["hole"], name)] = number(drill[name])
    return result


def plan_verdict(call):
    """What the verdict says of each hole's deviations."""
    pose, holes = call.one("pose", read_pose), call.one("implant", read_holes)
    result = {}
    for hole, (centre, axis) in holes.items() if pose.covariance is not None else []:
        degrees, mm = deviations(pose, centre, axis)
        result |= {hole + "_deviation_deg": exactly(degrees), hole + "_deviation_mm": exactly(mm)}
    return result


def errors_of_holes(call):
    """{hole: its errors} of a plan against the exact pose of the nail."""
    planned, holes = call.one("plan", read_plan), call.one("implant", read_holes)
    truth, result = call.one("truth", read_truth), {}
    arm = planned["c_arm"]
    for drill in planned["drills"]:
        centre, axis = truth(holes[drill["hole"]][0]), truth.rotation @ holes[drill["hole"]][1]
        off = np.asarray(drill["centre_mm"]) - centre
        ray = viewing_direction(drill["alpha_deg"], drill["beta_deg"])
        source = np.asarray(arm["isocentre_mm"]) - arm["source_to_isocentre_mm"] * ray
        result[drill["hole"]] = {
            "angle_deg": between_lines_deg(np.asarray(drill["direction"]), axis),
            "offset_mm": np.linalg.norm(np.cross(off, axis)),
            "view_deg": between_lines_deg(centre - source, axis),
            "predicted_angle_deg": number(drill["predicted_deviation_deg"]),
            "predicted_offset_mm": number(drill["predicted_deviation_mm"]),
            "flagged": float(bool(drill["doubts"])),
        }
    return result


def locking(call):
    errors = errors_of_holes(call)
    if call.item in errors:
        return {name: exactly(value) for name, value in errors[call.item].items()}
    options, holes = call.options, list(errors.values())
    is_off = [
        one["angle_deg"] > options["max_angle_deg"] or one["offset_mm"] > options["max_offset_mm"] for one in holes
    ]
    worst = {name: max(one[name] for one in holes) for name in ("angle_deg", "offset_mm", "view_deg", "flagged")}
    worst["off"] = float(any(is_off))
    worst["silent"] = float(any(off and not one["flagged"] for off, one in zip(is_off, holes)))
    return {name: exactly(value) for name, value in worst.items()}
