# SPDX-License-Identifier: Apache-2.0
"""Probabilities of failures and judgements (docs/verdict.md).

A failure: the mean distance of the bone's surface from its true place is more than 2 mm, or the bone is turned by more
than 5 degrees about its long axis. marrow draws 10000 errors from the normal distribution of the predicted covariance.
Here another generator draws 40000, at other points of the surface."""
import dataclasses
import math

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2, norm

import surface
from figures import NotRecomputed, exactly, within
from of_poses import Targets
from rigid import draw_motions, in_other_frame, motion
from values import read_pose, read_yaml

MOST_MM, MOST_DEG = 2, 5
DRAWS, THEIR_DRAWS, THEIR_TARGETS, POINTS = 40000, 10000, 200, 1000


@dataclasses.dataclass
class Spread:
    """What a covariance predicts: the probability of a failure, and root mean squares."""

    failure: object
    mtre_mm: object
    axial_deg: object


def spread_of(pose, bone):
    frame = bone.frame()
    covariance = in_other_frame(pose.covariance, pose.frame, frame)
    motions = draw_motions(covariance, DRAWS, seed=2)
    from_centre = (bone.spread_points(POINTS) - frame.origin_mm) @ frame.axes
    mtre_mm = np.concatenate([mean_errors(part, from_centre) for part in np.array_split(motions, 40)])
    axial_deg = np.abs(np.degrees(motions[:, 2]))
    # How far the mean over their few points may be from that over the surface, as a share of it.
    one = np.linalg.norm(np.cross(np.sqrt(np.diag(covariance))[:3], from_centre), axis=1) + 1e-12
    of_points = 4 * one.std() / one.mean() * math.sqrt(1 / THEIR_TARGETS + 1 / POINTS)

    def failures(share):
        return np.mean((mtre_mm * share > MOST_MM) | (axial_deg > MOST_DEG))

    failure = between(failures(1), failures(1 - of_points), failures(1 + of_points))
    if at_most(covariance, from_centre * (1 + of_points)) * THEIR_DRAWS < 1e-6:
        failure = exactly(0)
    rms_mm = math.sqrt(np.mean(mtre_mm**2))
    of_draws = 4 * np.std(mtre_mm**2) / (2 * rms_mm**2) * math.sqrt(1 / THEIR_DRAWS + 1 / DRAWS)
    return Spread(
        failure,
        within(rms_mm, rms_mm * (of_points + of_draws)),
        within(
            math.degrees(math.sqrt(covariance[2, 2])), 4 * math.degrees(math.sqrt(covariance[2, 2] / 2 / THEIR_DRAWS))
        ),
    )


def at_most(covariance, from_centre):
    """A bound of the probability of a failure. The mean distance is at most the root mean square, whose square is a
    quadratic form of the motion; and this is at most its largest eigenvalue times chi squared."""
    levers = np.zeros((len(from_centre), 3, 6))
    levers[:, :, 3:] = np.eye(3)
    for k, axis in enumerate(np.eye(3)):
        levers[:, :, k] = np.cross(axis, from_centre)
    form = np.einsum("pij,pik->jk", levers, levers) / len(levers)
    largest = np.linalg.eigvals(form @ covariance).real.max()
    by_axis = 2 * norm.sf(MOST_DEG / math.degrees(math.sqrt(covariance[2, 2])))
    return chi2.sf(MOST_MM**2 / largest, 6) + by_axis


def mean_errors(motions, from_centre):
    """The mean distance that the points move by, of each motion."""
    turned = Rotation.from_rotvec(motions[:, :3]).as_matrix() - np.eye(3)
    by_axis = (turned[:, k] @ from_centre.T + motions[:, 3 + k, None] for k in range(3))
    return np.sqrt(sum(one**2 for one in by_axis)).mean(axis=1)


def between(probability, low, high):
    """Four standard errors of both counts, and what the points leave open."""
    variance = max(probability * (1 - probability), 1 / DRAWS)
    error = 4 * math.sqrt(variance / THEIR_DRAWS + variance / DRAWS)
    return within(probability, error + max(high - probability, probability - low))


def judgement(probability, doubtful_above, wrong_above):
    """By the printed probability, which is compared by itself."""
    return "wrong" if probability > wrong_above else "doubtful" if probability > doubtful_above else "trusted"


def is_determined(pose):
    return pose.covariance is not None and np.isfinite(pose.covariance).all() and np.any(pose.covariance)


