from typing import Annotated

import marrow
import numpy as np


@marrow.node("edges.steepest_python", summary="Every pixel whose grey value changes fast")
def steepest(
    view: marrow.View,
    *,
    least: Annotated[float, marrow.at_least(0), marrow.unit("grey/px"), "least change that makes an edge"] = 500,
) -> Annotated[marrow.EdgeMap, "edge pixels"]:
    grey = view.image.array.astype(np.float32)
    du, dv = np.zeros_like(grey), np.zeros_like(grey)
    du[1:-1, 1:-1] = (grey[1:-1, 2:] - grey[1:-1, :-2]) / 2
    dv[1:-1, 1:-1] = (grey[2:, 1:-1] - grey[:-2, 1:-1]) / 2
    slope = np.hypot(du, dv)
    inside = np.zeros(grey.shape, bool)
    inside[1:-1, 1:-1] = True
    v, u = np.nonzero(inside & (slope >= least))
    size = slope[v, u]
    pixels = np.column_stack([u, v, du[v, u] / size, dv[v, u] / size, size])
    return marrow.EdgeMap(pixels, width_px=grey.shape[1], height_px=grey.shape[0])
