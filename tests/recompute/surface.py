# SPDX-License-Identifier: Apache-2.0
"""Surfaces of triangles: reading them, their axes, and means over them as integrals."""
import pathlib

import numpy as np

from rigid import Frame

PLY_TYPES = {"double": "f8", "float": "f4", "int": "i4", "uint": "u4", "uchar": "u1"}
# A rule for triangles that is exact for polynomials of the second degree, as the moments of a surface are.
RULE = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6


class Surface:
    def __init__(self, vertices_mm, triangles):
        self.vertices_mm, self.triangles = vertices_mm, triangles
        self.corners_mm = vertices_mm[triangles]
        a, b, c = (self.corners_mm[:, k] for k in range(3))
        self.areas_mm2 = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    def points(self):
        """Points on the surface, and the weights with which they make means over it."""
        points_mm = np.einsum("pk,tkx->tpx", RULE, self.corners_mm).reshape(-1, 3)
        weights = np.repeat(self.areas_mm2, len(RULE))
        return points_mm, weights / weights.sum()

    def spread_points(self, count, seed=1):
        """Points drawn at random, as many for each area."""
        random = np.random.default_rng(seed)
        which = random.choice(len(self.areas_mm2), count, p=self.areas_mm2 / self.areas_mm2.sum())
        u, v = np.sqrt(random.random(count)), random.random(count)
        shares = np.column_stack([1 - u, u * (1 - v), u * v])
        return np.einsum("nk,nkx->nx", shares, self.corners_mm[which])

    def frame(self):
        """docs/method.md, "A fragment's axes"."""
        points_mm, weights = self.points()
        origin_mm = weights @ points_mm
        apart = points_mm - origin_mm
        long = np.linalg.eigh((apart * weights[:, None]).T @ apart)[1][:, 2]
        long *= 1 if long[2] >= 0 else -1
        reference = np.eye(3)[0 if abs(long[0]) < 0.9 else 1]
        frontal = reference - long * (long @ reference)
        frontal /= np.linalg.norm(frontal)
        return Frame(origin_mm, np.column_stack([frontal, np.cross(long, frontal), long]))


def read(path):
    path = pathlib.Path(path)
    return read_stl(path) if path.suffix == ".stl" else read_ply(path)


def read_ply(path):
    """As marrow writes it: little-endian, triangles only."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = [line.split() for line in head.decode().splitlines()]
    counts = {line[1]: int(line[2]) for line in lines if line[0] == "element"}
    columns = [(line[2], "<" + PLY_TYPES[line[1]]) for line in lines if line[0] == "property" and line[1] != "list"]
    corner_type = next("<" + PLY_TYPES[line[3]] for line in lines if line[:2] == ["property", "list"])
    vertices = np.frombuffer(body, np.dtype(columns), counts["vertex"])
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("corners", corner_type, 3)]), counts["face"], vertices.nbytes)
    assert (faces["n"] == 3).all(), "%s: not all faces are triangles" % path
    return Surface(np.column_stack([vertices[axis] for axis in "xyz"]).astype(float), faces["corners"].astype(int))


def read_stl(path):
    """Binary. Corners of the same place become one vertex."""
    data = path.read_bytes()
    faces = np.frombuffer(
        data, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]), offset=84
    )
    vertices, triangles = np.unique(faces["corners"].reshape(-1, 3), axis=0, return_inverse=True)
    return Surface(vertices.astype(float), triangles.reshape(-1, 3))