def predicted(call):
    pose, bone, options = call.one("pose", read_pose), call.one("model", surface.read), call.options
    if pose.deviations and not is_determined(pose):
        return {"failure_probability": exactly(1), "judgement": "wrong"}
    if not is_determined(pose):
        return {"failure_probability": exactly(math.nan), "judgement": "doubtful"}
    spread = spread_of(pose, bone)
    result = {
        "failure_probability": spread.failure,
        "predicted_mtre_mm": spread.mtre_mm,
        "predicted_axial_deg": spread.axial_deg,
        "judgement": judgement(call.printed["failure_probability"], options["doubtful_above"], options["wrong_above"]),
    }
    contradicted = False
    if call.has("prior"):
        figures, contradicted = against_prior(pose, call.one("prior", read_pose), bone.frame(), options)
        result |= figures
    if (pose.warnings or contradicted) and result["judgement"] == "trusted":
        result["judgement"] = "doubtful"
    return result


def against_prior(pose, prior, frame, options):
    """How far the pose is turned about the long axis from the prior, in the deviations of this difference: the variance
    of the prior less that of the pose, which lies between the prior and the images."""
    apart_deg = abs(motion(prior.world_from_ct, pose.world_from_ct, frame)[0][2])
    variances = [in_other_frame(one.covariance, one.frame, frame)[2, 2] for one in (prior, pose)]
    news = variances[0] - variances[1]
    result = {"prior_axial_deg": exactly(apart_deg)}
    if news <= 0.01 * variances[0]:
        return result, False
    deviations = math.radians(apart_deg) / math.sqrt(news)
    return result | {"prior_axial_deviations": exactly(deviations)}, deviations > options["contradicts_above"]


def of_evidence(call, printed):
    """The probability from the printed figures, by the failure model; and those figures that poses alone give."""
    pose, bone, options = call.one("pose", read_pose), call.one("model", surface.read), call.options
    if not options.get("failure_model"):
        return {"judgement": "doubtful"}
    model = read_yaml(call.run.file_of(options["failure_model"]))
    by_covariance = spread_of(pose, bone) if is_determined(pose) else None
    covered = by_covariance.failure if by_covariance else exactly(0)
    log_odds = model["bias"] + sum(
        term["weight"] * math.log1p(max(0.0, printed.get(term["figure"], term["absent"])) / term["scale"])
        for term in model["terms"]
    )
    by_model = 1 / (1 + math.exp(-log_odds))
    result = figures_of_poses(call, pose, bone)
    result["failure_probability"] = within(1 - (1 - by_model) * (1 - covered.value), (1 - by_model) * covered.allowed)
    result["judgement"] = judgement(printed["failure_probability"], model["doubtful_above"], model["wrong_above"])
    is_denied = any(
        printed.get(by + "apart_mm", 0) > MOST_MM or printed.get(by + "apart_deg", 0) > MOST_DEG
        for by in ("", "contour_")
    )
    is_denied |= printed.get("intersection_mm", 0) > options["max_intersection_mm"]
    if is_denied and result["judgement"] == "trusted":
        result["judgement"] = "doubtful"
    return result


def figures_of_poses(call, pose, bone):
    stages = call.many("stages", read_pose) if call.has("stages") else {}
    result = {"warnings": exactly(len(pose.warnings))}
    searched = list(stages.values())[-1] if stages else pose
    if is_determined(searched):
        spread = spread_of(searched, bone)
        result |= {"predicted_mtre_mm": spread.mtre_mm, "predicted_axial_deg": spread.axial_deg}
    # With a second cost, the node looks for the pose to which this leads by itself.
    contour = call.one("contour_pose", read_pose) if call.has("contour_pose") else stages.get("first")
    if contour and not call.has("contour_cost"):
        there, here, targets = contour.world_from_ct, pose.world_from_ct, Targets(call, 100)
        apart = np.linalg.norm(there(targets.points_mm) - here(targets.points_mm), axis=1)
        result["contour_apart_mm"] = targets.mean(apart)
        result["contour_apart_deg"] = exactly(abs(motion(here, there, bone.frame())[0][2]))
    return result


def evidence(call):
    printed = call.printed
    if printed.get("failure_probability") == 1 and len(printed) == 2:
        raise NotRecomputed("the images say nothing about this pose, so there are no figures")
    return of_evidence(call, printed)
