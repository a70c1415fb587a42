# SPDX-License-Identifier: Apache-2.0
"""Rigid transforms, small motions of a fragment and their covariances, by scipy's rotations, and pinhole cameras, as
docs/case.md describes their files."""
import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation


@dataclasses.dataclass
class Transform:
    """x_target = rotation @ x_source + shift_mm."""

    rotation: np.ndarray
    shift_mm: np.ndarray

    @staticmethod
    def of_matrix(matrix):
        matrix = np.asarray(matrix, float)
        return Transform(matrix[:3, :3], matrix[:3, 3])

    def __call__(self, points_mm):
        """Of one point, or of rows of points."""
        return np.asarray(points_mm) @ self.rotation.T + self.shift_mm

    def __matmul__(self, other):
        return Transform(self.rotation @ other.rotation, self.rotation @ other.shift_mm + self.shift_mm)

    def inverse(self):
        return Transform(self.rotation.T, -self.rotation.T @ self.shift_mm)


@dataclasses.dataclass
class Frame:
    """A fragment's axes in the CT. The columns of `axes` are the frontal, the lateral and the long axis."""

    origin_mm: np.ndarray
    axes: np.ndarray


def turn_deg(rotation):
    """Axis times angle of a rotation matrix."""
    return np.degrees(Rotation.from_matrix(rotation).as_rotvec())


def angle_between_deg(one, other):
    """The angle of the rotation between two transforms."""
    return np.linalg.norm(turn_deg(one.rotation @ other.rotation.T))


def motion(first, second, frame):
    """How a fragment has moved from the first place to the second: its turn [deg] about its axes, and the shift [mm] of
    its centroid along them, both as they lie at the first place. Computed in the world."""
    axes_in_world = first.rotation @ frame.axes
    turn = turn_deg(second.rotation @ first.rotation.T)
    return axes_in_world.T @ turn, axes_in_world.T @ (second(frame.origin_mm) - first(frame.origin_mm))


def in_other_frame(covariance, frame, other):
    """The covariance of a small motion (turn [rad], shift [mm]) in another frame of the same fragment. A turn r and a
    shift t of one point shift the point d away from it by t + r x d."""
    turn = other.axes.T @ frame.axes
    apart = other.origin_mm - frame.origin_mm
    lever = np.column_stack([other.axes.T @ np.cross(axis, apart) for axis in frame.axes.T])
    change = np.block([[turn, np.zeros((3, 3))], [lever, turn]])
    return change @ covariance @ change.T


def draw_motions(covariance, count, seed):
    """Errors drawn from the normal distribution: rows of turn [rad] and shift [mm]."""
    values, vectors = np.linalg.eigh(np.asarray(covariance, float))
    normal = np.random.default_rng(seed).standard_normal((count, 6))
    return normal * np.sqrt(np.clip(values, 0, None)) @ vectors.T


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
