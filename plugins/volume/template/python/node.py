# SPDX-License-Identifier: Apache-2.0
"""Less noise in a CT: each voxel becomes the median of itself and its six neighbours. Edges stay where they are."""
from typing import Annotated

import marrow
import numpy as np


@marrow.node("volume.new_node", summary="The median of each voxel and its six neighbours")
def new_node(
    volume: marrow.Volume,
    *,
    passes: Annotated[int, marrow.at_least(0), marrow.at_most(10), "how often it is taken"] = 1,
) -> marrow.Volume:
    if not np.isfinite(volume.array).all():
        raise marrow.Error("a voxel of the CT is not a number; replace it, with -1000 HU for air")
    samples = volume.array
    for _ in range(passes):
        samples = median_of_neighbours(samples)
    place = {"spacing_mm": volume.spacing_mm, "origin_mm": volume.origin_mm, "direction": volume.direction}
    return marrow.Volume(samples, frame=volume.frame, **place)


def median_of_neighbours(samples: np.ndarray) -> np.ndarray:
    z, y, x = samples.shape
    padded = np.pad(samples, 1, mode="edge")
    shifts = [(1, 1, 1), (0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2)]
    return np.median([padded[k : k + z, j : j + y, i : i + x] for k, j, i in shifts], axis=0)
