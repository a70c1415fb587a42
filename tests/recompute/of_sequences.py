# SPDX-License-Identifier: Apache-2.0
"""Figures of bones that are followed through frames (docs/tracking.md)."""
import numpy as np
from scipy.spatial.transform import Rotation

import surface
from figures import exactly, within
from rigid import motion, turn_deg
from values import read_metrics, read_verdict, read_way

OF_TABLE = 1e-8  # the table has ten digits, and a matrix of them is a rotation to this


def frames(call):
    """Quantiles of absolute values, with linear interpolation, over the frames in which the bone was found."""
    metrics = call.many("metrics", read_metrics)
    result = {"frames": exactly(len(metrics))}
    counted = list(metrics.values())
    if call.has("states"):
        states = call.many("states", read_way)
        found = [states[frame].is_found()[0] for frame in metrics]
        counted = [figures for figures, is_found in zip(counted, found) if is_found]
        result["frames_lost"] = exactly(len(found) - sum(found))
    for name in call.options["figures"] if counted else []:
        values = np.abs([figures[name] for figures in counted])
        result |= {
            "median_" + name: exactly(np.quantile(values, 0.5)),
            "p95_" + name: exactly(np.quantile(values, 0.95)),
            "worst_" + name: exactly(values.max()),
            "rms_" + name: exactly(np.sqrt((values**2).mean())),
        }
    return result


def way_file(way):
    """The printed columns of a table, as figures: {"frame/column": value}."""
    columns = [name for name in way.columns if name.endswith(("_deg", "_mm")) and not name.startswith("m")]
    columns += ["time_s", "failure_probability"]
    return {
        "%s/%s" % (frame, column): float(text)
        for column in columns
        for frame, text in zip(way.columns["name"], way.columns[column])
        if text
    }


def trajectory(call):
    """The motion from the first frame about and along the bone's axes; the times; what the verdicts say."""
    way = read_way(call.file)
    frame = call.one("@model", surface.read).frame()
    states = call.many("states", read_way)
    verdicts = call.many("verdicts", read_verdict) if call.has("verdicts") else {}
    numbers = np.array(way.columns["frame"], float)
    rate_hz = call.run.option("frame_rate_hz")
    result = {}
    for number, name, pose in zip(numbers, way.columns["name"], way.poses):
        turn, shift = motion(way.poses[0], pose, frame)
        reach = 10 + np.linalg.norm(frame.origin_mm)
        for axis, degrees, mm in zip(("frontal", "lateral", "axial"), turn, shift):
            result["%s/%s_deg" % (name, axis)] = within(degrees, np.degrees(OF_TABLE))
            result["%s/%s_mm" % (name, axis.replace("axial", "along"))] = within(mm, OF_TABLE * reach)
        result["%s/time_s" % name] = within((number - 1) / rate_hz, 1e-9)
        if name in verdicts:
            result["%s/failure_probability" % name] = exactly(verdicts[name]["failure_probability"])
        state = way_file(states[name])
        deviations = {key.partition("/")[2]: value for key, value in state.items() if "/deviation_" in key}
        result |= {"%s/%s" % (name, key): exactly(value) for key, value in deviations.items()}
    return result


def joint(call):
    """The joint coordinate system of Grood and Suntay as Euler angles: about the right axis of the upper bone, the
    floating axis, and the long axis of the lower bone."""
    options = call.options
    right, up = (np.asarray(options[name], float) for name in ("right", "up"))
    axes = np.column_stack([right, np.cross(up, right), np.cross(right, np.cross(up, right))])
    axes /= np.linalg.norm(axes, axis=0)
    upper, lower = (call.all(port, read_way) for port in ("proximal", "distal"))
    (_, above), (_, below) = next(iter(upper.items())), next(iter(lower.items()))
    first = above.poses[0].inverse() @ below.poses[0]
    above, below = (states[call.item].poses[0] for states in (upper, lower))
    relative = (above.rotation @ axes).T @ (below.rotation @ axes)
    # Of right, front and up: a turn about the first takes up to the back, one about the last takes front to the left.
    extension, adduction, internal = Rotation.from_matrix(relative).as_euler("XYZ", degrees=True)
    apart_mm = below(options["centre_mm"]) - above(options["centre_mm"])
    x, z = above.rotation @ axes[:, 0], below.rotation @ axes[:, 2]
    floating = np.cross(z, x) / np.linalg.norm(np.cross(z, x))
    since = above.inverse() @ below @ first.inverse()
    helical = turn_deg(since.rotation)
    angle = np.linalg.norm(helical)
    # The angle of a turn that is hardly one has the rounding of the table in it, and its axis all of it.
    of_axis = OF_TABLE * (1 + np.linalg.norm(since.shift_mm) / max(np.radians(angle), 1e-9))
    return {
        "flexion_deg": within(-extension, np.degrees(OF_TABLE)),
        "adduction_deg": within(adduction, np.degrees(OF_TABLE)),
        "internal_rotation_deg": within(internal, np.degrees(OF_TABLE)),
        "right_mm": within(apart_mm @ x, 1e-6),
        "front_mm": within(apart_mm @ floating, 1e-6),
        "distraction_mm": within(-apart_mm @ z, 1e-6),
        "helical_deg": within(angle, np.degrees(10 * OF_TABLE)),
        "helical_shift_mm": within(since.shift_mm @ helical / max(angle, 1e-12), 10 * of_axis),
    }
