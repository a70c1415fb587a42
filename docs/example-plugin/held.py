from typing import Annotated

import marrow
import numpy as np


@marrow.cost("similarity.held", summary="Another cost, plus a weight for each mm away from the start")
def held(cost: marrow.Cost, start: marrow.Pose, *, weight: Annotated[float, marrow.at_least(0), "cost of a mm"] = 0.01):
    def costs(poses):  # [N, 4, 4]: from the model to the world, in mm
        away_mm = np.linalg.norm(poses[:, :3, 3] - start.matrix[:3, 3], axis=1)
        return cost(poses) + weight * away_mm  # [N]

    return costs
