# SPDX-License-Identifier: Apache-2.0
"""Overlap of segmentations, and distances between surfaces (docs/method.md, "What errors mean")."""
import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

import surface
from figures import exactly, within
from values import read_field


def dice(call):
    field, other = call.one("field", read_field), call.one("reference", read_field)
    inside = field.values_mm < 0
    where = other.index(field.points_mm(indices(field)))
    is_other = (at(other, where) < 0) & covers(other, where)
    beyond = ~covers(field, field.index(other.points_mm(indices(other)))) & (other.values_mm.ravel() < 0)
    voxel, other_voxel = np.prod(field.spacing_mm), np.prod(other.spacing_mm)
    volume = inside.sum() * voxel
    common = (inside.ravel() & is_other).sum() * voxel
    of_other = is_other.sum() * voxel + beyond.sum() * other_voxel
    # A voxel whose interpolated value is 0 but for rounding may count on either side.
    unclear = (np.abs(at(other, where)) < 1e-5).sum() * voxel
    return {
        "dice": within(2 * common / (volume + of_other), 2 * unclear / (volume + of_other)),
        "jaccard": within(common / (volume + of_other - common), 2 * unclear / (volume + of_other - common)),
        "volume_mm3": exactly(volume),
        "reference_mm3": within(of_other, unclear),
    }


def indices(field):
    return np.stack(np.meshgrid(*map(np.arange, field.values_mm.shape), indexing="ij"), -1).reshape(-1, 3)


def at(field, index):
    return map_coordinates(field.values_mm.astype(float), index.T, order=1, mode="nearest")


def covers(field, index):
    return ((index >= -0.5) & (index <= np.array(field.values_mm.shape) - 0.5)).all(axis=1)


def surface_distance(call):
    """Distances of points on each surface from the triangles of the other."""
    one, other = (call.one(port, surface.read) for port in ("mesh", "reference"))
    count = call.options["points"]
    there, back = distances(one, other, 4000), distances(other, one, 4000)
    both = np.abs(np.concatenate([there, back]))
    corners = [np.abs(distances_of(mesh.vertices_mm, target)) for mesh, target in ((one, other), (other, one))]

    def of_points(values):
        return 4 * values.std() * np.sqrt(1 / len(values) + 1 / (2 * count))

    rms = np.sqrt((both**2).mean())
    low, high = np.quantile(both, [0.94, 0.96])
    return {
        "mean_mm": within(both.mean(), of_points(both)),
        "rms_mm": within(rms, of_points(both**2) / (2 * rms + 1e-12)),
        "p95_mm": within(np.quantile(both, 0.95), high - low),
        "max_mm": exactly(max(both.max(), *(values.max() for values in corners))),
        "bias_mm": within(there.mean(), of_points(there)),
    }


def distances(one, other, count):
    return distances_of(one.spread_points(count), other)


def distances_of(points_mm, mesh):
    """Signed distances of points from the triangles that are nearest, negative inside. Of a closed surface whose
    triangles face outwards, the sign is that of the solid angle under which it is seen."""
    centres = mesh.corners_mm.mean(axis=1)
    reach = np.linalg.norm(mesh.corners_mm - centres[:, None], axis=2).max()
    tree, result = cKDTree(centres), []
    nearest = tree.query(points_mm)[0]
    for point, near in zip(points_mm, nearest):
        corners = mesh.corners_mm[tree.query_ball_point(point, near + reach)]
        result.append(np.min(np.linalg.norm(nearest_on_triangles(point, corners) - point, axis=1)))
    return np.array(result) * np.where(is_inside(points_mm, mesh), -1, 1)


def nearest_on_triangles(point, corners):
    """Of each triangle: the foot of the perpendicular, if it lies inside, else the nearest point of an edge."""
    a, b, c = (corners[:, k] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = (normals**2).sum(axis=1)
    ok = lengths > 0
    foot = point - normals * (np.einsum("tx,tx->t", point - a, normals) / np.where(ok, lengths, 1))[:, None]
    sides = [np.einsum("tx,tx->t", np.cross(q - p, foot - p), normals) for p, q in ((a, b), (b, c), (c, a))]
    candidates = [on_segment(point, p, q) for p, q in ((a, b), (b, c), (c, a))]
    candidates = np.stack(candidates + [np.where((ok & (np.min(sides, axis=0) >= 0))[:, None], foot, np.inf)])
    best = np.linalg.norm(candidates - point, axis=2).argmin(axis=0)
    return candidates[best, np.arange(len(corners))]


def on_segment(point, p, q):
    way = q - p
    share = np.einsum("tx,tx->t", point - p, way) / np.maximum((way**2).sum(axis=1), 1e-300)
    return p + np.clip(share, 0, 1)[:, None] * way


def is_inside(points_mm, mesh):
    """By the sum of solid angles (Van Oosterom and Strackee 1983)."""
    result = []
    for point in points_mm:
        a, b, c = (mesh.corners_mm[:, k] - point for k in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        above = np.einsum("tx,tx->t", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        result.append(2 * np.arctan2(above, below).sum() > 2 * np.pi)
    return np.array(result)
