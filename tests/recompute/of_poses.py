# SPDX-License-Identifier: Apache-2.0
"""Figures of poses against the truth or against each other (docs/method.md, "What errors mean").

Means over points that are spread over a surface are integrals here. marrow takes some hundred points. So such a mean
may differ by four standard errors of as many points that are drawn at random."""
import numpy as np

import surface
from figures import exactly, within
from rigid import angle_between_deg, in_other_frame, motion
from values import read_camera, read_landmarks, read_pose, read_truth

AXES = ("frontal", "lateral", "axial")


class Targets:
    """The points over which a figure is a mean: landmarks, or the surface of the bone."""

    def __init__(self, call, count=None):
        if call.has("landmarks"):
            self.points_mm = call.one("landmarks", read_landmarks)
            self.weights = np.full(len(self.points_mm), 1 / len(self.points_mm))
            self.corners_mm, self.count = self.points_mm, None
        else:
            bone = call.one("model", surface.read)
            self.points_mm, self.weights = bone.points()
            self.corners_mm, self.count = bone.vertices_mm, count or call.options.get("points", 500)

    def mean(self, values, weights=None):
        """Of values at the points."""
        weights = self.weights if weights is None else weights
        mean = weights @ values
        if self.count is None:
            return exactly(mean)
        return within(mean, 4 * np.sqrt(weights @ (values - mean) ** 2 / self.count))


def pose_error(call):
    pose, truth = call.one("pose", read_pose), call.one("truth", read_truth)
    frame = call.one("model", surface.read).frame()
    found, targets = pose.world_from_ct, Targets(call)
    turn, shift = motion(truth, found, frame)
    result = {
        "rotation_deg": exactly(angle_between_deg(found, truth)),
        "translation_mm": exactly(np.linalg.norm(shift)),
        "along_mm": exactly(shift[2]),
        "along_frontal_mm": exactly(shift[0]),
        "along_lateral_mm": exactly(shift[1]),
        "across_mm": exactly(np.hypot(*shift[:2])),
        "mtre_mm": targets.mean(np.linalg.norm(found(targets.points_mm) - truth(targets.points_mm), axis=1)),
        "chapter_rotation_deg": exactly(np.abs(turn).mean()),
        "chapter_translation_mm": exactly(np.abs(shift).mean()),
    }
    result |= {"%s_deg" % axis: exactly(part) for axis, part in zip(AXES, turn)}
    return result | predicted_deviations(pose, frame)


def predicted_deviations(pose, frame):
    """One standard deviation about and along the axes of the surface, and in the worst direction."""
    if pose.covariance is None:
        return {}
    covariance = in_other_frame(pose.covariance, pose.frame, frame)
    deviations = np.sqrt(np.diag(covariance))
    worst = [np.sqrt(np.linalg.eigvalsh(part)[-1]) for part in (covariance[:3, :3], covariance[3:, 3:])]
    result = {"predicted_%s_deg" % axis: exactly(np.degrees(deviations[k])) for k, axis in enumerate(AXES)}
    names = ("along_frontal_mm", "along_lateral_mm", "along_mm")
    result |= {"predicted_" + name: exactly(deviations[3 + k]) for k, name in enumerate(names)}
    return result | {"predicted_max_deg": exactly(np.degrees(worst[0])), "predicted_max_mm": exactly(worst[1])}


def mtre(call):
    found, truth = call.one("pose", read_pose).world_from_ct, call.one("truth", read_truth)
    targets = Targets(call)

    def errors(points_mm):
        return np.linalg.norm(found(points_mm) - truth(points_mm), axis=1)

    squares = targets.mean(errors(targets.points_mm) ** 2)
    rms = np.sqrt(squares.value)
    # The largest error of a surface is at a corner. Few points come near it, but one in a hundred does.
    largest = errors(targets.corners_mm).max()
    most = 0 if targets.count is None else largest - np.quantile(errors(targets.points_mm), 0.98)
    return {
        "mtre_mm": targets.mean(errors(targets.points_mm)),
        "rms_mm": within(rms, squares.allowed / (2 * rms)),
        "max_mm": within(largest, most),
    }


