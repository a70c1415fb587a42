# SPDX-License-Identifier: Apache-2.0
"""Fragments by a threshold, in a CT whose noise was averaged. It shows how a node in Python uses one in C++."""
from typing import Annotated

import marrow
import numpy as np


@marrow.node("segment.new_node", summary="A threshold in the CT after a mean over neighbours")
def new_node(
    volume: marrow.Volume,
    seeds: Annotated[marrow.Items[marrow.Seeds], marrow.over("fragment")],
    *,
    weight: Annotated[float, marrow.at_least(0), marrow.at_most(1), "weight of the neighbours"] = 0.2,
) -> Annotated[marrow.Items[marrow.SignedField], marrow.over("fragment")]:
    samples = (1 - weight) * volume.array + weight * mean_along_axes(volume.array)
    place = {"spacing_mm": volume.spacing_mm, "origin_mm": volume.origin_mm, "direction": volume.direction}
    return marrow.segment.threshold(marrow.Volume(samples, frame=volume.frame, **place), seeds)


def mean_along_axes(samples: np.ndarray) -> np.ndarray:
    """The mean of the two neighbours along each axis."""
    padded = np.pad(samples, 1, mode="edge")
    total = padded[2:, 1:-1, 1:-1] + padded[:-2, 1:-1, 1:-1] + padded[1:-1, 2:, 1:-1]
    total = total + padded[1:-1, :-2, 1:-1] + padded[1:-1, 1:-1, 2:] + padded[1:-1, 1:-1, :-2]
    return total / 6
