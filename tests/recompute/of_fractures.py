# SPDX-License-Identifier: Apache-2.0
"""How fragments of a fracture lie relative to each other, and what a reduction leaves (docs/method.md)."""
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import surface
from figures import exactly, within
from rigid import angle_between_deg, motion, turn_deg
from values import read_pose, read_truth


def pair(call, port, read):
    values = call.many(port, read)
    return values[call.options["moved"]], values[call.options["reference"]]


def reduced(call):
    """How far the moved fragment is from its place, by the exact poses."""
    moved, reference = pair(call, "truths", read_truth)
    frame = call.many("models", surface.read)[call.options["moved"]].frame()
    turn, shift = motion(reference, moved, frame)
    return {
        "rotation_deg": exactly(angle_between_deg(moved, reference)),
        "axial_deg": exactly(turn[2]),
        "translation_mm": exactly(np.linalg.norm(shift)),
        "along_mm": exactly(shift[2]),
    }


def reduction_motion(call):
    """The motion in the world that brings the moved fragment to its place beside the other one."""
    moved, reference = pair(call, "poses", read_pose)
    there, here = reference.world_from_ct, moved.world_from_ct
    turn = turn_deg(there.rotation @ here.rotation.T)
    models = call.many("models", surface.read) if call.has("models") else {}
    frame = models[call.options["moved"]].frame() if models else moved.frame
    shift = there(frame.origin_mm) - here(frame.origin_mm)
    names = {"turn_%s_deg" % axis: value for axis, value in zip("xyz", turn)}
    names |= {"shift_%s_mm" % axis: value for axis, value in zip("xyz", shift)}
    names |= {"turn_deg": np.linalg.norm(turn), "shift_mm": np.linalg.norm(shift)}
    return {name: exactly(value) for name, value in names.items()}


def misalignment(call):
    """docs/method.md, "Misalignment of a fracture"."""
    options, up = call.options, np.asarray(call.options["up"], float)
    poses = pair(call, "poses", read_pose)
    surfaces = pair(call, "models", surface.read) if call.has("models") else (None, None)
    frames = [mesh.frame() if mesh else pose.frame for mesh, pose in zip(surfaces, poses)]
    distal = 0 if frames[0].origin_mm @ up < frames[1].origin_mm @ up else 1
    there = poses[1 - distal].world_from_ct.inverse() @ poses[distal].world_from_ct
    shaft = shaft_of(frames[distal].axes[:, 2], frames[1 - distal].axes[:, 2], up)
    left = np.cross(up, np.asarray(options["front"], float))
    left = left - shaft * (left @ shaft)
    left /= np.linalg.norm(left)
    back = np.cross(shaft, left)
    now = there.rotation @ shaft
    middle, unsure_mm = fracture_of(options, surfaces)
    shift = there(middle) - middle
    # The middle is a little unsure, and so is the shift of a bone that is turned there.
    allowed = unsure_mm * np.linalg.norm(there.rotation - np.eye(3), 2)
    outwards = {"left": 1, "right": -1}.get(options["side"])
    sign, inwards = outwards or 1, -outwards if outwards else 1
    words = ("varus", "internal_torsion", "medial") if outwards else ("apex_left", "torsion_left", "left")
    return {
        "angulation_deg": exactly(np.degrees(np.arctan2(np.linalg.norm(np.cross(shaft, now)), shaft @ now))),
        words[0] + "_deg": exactly(sign * np.degrees(np.arctan2(now @ left, now @ shaft))),
        "procurvatum_deg": exactly(-np.degrees(np.arctan2(now @ back, now @ shaft))),
        words[1] + "_deg": exactly(inwards * twist_deg(there.rotation, shaft)),
        "shift_mm": within(np.hypot(shift @ left, shift @ back), allowed),
        words[2] + "_shift_mm": within(inwards * (shift @ left), allowed),
        "anterior_shift_mm": within(-shift @ back, allowed),
        "shortening_mm": within(shift @ shaft, allowed),
    }


def shaft_of(distal, proximal, up):
    """The distal fragment's long axis, upwards; that of the other fragment if the two differ by more than 30 degrees
    and the other one runs nearer to `up`."""
    one, other = (axis if axis @ up >= 0 else -axis for axis in (distal, proximal))
    return other if one @ other < np.cos(np.radians(30)) and other @ up > one @ up else one


def twist_deg(rotation, axis):
    """What is left of a rotation about the axis without the shortest swing of the axis to where it is led."""
    now = rotation @ axis
    swing_axis = np.cross(axis, now)
    sine = np.linalg.norm(swing_axis)
    swing = Rotation.from_rotvec(swing_axis / max(sine, 1e-300) * np.arctan2(sine, axis @ now)).as_matrix()
    return turn_deg(swing.T @ rotation) @ axis


def fracture_of(options, surfaces):
    """(half way between the middles of both faces [mm], how sure that is). A face is the part of a surface that lies
    within 3 mm of the point that is nearest to the other one."""
    if len(options["fracture_mm"]):
        return np.asarray(options["fracture_mm"], float), 0
    middles = []
    for own, other in (surfaces, surfaces[::-1]):
        points, weights = own.points()
        away = cKDTree(other.points()[0]).query(points)[0]
        is_face = away < away.min() + 3
        middles.append(weights[is_face] @ points[is_face] / weights[is_face].sum())
    return sum(middles) / 2, 1


def reduction_gap(call):
    """The fracture is the part of the moved fragment's surface that lies close to the other one in the CT. What counts
    as close is found by points on both surfaces, so the gap has the deviation of an edge that is a little off."""
    moved, reference = (pose.world_from_ct for pose in pair(call, "poses", read_pose))
    true_moved, true_reference = pair(call, "truths", read_truth)
    surfaces = pair(call, "models", surface.read)
    points, weights = surfaces[0].points()
    reach_mm = call.options["border_mm"]
    near = cKDTree(surfaces[1].points()[0]).query(points, distance_upper_bound=2 * reach_mm)[0]
    after = reference @ moved.inverse() @ true_moved
    errors = {"before_mm": gaps(true_moved, true_reference, points), "gap_mm": gaps(after, true_reference, points)}

    def mean(values, border_mm):
        is_near = near < border_mm
        return weights[is_near] @ values[is_near] / weights[is_near].sum()

    result = {}
    for name, values in errors.items():
        around = [mean(values, share * reach_mm) for share in (0.9, 1, 1.1)]
        result[name] = within(around[1], np.ptp(around) + 0.01 * values[near < reach_mm].std())
    close = errors["gap_mm"][near < reach_mm]
    centre = surfaces[0].frame().origin_mm
    return result | {
        "largest_gap_mm": within(close.max(), close.max() - np.quantile(close, 0.97)),
        "rotation_deg": exactly(angle_between_deg(after, true_reference)),
        "translation_mm": exactly(np.linalg.norm(after(centre) - true_reference(centre))),
    }


def gaps(one, other, points):
    return np.linalg.norm(one(points) - other(points), axis=1)
