# SPDX-License-Identifier: Apache-2.0
"""How badly a radiograph that is splatted from the bone's voxels agrees with the images: the correlation of their
gradients, on a coarse grid of cells."""
from typing import Annotated

import marrow
import numpy as np

WORST = 1.0  # where nothing can be compared
NEAREST_MM = 10  # nearer to the source, a voxel is not drawn
LEAST_CELLS = 16  # that are compared
LEAST_HU = 50  # a voxel that differs less from soft tissue is left out


@marrow.cost(
    "similarity.new_node",
    summary="1 - correlation of the gradients of image and splatted voxels, on a grid of cells",
    traits=["unmoved_by_gain"],
)
def new_node(
    volume: marrow.Volume,
    field: marrow.SignedField,
    views: Annotated[marrow.Items[marrow.View], marrow.over("view")],
    *,
    cell_px: Annotated[int, marrow.at_least(1), marrow.at_most(32), "side of a cell"] = 4,
):
    if not views:
        raise marrow.Error("expected one view at least, got none")
    voxels, excess = bone_voxels(volume, field)
    images = [Seen(view, cell_px) for view in views.values()]

    def costs(poses: np.ndarray) -> np.ndarray:
        return np.array([np.mean([one.cost(voxels, excess, pose) for one in images]) for pose in poses])

    return costs


def bone_voxels(volume: marrow.Volume, field: marrow.SignedField) -> "tuple[np.ndarray, np.ndarray]":
    """The places of the bone's voxels [xyz1, N] in mm, and how much denser than soft tissue each is."""
    if volume.array.shape != field.array.shape:
        raise marrow.Error("volume and field differ in size; give the field that was made from this volume")
    chosen = (field.array < 0) & (abs(volume.array) >= LEAST_HU)
    z, y, x = np.nonzero(chosen)
    index = np.stack([x, y, z]) * np.reshape(volume.spacing_mm, (3, 1))
    place_mm = np.reshape(volume.origin_mm, (3, 1)) + volume.direction @ index
    return np.vstack([place_mm, np.ones(len(x))]), volume.array[chosen].astype(float)


class Seen:
    """One view on its grid of cells: the gradients of its line integrals, and which cells count."""

    def __init__(self, view: marrow.View, cell_px: int) -> None:
        grey, camera = view.image.array.astype(float), view.camera
        if grey.shape != (camera.height_px, camera.width_px):
            raise marrow.Error("the image of view '%s' has not the size that its camera says" % view.name)
        if not (np.isfinite(camera.intrinsics).all() and np.isfinite(camera.camera_from_world).all()):
            raise marrow.Error("the camera of view '%s' has numbers that are not finite" % view.name)
        self.rows, self.columns = grey.shape[0] // cell_px, grey.shape[1] // cell_px
        if min(self.rows, self.columns) < 4:
            raise marrow.Error("the image of view '%s' has fewer than 4 x 4 cells; lower cell_px" % view.name)
        good = np.isfinite(grey) & (True if view.mask is None else view.mask != 0)
        brightest = max(grey[good].max(initial=0), 1e-9)
        integrals = -np.log(np.clip(np.where(good, grey, brightest) / brightest, 1e-4, 1))
        self.gradient = gradient(self._in_cells(integrals, cell_px).mean(axis=(1, 3)))
        self.counts = shrunk(self._in_cells(good, cell_px).all(axis=(1, 3)), 2)
        cell_from_pixel = np.array(
            [[1 / cell_px, 0, 0.5 / cell_px - 0.5], [0, 1 / cell_px, 0.5 / cell_px - 0.5], [0, 0, 1]]
        )
        self.cell_from_world = cell_from_pixel @ camera.intrinsics @ camera.camera_from_world[:3]

    def _in_cells(self, pixels: np.ndarray, cell_px: int) -> np.ndarray:
        whole = pixels[: self.rows * cell_px, : self.columns * cell_px]
        return whole.reshape(self.rows, cell_px, self.columns, cell_px)

    def cost(self, voxels: np.ndarray, excess: np.ndarray, world_from_model: np.ndarray) -> float:
        drawn = self.splatted(voxels, excess, world_from_model)
        shown = grown(drawn != 0, 2) & self.counts
        if shown.sum() < LEAST_CELLS:
            return WORST
        ours, theirs = gradient(drawn)[:, shown], self.gradient[:, shown]
        length = np.linalg.norm(ours) * np.linalg.norm(theirs)
        return WORST if length < 1e-12 else 1 - (ours * theirs).sum() / length

    def splatted(self, voxels: np.ndarray, excess: np.ndarray, world_from_model: np.ndarray) -> np.ndarray:
        """The voxels' shadow: each is shared among the four cells about the place where it is seen."""
        u, v, depth_mm = (self.cell_from_world @ world_from_model) @ voxels
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = u / depth_mm, v / depth_mm
            seen = (depth_mm > NEAREST_MM) & (u >= 0) & (v >= 0) & (u < self.columns - 1) & (v < self.rows - 1)
        u, v, weight = u[seen], v[seen], excess[seen] / depth_mm[seen] ** 2
        left, top = u.astype(int), v.astype(int)
        u, v, cell = u - left, v - top, top * self.columns + left
        shadow = np.zeros(self.rows * self.columns)
        for step, share in (
            (0, (1 - u) * (1 - v)),
            (1, u * (1 - v)),
            (self.columns, (1 - u) * v),
            (self.columns + 1, u * v),
        ):
            shadow += np.bincount(cell + step, share * weight, len(shadow))
        return shadow.reshape(self.rows, self.columns)


def gradient(values: np.ndarray) -> np.ndarray:
    """The slopes [2, row, column], after the weights 1, 2, 1 across rows and columns."""
    padded = np.pad(values, 1, mode="edge")
    padded = (padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4
    return np.stack(np.gradient((padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]) / 4))


def grown(area: np.ndarray, cells: int) -> np.ndarray:
    """The area and all that lies within so many cells of it."""
    for _ in range(cells):
        padded = np.pad(area, 1)
        area = padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:] | area
    return area


def shrunk(area: np.ndarray, cells: int) -> np.ndarray:
    return ~grown(~area, cells)
