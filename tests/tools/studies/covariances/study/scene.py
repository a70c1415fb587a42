# SPDX-License-Identifier: Apache-2.0
"""A bone of three ellipsoids in soft tissue, and radiographs of it with noise. Small, so that a draw takes a second."""
import numpy as np
from scipy import ndimage
from scipy.spatial.transform import Rotation

import marrow

SIDE_PX = 192
SOURCE_TO_BONE_MM, SOURCE_TO_DETECTOR_MM, PIXEL_MM = 700, 1000, 0.8
WATER_PER_MM, PHOTONS = 0.02, 4000
ANGLES_DEG = (0, 90, 45)  # of the views about the long axis; of two views, the first two
BLUR_PX = 1.0
ELLIPSOIDS = (((0, 0, 8), (8, 11, 34)), ((11, -4, -20), (10, 11, 12)), ((-10, 5, -21), (9, 10, 10)))
TILT = Rotation.from_rotvec((0.1, 0.05, 0.4)).as_matrix()


def distances_mm(points_mm):
    """Approximately the signed distance from the bone's surface, exact to first order near it."""
    least = np.full(points_mm.shape[:-1], np.inf)
    for middle, radii in ELLIPSOIDS:
        inside = (points_mm - middle) @ TILT / radii
        length = np.linalg.norm(inside, axis=-1)
        slope = np.linalg.norm(inside / radii, axis=-1)
        least = np.minimum(least, length * (length - 1) / np.maximum(slope, 1e-9))
    return least


class Bone:
    """The CT of the bone, its surface, its distance field and its projectors."""

    def __init__(self):
        spacing, origin = 1.0, np.array([-36.0, -30.0, -42.0])
        z, y, x = np.mgrid[0:90, 0:60, 0:72]
        distance = distances_mm(origin + spacing * np.stack([x, y, z], axis=-1))
        grid = {"spacing_mm": (spacing,) * 3, "origin_mm": origin}
        self.volume = marrow.Volume((800 / (1 + np.exp(distance / 0.4))).astype("float32"), **grid)
        self.field = marrow.SignedField(np.clip(distance, -6, 6).astype("float32"), **grid)
        self.mesh = marrow.mesh.marching_cubes(field=self.field)
        self.radiographs = marrow.project.joseph(volume=self.volume, field=self.field, background_hu=0)
        self.outlines = marrow.project.silhouette_edges(model=self.mesh, volume=self.volume)
        start = marrow.initial.manual(model=self.mesh, start=marrow.Pose(np.eye(4)))
        self.axes, self.origin_mm = np.array(start.axes), np.array(start.origin_mm)

    def inputs(self, views, edges):
        """The inputs of a cost by their names."""
        return {
            "model": self.mesh,
            "volume": self.volume,
            "field": self.field,
            "views": views,
            "edges": edges,
            "outline": self.outlines,
        }


def rigid(rotation_vector_rad, shift_mm):
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(rotation_vector_rad).as_matrix()
    matrix[:3, 3] = shift_mm
    return matrix


def camera(angle_deg, side_px=SIDE_PX):
    """A camera that looks at the world's origin, across the z axis, with z up in the image."""
    pixel_mm = PIXEL_MM * SIDE_PX / side_px
    focal_px, middle_px = SOURCE_TO_DETECTOR_MM / pixel_mm, (side_px - 1) / 2
    angle = np.radians(angle_deg)
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = [[np.cos(angle), np.sin(angle), 0], [0, 0, -1], [-np.sin(angle), np.cos(angle), 0]]
    camera_from_world[2, 3] = SOURCE_TO_BONE_MM
    intrinsics = [[focal_px, 0, middle_px], [0, focal_px, middle_px], [0, 0, 1]]
    return marrow.Camera(side_px, side_px, intrinsics, camera_from_world)


def tissue_mm(side_px=SIDE_PX):
    """Soft tissue, thickest in the middle."""
    v, u = np.mgrid[-1 : 1 : side_px * 1j, -1 : 1 : side_px * 1j]
    return 90 - 25 * u**2 - 10 * v**2 + 4 * np.sin(5 * u + 3 * v)


def views_of(bone, truth, count, random):
    """Radiographs of the bone at a pose: blur, then the noise of single photons."""
    views = {}
    for angle_deg in ANGLES_DEG[:count]:
        of_view = camera(angle_deg)
        blank = marrow.View(np.ones((SIDE_PX, SIDE_PX), "uint16"), of_view, name="blank")
        water_mm = np.array(bone.radiographs(blank, truth)) + tissue_mm()
        photons = random.poisson(PHOTONS * ndimage.gaussian_filter(np.exp(-WATER_PER_MM * water_mm), BLUR_PX))
        name = "at_%d" % angle_deg
        views[name] = marrow.View((8 * photons).astype("uint16"), of_view, name=name)
    return views


def error(truth, found):
    """The motion from the true pose to the found one: about (rad) and along (mm) the axes of the found one's frame."""
    motion = np.linalg.inv(truth) @ found.matrix
    axes, origin = np.array(found.axes), np.array(found.origin_mm)
    turn = Rotation.from_matrix(motion[:3, :3]).as_rotvec()
    shift = motion[:3, :3] @ origin + motion[:3, 3] - origin
    return np.concatenate([axes.T @ turn, axes.T @ shift])
