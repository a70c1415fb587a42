# SPDX-License-Identifier: Apache-2.0
"""A verdict by the predicted deviations of a pose: errors are drawn from the normal distribution with its covariance,
and those that are off are counted. A pose is off if its surface is off by more than 2 mm, or if it is rotated about the
long axis by more than 5 degrees."""
from typing import Annotated

import marrow
import numpy as np

MOST_MM, MOST_AXIAL_DEG, DRAWS = 2, 5, 4000


@marrow.node("verdict.new_node", summary="Judges a pose by errors drawn with its predicted covariance")
def new_node(
    pose: marrow.Pose,
    model: marrow.Mesh,
    *,
    doubtful_above: Annotated[float, marrow.at_least(0), marrow.at_most(1), "probability of a doubtful pose"] = 0.05,
    wrong_above: Annotated[float, marrow.at_least(0), marrow.at_most(1), "probability of a wrong pose"] = 0.5,
) -> marrow.Verdict:
    if pose.covariance is None or not np.isfinite(pose.covariance).all() or not pose.covariance.any():
        return marrow.Verdict(
            "doubtful",
            reasons=["nothing says how far the pose may be off along every axis"],
            remedies=["a registration that predicts its deviations, or another view"],
        )
    if len(model.vertices_mm) == 0:
        raise marrow.Error("the model is empty, so nothing says how far the bone may be off; wire its surface")
    off_mm, axial_deg = drawn_errors(pose, model.vertices_mm[:: max(len(model.vertices_mm) // 200, 1)])
    probability = float(np.mean((off_mm > MOST_MM) | (axial_deg > MOST_AXIAL_DEG)))
    figures = {
        "predicted_mtre_mm": np.sqrt(np.mean(off_mm**2)),
        "predicted_axial_deg": np.sqrt(np.mean(axial_deg**2)),
    }
    judgement = "wrong" if probability > wrong_above else "doubtful" if probability > doubtful_above else "trusted"
    if pose.warnings and judgement == "trusted":
        judgement = "doubtful"
    return marrow.Verdict(
        judgement,
        failure_probability=probability,
        reasons=[f"the registration warns: {warning}" for warning in pose.warnings]
        + ["the surface is known to {predicted_mtre_mm:.1f} mm".format(**figures)],
        remedies=[] if judgement == "trusted" else ["another view, from a different direction"],
        figures=marrow.Metrics(figures, {"predicted_mtre_mm": "mm", "predicted_axial_deg": "deg"}),
    )


def drawn_errors(pose: marrow.Pose, targets_mm: np.ndarray) -> tuple:
    """Of each draw: the mean distance by which the targets move, and the rotation about the long axis."""
    variances, directions = np.linalg.eigh(pose.covariance)
    motions = np.random.default_rng(1).normal(size=(DRAWS, 6)) * np.sqrt(np.maximum(variances, 0)) @ directions.T
    turns, shifts = motions[:, :3] @ pose.axes.T, motions[:, 3:] @ pose.axes.T
    moved = np.cross(turns[:, None], (targets_mm - pose.origin_mm)[None]) + shifts[:, None]  # of a small rotation
    return np.linalg.norm(moved, axis=2).mean(1), abs(np.degrees(motions[:, 2]))
