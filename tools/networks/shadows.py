# SPDX-License-Identifier: Apache-2.0
"""Shadows of a surface from all sides: the length of each ray in its inside, and where its points are. Made by marrow's
Python package (project.joseph on volume.filled_surface), which draws hundreds a minute on one core."""
import dataclasses
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
INSIDE_HU, VOXELS = 1000, 160  # a value of 1000 HU is twice as dense as water; voxels along the longest side
WATER = 1 + INSIDE_HU / 1000  # mm of water for a mm of the inside


def marrow():
    """marrow's Python package, of the build folder if there is one."""
    built = ROOT / "build/python"
    if built.exists() and str(built) not in sys.path:
        sys.path.insert(0, str(built))
    try:
        import marrow as package
    except ImportError as error:
        sys.exit("train: marrow's Python package is missing (%s); build marrow first, with tools/setup" % error)
    return package


@dataclasses.dataclass
class Shadows:
    """Of each pose a square picture of chords in mm whose middle is the middle of the surface's box, and the pixels
    (u, v) of the points in it."""

    chords_mm: np.ndarray  # poses x rows x columns
    points_px: np.ndarray  # poses x points x 2

    def __len__(self):
        return len(self.chords_mm)


def random_rotation(random):
    """Uniform over all rotations: a normalised quaternion of normal numbers."""
    w, x, y, z = (q := random.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def turned_by(random, deg):
    """A rotation by up to `deg` about a random axis; above 180: any rotation."""
    if deg >= 180:
        return random_rotation(random)
    axis = random.normal(size=3)
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(deg) * random.uniform()
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def middle_of(vertices_mm):
    return 0.5 * (vertices_mm.min(axis=0) + vertices_mm.max(axis=0))


def filled(mesh):
    """The surface filled with metal as a projector, and its diameter about the middle of its box."""
    package = marrow()
    vertices = np.asarray(mesh.vertices_mm)
    longest = float(np.ptp(vertices, axis=0).max())
    spacing = float(np.clip(longest / VOXELS, 0.05, 10))
    volume = package.volume.filled_surface(mesh, spacing_mm=spacing, inside_hu=INSIDE_HU)
    diameter = 2 * float(np.linalg.norm(vertices - middle_of(vertices), axis=1).max())
    return package.project.joseph(volume=volume), diameter


def poses_of(random, count, distances_mm, about=None, deg=180):
    """Rotations from the model to the camera and distances: about one rotation, or any."""
    rotations = [turned_by(random, deg) @ (np.eye(3) if about is None else about) for _ in range(count)]
    return rotations, random.uniform(*distances_mm, count)


def shadows_of(mesh, points_mm, poses, pixel_mm, progress=""):
    """The shadows of a surface. A pixel is pixel_mm wide at the middle of the surface."""
    package = marrow()
    projector, diameter = filled(mesh)
    middle = middle_of(np.asarray(mesh.vertices_mm))
    near = min(poses[1])
    side = int(np.ceil(diameter / pixel_mm * near / (near - diameter / 2))) + 4
    chords = np.zeros((len(poses[0]), side, side), np.float16)
    points_px = np.zeros((len(poses[0]), len(points_mm), 2), np.float32)
    centre = 0.5 * (side - 1)
    for i, (rotation, distance) in enumerate(zip(*poses)):
        focal = distance / pixel_mm
        camera = package.Camera(side, side, [[focal, 0, centre], [0, focal, centre], [0, 0, 1]], np.eye(4))
        pose = np.eye(4)
        pose[:3, :3] = rotation
        pose[:3, 3] = [0, 0, distance] - rotation @ middle
        chords[i] = np.asarray(projector(camera, pose)) / WATER
        seen = points_mm @ rotation.T + pose[:3, 3]
        points_px[i] = focal * seen[:, :2] / seen[:, 2:] + centre
        if progress and i % 100 == 99:
            print("\r%s: %d of %d" % (progress, i + 1, len(chords)), end="", file=sys.stderr, flush=True)
    if progress:
        print(file=sys.stderr)
    return Shadows(chords, points_px)


def kept(file, make):
    """Shadows of a file, or made and kept there."""
    if file.exists():
        with np.load(file) as data:
            return Shadows(data["chords_mm"], data["points_px"])
    made = make()
    file.parent.mkdir(parents=True, exist_ok=True)
    np.savez(file, chords_mm=made.chords_mm, points_px=made.points_px)
    return made
