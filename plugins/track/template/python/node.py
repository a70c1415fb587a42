# SPDX-License-Identifier: Apache-2.0
"""Better poses of a bone: each becomes the median of its neighbours in time, so that one wrong pose does no harm."""
from typing import Annotated

import marrow
import numpy as np


@marrow.node("track.new_node", summary="The median of the poses of neighbouring frames")
def new_node(
    poses: Annotated[marrow.Items[marrow.Pose], marrow.over("frame"), "measured poses, frame after frame"],
    *,
    reach: Annotated[int, marrow.at_least(0), marrow.at_most(20), "number of neighbours to either side"] = 2,
) -> Annotated[marrow.Items[marrow.Pose], marrow.over("frame"), marrow.named("poses"), "better poses"]:
    names, matrices = list(poses), [pose.matrix for pose in poses.values()]
    return {name: marrow.Pose(median_about(matrices, i, reach)) for i, name in enumerate(names)}


def median_about(matrices: list, middle: int, reach: int) -> np.ndarray:
    """The pose whose motion from the pose in the middle is the median of the neighbours' motions from it."""
    reach = min(reach, middle, len(matrices) - 1 - middle)  # as many before as after, so that motion does not pull
    back = np.linalg.inv(matrices[middle])
    motions = [motion_of(back @ matrix) for matrix in matrices[middle - reach : middle + reach + 1]]
    return matrices[middle] @ matrix_of(np.median(motions, axis=0))


def motion_of(matrix: np.ndarray) -> np.ndarray:
    """Rotation vector [rad] and shift [mm] of a motion by less than half a turn."""
    turn = matrix[:3, :3]
    twice_sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = np.linalg.norm(twice_sine) / 2
    angle = np.arctan2(sine, (np.trace(turn) - 1) / 2)
    vector = twice_sine / 2 * (angle / sine if sine > 1e-9 else 1)
    return np.concatenate([vector, matrix[:3, 3]])


def matrix_of(motion: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(motion[:3])
    x, y, z = motion[:3] / angle if angle > 0 else np.zeros(3)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    matrix[:3, 3] = motion[3:]
    return matrix
