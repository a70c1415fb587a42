# SPDX-License-Identifier: Apache-2.0
"""Edges where the smoothed image changes fastest along its gradient."""
from typing import Annotated

import marrow
import numpy as np


@marrow.node("edges.new_node", summary="Greatest slopes of the smoothed image, above a multiple of its noise")
def new_node(
    view: marrow.View,
    *,
    sigma_px: Annotated[
        float, marrow.at_least(0.7), marrow.at_most(10), "deviation of the Gaussian that smooths"
    ] = 1.5,
    least: Annotated[float, marrow.at_least(0), "least slope of an edge, in multiples of the slopes' noise"] = 3,
) -> marrow.EdgeMap:
    grey = view.image.array.astype(float)
    if min(grey.shape) < 3 or not np.isfinite(grey).all():
        raise marrow.Error("expected at least 3 x 3 pixels, all of them finite; give another image")
    dv, du = np.gradient(smoothed(grey, sigma_px))
    slope = np.hypot(du, dv)
    offset = offset_of_greatest(slope, du, dv)
    noise = 1.48 * np.median(np.abs(du - np.median(du)))
    is_edge = np.isfinite(offset) & (slope > max(least * noise, 1e-6 * np.ptp(grey)))
    if view.mask is not None:
        is_edge &= view.mask != 0
    v, u = np.nonzero(is_edge)
    direction = np.column_stack([du[v, u], dv[v, u]]) / slope[v, u, None]
    place = np.column_stack([u, v]) + offset[v, u, None] * direction
    inside = (np.abs(place + 0.5 - np.array(grey.shape[::-1]) / 2) <= np.array(grey.shape[::-1]) / 2).all(axis=1)
    pixels = np.column_stack([place, direction, slope[v, u]])[inside]
    return marrow.EdgeMap(pixels, width_px=grey.shape[1], height_px=grey.shape[0])


def smoothed(grey: np.ndarray, sigma_px: float) -> np.ndarray:
    """The image after a Gaussian, by one axis after the other."""
    reach = int(np.ceil(3 * sigma_px))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma_px) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        padded = np.pad(grey, [(reach, reach) if one == axis else (0, 0) for one in (0, 1)], mode="edge")
        count = grey.shape[axis]
        grey = sum(weight * padded.take(range(i, i + count), axis) for i, weight in enumerate(weights))
    return grey


def offset_of_greatest(slope: np.ndarray, du: np.ndarray, dv: np.ndarray) -> np.ndarray:
    """How far from each pixel, along the gradient, the slope is greatest; NaN where another pixel is nearer to that."""
    with np.errstate(invalid="ignore", divide="ignore"):
        step_u, step_v = du / slope, dv / slope
        before, after = at(slope, -step_u, -step_v), at(slope, step_u, step_v)
        offset = 0.5 * (before - after) / (before - 2 * slope + after)
        nearest = np.maximum(np.abs(offset * step_u), np.abs(offset * step_v)) <= 0.5
    return np.where((slope > before) & (slope >= after) & nearest, offset, np.nan)


def at(values: np.ndarray, step_u: np.ndarray, step_v: np.ndarray) -> np.ndarray:
    """The values one step from each pixel, by bilinear interpolation."""
    rows, columns = values.shape
    v, u = np.mgrid[0:rows, 0:columns]
    v, u = np.clip(v + np.nan_to_num(step_v), 0, rows - 1), np.clip(u + np.nan_to_num(step_u), 0, columns - 1)
    top, left = np.minimum(v.astype(int), rows - 2), np.minimum(u.astype(int), columns - 2)
    v, u = v - top, u - left
    upper = (1 - u) * values[top, left] + u * values[top, left + 1]
    lower = (1 - u) * values[top + 1, left] + u * values[top + 1, left + 1]
    return (1 - v) * upper + v * lower
