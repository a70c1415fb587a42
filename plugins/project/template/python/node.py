# SPDX-License-Identifier: Apache-2.0
"""Radiographs slice by slice (Joseph, IEEE Trans Med Imaging 1982): each ray is interpolated where it crosses a slice
of the volume."""
from typing import Annotated, Optional

import marrow
import numpy as np


@marrow.projector("project.new_node", summary="Line integrals through the slices of the CT, interpolated, in Python")
def new_node(
    volume: marrow.Volume,
    field: Optional[marrow.SignedField] = None,
    *,
    margin_mm: Annotated[float, marrow.at_least(0), "how far from the fragment's surface a voxel still counts"] = 1,
):
    model = Slices(volume, field, margin_mm)
    return model.radiograph, model.corners_mm()


class Slices:
    """The part of a CT that shows the model, with a border of zeros."""

    def __init__(self, volume: marrow.Volume, field: Optional[marrow.SignedField], margin_mm: float) -> None:
        spacing_mm = np.array(volume.spacing_mm)
        if not (np.isfinite(volume.array).all() and (spacing_mm > 0).all()):
            raise marrow.Error("the volume has values that are not finite, or spacings that are not positive")
        water = np.maximum(1 + volume.array / 1000, 0)  # the attenuation of each voxel, relative to that of water
        if field is not None:
            if field.array.shape != water.shape:
                raise marrow.Error("volume and field differ in size; give the field that was made from this volume")
            water = np.where(field.array <= margin_mm, water, 0)  # voxels at the surface are bone in part
        ends = [(one.min(), one.max() + 1) if len(one) else (0, 1) for one in np.nonzero(water)]
        cut = water[tuple(slice(*one) for one in ends)]
        self.values = np.pad(cut.transpose(2, 1, 0), 1).astype("float32")  # [x, y, z]
        self.model_from_index = np.eye(4)
        self.model_from_index[:3, :3] = volume.direction @ np.diag(spacing_mm)
        first = np.array([begin for begin, _ in reversed(ends)]) - 1
        self.model_from_index[:3, 3] = volume.origin_mm + self.model_from_index[:3, :3] @ first

    def corners_mm(self) -> np.ndarray:
        """The corners of the box: beyond them there is nothing."""
        index = np.array(np.meshgrid(*[(0, size - 1) for size in self.values.shape])).reshape(3, -1)
        return (self.model_from_index[:3, :3] @ index + self.model_from_index[:3, 3:]).T

    def radiograph(self, camera: marrow.Camera, pose: np.ndarray, pixels: np.ndarray) -> np.ndarray:
        """Sums along the rays through the pixels [N, 2], in mm of water."""
        seen = np.linalg.inv(camera.intrinsics) @ np.column_stack([pixels, np.ones(len(pixels))]).T
        index_from_camera = np.linalg.inv(camera.camera_from_world @ pose @ self.model_from_index)
        source, rays = index_from_camera[:3, 3], index_from_camera[:3, :3] @ seen
        main = int(np.argmax(abs(index_from_camera[:3, 2])))  # the slices are across the optical axis
        others = [axis for axis in range(3) if axis != main]
        with np.errstate(divide="ignore"):
            per_slice = 1 / rays[main]
        total = np.zeros(len(pixels), "float32")
        for number, one in enumerate(np.moveaxis(self.values, main, 0)):
            along = (number - source[main]) * per_slice
            if not (along > 0).any() or not one.any():
                continue
            places = [source[axis] + along * rays[axis] for axis in others]
            total += np.where(along > 0, interpolated(one, *places), 0)
        return np.nan_to_num(total * np.linalg.norm(seen, axis=0) * abs(per_slice), posinf=0)


def interpolated(values: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Bilinear interpolation. Beyond the border, which is 0, it is 0."""
    row, column = (np.clip(place, 0, size - 1) for place, size in zip((row, column), values.shape))
    top, left = np.minimum(row.astype(int), len(values) - 2), np.minimum(column.astype(int), values.shape[1] - 2)
    down, right = (row - top).astype("float32"), (column - left).astype("float32")
    flat, width, first = values.ravel(), values.shape[1], top * values.shape[1] + left
    upper = flat[first] + right * (flat[first + 1] - flat[first])
    lower = flat[first + width] + right * (flat[first + width + 1] - flat[first + width])
    return upper + down * (lower - upper)
