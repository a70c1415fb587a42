# SPDX-License-Identifier: Apache-2.0
"""A registration that begins where the cost is least among turns about the long axis. It shows how a node in Python
asks a cost for many poses at once, and uses a registration in C++, which also predicts deviations."""
from typing import Annotated, List, NamedTuple, Optional

import marrow
import numpy as np


class Found(NamedTuple):
    pose: marrow.Pose
    stages: Annotated[marrow.Items[marrow.Pose], marrow.over("stage")]


@marrow.node("register.new_node", summary="Registration by two costs, from the best of some turns about the long axis")
def new_node(
    cost: marrow.Cost,
    finer_cost: marrow.Cost,
    optimizer: marrow.Optimizer,
    start: marrow.Pose,
    finer_optimizer: Optional[marrow.Optimizer] = None,
    model: Optional[marrow.Mesh] = None,
    *,
    turns_deg: Annotated[List[float], "turns about the long axis to begin with"] = [-6.0, -3.0, 0.0, 3.0, 6.0],
) -> Found:
    if not turns_deg:
        raise marrow.Error("turns_deg is empty, but at least one turn is needed; 0 is the start itself")
    starts = [turned(start, turn_deg) for turn_deg in turns_deg]
    best = starts[int(np.argmin(cost(starts)))]  # one batch
    found = marrow.register.sequence(
        cost=cost,
        finer_cost=finer_cost,
        optimizer=optimizer,
        finer_optimizer=finer_optimizer,
        start=best,
        model=model,
        scan_rotation_deg=6,
    )
    return Found(found.pose, found.stages)


def turned(pose: marrow.Pose, turn_deg: float) -> marrow.Pose:
    """The pose after a turn of the bone about its long axis."""
    x, y, z = pose.axes[:, 2]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(turn_deg)
    turn = np.eye(4)
    turn[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross  # Rodrigues
    turn[:3, 3] = pose.origin_mm - turn[:3, :3] @ pose.origin_mm
    return marrow.Pose(pose.matrix @ turn, target=pose.target, source=pose.source, axes_of=pose)
