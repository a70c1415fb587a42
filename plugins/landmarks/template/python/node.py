# SPDX-License-Identifier: Apache-2.0
"""Points where the image around them correlates best with the fragment's radiograph at the start. It has numpy only; a
network of your own would take the place of `best_place`."""
from typing import Annotated

import marrow
import numpy as np

CONSTANT = 1e-6  # deviation of a radiograph that shows nothing


@marrow.node("landmarks.new_node", summary="Places of the highest correlation with the radiograph at the start")
def new_node(
    points: marrow.Landmarks,
    views: Annotated[marrow.Items[marrow.View], marrow.over("view")],
    projector: marrow.RadiographProjector,
    start: marrow.Pose,
    *,
    patch_px: Annotated[int, marrow.at_least(5), marrow.at_most(400), "side of the square that is compared"] = 80,
    reach_px: Annotated[int, marrow.at_least(1), marrow.at_most(400), "greatest distance from the start's place"] = 32,
    step_px: Annotated[int, marrow.at_least(1), marrow.at_most(16), "every so-many-th pixel is compared"] = 2,
    least: Annotated[float, marrow.at_least(0), marrow.at_most(1), "least correlation of a point that is seen"] = 0.5,
) -> marrow.Landmarks:
    if not points.points_mm:
        raise marrow.Error("there are no points to look for; give their places in the CT")
    seen = {}
    for name, view in views.items():
        image, drawn = (cells(pixels, step_px) for pixels in (line_integrals(view), projector(view, start)))
        found = {}
        for point, place_mm in points.points_mm.items():
            pixel = project(view.camera, start.matrix, place_mm)
            cell = np.rint((pixel - 0.5 * (step_px - 1)) / step_px).astype(int)
            if (cell < 0).any() or (cell >= image.shape[::-1]).any():
                continue
            best = best_place(image, drawn, cell, patch_px // step_px, reach_px // step_px)
            if best and best[1] >= least:
                shift, correlation = best
                deviation = step_px * (0.5 + 4 * (1 - correlation))  # a guess; measure it for your node
                found[point] = (*(pixel + step_px * shift), deviation)
        seen[name] = found
    return marrow.Landmarks(points.points_mm, seen)


def line_integrals(view: marrow.View) -> np.ndarray:
    grey = view.image.array.astype(float)
    if min(grey.shape) < 8 or not np.isfinite(grey).all():
        raise marrow.Error("expected at least 8 x 8 pixels, all of them finite; give another image")
    values = -np.log(np.clip(grey / max(grey.max(), 1e-9), 0.005, 1))
    if view.mask is not None and (view.mask != 0).any():
        values[view.mask == 0] = values[view.mask != 0].mean()
    return values


def cells(values: np.ndarray, side: int) -> np.ndarray:
    """Means over squares of pixels."""
    rows, columns = (length // side for length in values.shape)
    return values[: rows * side, : columns * side].reshape(rows, side, columns, side).mean(axis=(1, 3))


def project(camera: marrow.Camera, world_from_model: np.ndarray, place_mm: np.ndarray) -> np.ndarray:
    seen = camera.intrinsics @ (camera.camera_from_world @ world_from_model @ np.append(place_mm, 1))[:3]
    if not (np.isfinite(seen).all() and seen[2] > 0):
        raise marrow.Error("the start puts a point behind the source; is it in the world's frame?")
    return seen[:2] / seen[2]


def best_place(image: np.ndarray, drawn: np.ndarray, cell: np.ndarray, side: int, reach: int):
    """The shift in cells with the highest correlation, and this; None at the border of what was searched."""
    half = side // 2 + reach
    window, patch = (
        np.pad(values, half, mode="edge")[cell[1] : cell[1] + 2 * half + 1, cell[0] : cell[0] + 2 * half + 1]
        for values in (image, drawn)
    )
    patch = patch[reach : 2 * half + 1 - reach, reach : 2 * half + 1 - reach]
    patch = patch - patch.mean()
    if np.sqrt((patch**2).mean()) < CONSTANT:
        return None
    parts = np.lib.stride_tricks.sliding_window_view(window, patch.shape)
    products = np.einsum("ijkl,kl->ij", parts, patch)
    lengths = np.sqrt(np.maximum(((parts - parts.mean(axis=(2, 3), keepdims=True)) ** 2).sum(axis=(2, 3)), 1e-12))
    correlation = products / (lengths * np.linalg.norm(patch))
    v, u = np.unravel_index(np.argmax(correlation), correlation.shape)
    if not (0 < v < 2 * reach and 0 < u < 2 * reach):
        return None
    peak = correlation[v, u]
    offset = [
        0.5 * (after - before) / max(2 * peak - before - after, 1e-9)
        for before, after in (correlation[v, [u - 1, u + 1]], correlation[[v - 1, v + 1], u])
    ]
    return np.array([u, v]) - reach + offset, peak
