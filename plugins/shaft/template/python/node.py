# SPDX-License-Identifier: Apache-2.0
"""The shaft's borders by Hough lines, each fitted once more to the edge pixels near it. It shows how a node in Python
uses one in C++."""
from typing import Annotated

import marrow
import numpy as np


@marrow.node("shaft.new_node", summary="Hough lines in pairs, then a straight line through the edge pixels near each")
def new_node(
    edges: marrow.EdgeMap,
    view: marrow.View,
    *,
    reach_px: Annotated[float, marrow.at_least(0.5), marrow.at_most(20), "how near an edge pixel must be"] = 2,
    outline: Annotated[bool, "move the borders outward by what blur has drawn them inward"] = True,
) -> marrow.ShaftLines:
    found = marrow.shaft.hough_pairs(edges, view, outline=outline)
    left, right = (fitted(np.array(line), edges.pixels, reach_px) for line in (found.left, found.right))
    return marrow.ShaftLines(
        left,
        right,
        width_mm=found.width_mm,
        width_deviation_mm=found.width_deviation_mm,
        log_likelihood=found.log_likelihood,
        rejected=found.rejected,
    )


def fitted(ends: np.ndarray, pixels: np.ndarray, reach_px: float) -> np.ndarray:
    """The ends of a border, moved across it to the line through the edge pixels near it whose gradients cross it."""
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    across = np.array([-along[1], along[0]])
    place, offset = (pixels[:, :2] - ends[0]) @ along, (pixels[:, :2] - ends[0]) @ across
    near = (abs(offset) <= reach_px) & (place >= 0) & (place <= np.linalg.norm(ends[1] - ends[0]))
    near &= abs(pixels[:, 2:4] @ across) > 0.9
    if near.sum() < 10:
        return ends
    line = np.polynomial.Polynomial.fit(place[near], offset[near], 1)
    return ends + np.outer(line((ends - ends[0]) @ along), across)
