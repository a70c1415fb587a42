# SPDX-License-Identifier: Apache-2.0
"""Pinhole cameras, as docs/case.md describes their files."""
import dataclasses

import numpy as np

from rigid import Transform


@dataclasses.dataclass
class Camera:
    intrinsics: np.ndarray
    camera_from_world: Transform
    width_px: int
    height_px: int

    @staticmethod
    def of_map(values):
        return Camera(
            np.asarray(values["intrinsics"], float),
            transform_of(values["camera_from_world"]),
            values["width_px"],
            values["height_px"],
        )

    def project(self, world_mm):
        """Rows of pixels."""
        seen = self.camera_from_world(world_mm) @ self.intrinsics.T
        return seen[:, :2] / seen[:, 2:]

    def source_mm(self):
        return -self.camera_from_world.rotation.T @ self.camera_from_world.shift_mm

    def rays(self, pixels):
        """Unit directions in the world, from the source through the pixels."""
        seen = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(self.intrinsics).T
        seen /= np.linalg.norm(seen, axis=1)[:, None]
        return seen @ self.camera_from_world.rotation

    def on_a_plane(self, offsets_px, depth_mm):
        """Offsets in the image as mm on a plane that is parallel to the detector, at depths from the source."""
        slopes = np.linalg.solve(self.intrinsics[:2, :2], np.asarray(offsets_px).T).T
        return slopes * np.asarray(depth_mm)[..., None]

    def depth_mm(self, world_mm):
        return self.camera_from_world(world_mm)[..., 2]


def transform_of(values):
    """A transform in a YAML file: one matrix, or a rotation and a translation."""
    if "matrix" in values:
        return Transform.of_matrix(values["matrix"])
    return Transform(np.asarray(values["rotation"], float), np.asarray(values["translation_mm"], float))