def pose_difference(call):
    found, other = (call.one(port, read_pose).world_from_ct for port in ("pose", "reference"))
    targets = Targets(call)
    frame = call.one("model", surface.read).frame()
    turn, shift = motion(other, found, frame)
    middle = np.array([frame.origin_mm])
    apart = (found(middle) - other(middle))[0]
    return {
        "rotation_deg": exactly(angle_between_deg(found, other)),
        **{"%s_deg" % axis: exactly(turn[k]) for k, axis in enumerate(AXES)},
        "translation_mm": exactly(np.linalg.norm(shift)),
        **{"%s_mm" % axis: exactly(apart[k]) for k, axis in enumerate("xyz")},
        "distance_mm": targets.mean(np.linalg.norm(found(targets.points_mm) - other(targets.points_mm), axis=1)),
    }


def by_view(call, figures_of_view):
    """Figures of each view, and the same over all views: {name: values at the targets} of each."""
    targets, result, all_views = Targets(call), {}, {}
    for number, (view, camera) in enumerate(call.many("views", read_camera).items()):
        for name, values in figures_of_view(camera, number, targets.points_mm).items():
            result["%s_%s" % (view, name)] = targets.mean(values)
            all_views.setdefault(name, []).append(values)
    for name, lists in all_views.items():
        weights = np.tile(targets.weights, len(lists)) / len(lists)
        result[name] = targets.mean(np.concatenate(lists), weights)
    return result


def projection_distance(call):
    found, truth = call.one("pose", read_pose).world_from_ct, call.one("truth", read_truth)
    to_detector_mm = call.options.get("source_to_detector_mm") or []

    def figures_of_view(camera, number, points_mm):
        apart = camera.project(found(points_mm)) - camera.project(truth(points_mm))
        in_bone = camera.on_a_plane(apart, camera.depth_mm(truth(points_mm)))
        result = {"mpd_px": np.linalg.norm(apart, axis=1), "mpd_mm": np.linalg.norm(in_bone, axis=1)}
        if to_detector_mm:
            distance = to_detector_mm[number if len(to_detector_mm) > 1 else 0]
            result["mpd_detector_mm"] = np.linalg.norm(camera.on_a_plane(apart, np.full(len(apart), distance)), axis=1)
        return result

    return by_view(call, figures_of_view)


def reprojection_distance(call):
    found, truth = call.one("pose", read_pose).world_from_ct, call.one("truth", read_truth)

    def figures_of_view(camera, number, points_mm):
        rays = camera.rays(camera.project(found(points_mm)))
        from_source = truth(points_mm) - camera.source_mm()
        return {"mrpd_mm": np.linalg.norm(np.cross(from_source, rays), axis=1)}

    return by_view(call, figures_of_view)


def pose_file(pose):
    """The deviations that a pose prints beside its covariance."""
    if pose.covariance is None:
        return {}
    deviations = np.sqrt(np.diag(pose.covariance))
    deviations[:3] = np.degrees(deviations[:3])
    return {name: exactly(value) for name, value in zip(names_of_deviations(), deviations)}


def names_of_deviations():
    return ["deviation_%s_deg" % axis for axis in AXES] + ["deviation_%s_mm" % axis for axis in AXES]


def calibrated(call):
    """The last pose of the search. Its deviations about and along the bone's axes are multiplied by factors."""
    stages = call.many("stages", read_pose)
    last = list(stages.values())[-1]
    if last.covariance is None:
        return {}
    axes = call.one("model", surface.read).frame()
    factors = np.diag(np.concatenate([call.options["rotation_factors"], call.options["translation_factors"]]))
    scaled = factors @ in_other_frame(last.covariance, last.frame, axes) @ factors
    back = np.sqrt(np.diag(in_other_frame(scaled, axes, last.frame)))
    back[:3] = np.degrees(back[:3])
    return {name: exactly(value) for name, value in zip(names_of_deviations(), back)}
