# SPDX-License-Identifier: Apache-2.0
"""Figures of the shaft's borders in an image, against the outline of the true surface."""
import numpy as np

import surface
from figures import exactly
from values import read_camera, read_truth, read_yaml


def points_of(line):
    return np.array([line["from_px"], line["to_px"]], float)


class Stretch:
    """Coordinates beside a pair of borders: x along the line midway between them, from its start; y to the right."""

    def __init__(self, left, right):
        self.start, end = (left + right) / 2
        self.length_px = np.linalg.norm(end - self.start)
        along = (end - self.start) / self.length_px
        self.axes = np.array([along, [-along[1], along[0]]])

    def of_pixels(self, pixels):
        return (pixels - self.start) @ self.axes.T

    def pixels(self, points):
        return self.start + points @ self.axes


def outermost(mesh, place, camera, stretch):
    """(x, left y, right y) where the projected surface ends, at whole pixels along the stretch. Whatever lies between
    is passed over, so all edges of the triangles may be taken for the outline."""
    flat = stretch.of_pixels(camera.project(place(mesh.vertices_mm)))
    sides = flat[mesh.triangles]
    sides = sides[(sides[:, :, 0].max(axis=1) >= 0) & (sides[:, :, 0].min(axis=1) <= stretch.length_px)]
    ends = np.concatenate([sides[:, [0, 1]], sides[:, [1, 2]], sides[:, [2, 0]]])
    ends = np.where((ends[:, 0, 0] > ends[:, 1, 0])[:, None, None], ends[:, ::-1], ends)
    count = int(stretch.length_px) + 1
    left, right = np.full(count, np.inf), np.full(count, -np.inf)
    (ax, ay), (bx, by) = ends[:, 0].T, ends[:, 1].T
    x = np.ceil(np.maximum(ax, 0))
    while len(x):
        keep = (x <= bx) & (x < count) & (ax < bx)
        ax, ay, bx, by, x = (values[keep] for values in (ax, ay, bx, by, x))
        y = ay + (x - ax) / (bx - ax) * (by - ay)
        np.minimum.at(left, x.astype(int), y)
        np.maximum.at(right, x.astype(int), y)
        x = x + 1
    seen = np.isfinite(left)
    return np.flatnonzero(seen), left[seen], right[seen]


def line_without_outliers(x, y, tolerance_px):
    """The least-squares line. As long as the farthest point is too far, it is left out."""
    while True:
        line = np.polynomial.Polynomial.fit(x, y, 1).convert()
        off = np.abs(y - line(x))
        worst = off.argmax()
        if len(x) < 3 or off[worst] <= tolerance_px:
            return line
        x, y = np.delete(x, worst), np.delete(y, worst)


def outline_depth_mm(mesh, place, camera, stretch):
    """The mean depth of the edges, along the stretch, at which the surface turns away from the source."""
    seen = camera.camera_from_world(place(mesh.vertices_mm))
    along = stretch.of_pixels(camera.project(place(mesh.vertices_mm)))[mesh.triangles][:, :, 0]
    beside = (along.max(axis=1) >= 0) & (along.min(axis=1) <= stretch.length_px)
    triangles = mesh.triangles[beside]
    a, b, c = (seen[triangles[:, k]] for k in range(3))
    faces = np.einsum("tx,tx->t", a, np.cross(b, c)) < 0
    ends = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, which = np.unique(ends, axis=0, return_inverse=True)
    counts = np.stack([np.bincount(which.ravel(), np.tile(side, 3), len(edges)) for side in (faces, ~faces)])
    turns = (counts == 1).all(axis=0) | (counts.sum(axis=0) != 2)
    return seen[edges[turns]][:, :, 2].mean()


def apart(found, truth):
    """(angle [deg], signed distance in the middle, largest distance at an end) of two segments."""
    way = truth[1] - truth[0]
    way /= np.linalg.norm(way)
    own = found[1] - found[0]
    ends = cross(way, found - truth[0])
    return np.degrees(np.arctan2(cross(way, own), way @ own)), ends.mean(), np.abs(ends).max()


def cross(one, other):
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


def compared(lines, mesh, place, camera, tolerance_mm):
    """Figures against one fragment, in mm at the depth of its outline; None if it does not lie along the pair."""
    left, right = points_of(lines["left"]), points_of(lines["right"])
    stretch = Stretch(left, right)
    x, on_left, on_right = outermost(mesh, place, camera, stretch)
    if len(x) < 10 or 3 * len(x) < stretch.length_px:
        return None
    depth_mm = outline_depth_mm(mesh, place, camera, stretch)
    tolerance_px = tolerance_mm / depth_mm * np.sqrt(np.linalg.det(camera.intrinsics[:2, :2]))
    ends = np.array([0, stretch.length_px])
    fits = [line_without_outliers(x, y, tolerance_px) for y in (on_left, on_right)]
    exact = [stretch.pixels(np.column_stack([ends, line(ends)])) for line in fits]
    left, right, *exact = (camera.on_a_plane(one, np.full(2, depth_mm)) for one in (left, right, *exact))
    of_left, of_right = apart(left, exact[0]), apart(right, exact[1])
    axis = (exact[0] + exact[1]) / 2
    of_middle = apart((left + right) / 2, axis)
    middles = np.array([one.mean(axis=0) for one in exact])
    return {
        "border_angle_deg": max(abs(of_left[0]), abs(of_right[0])),
        "border_offset_mm": max(abs(of_left[1]), abs(of_right[1])),
        "worst_mm": max(of_left[2], of_right[2]),
        "axis_angle_deg": abs(of_middle[0]),
        "axis_offset_mm": abs(of_middle[1]),
        "width_error_mm": of_right[1] - of_left[1],
        "true_width_mm": cross(axis[1] - axis[0], middles[1] - middles[0]) / np.linalg.norm(axis[1] - axis[0]),
        "length_mm": np.linalg.norm(left[1] - left[0]),
    }


def shaft_lines(call):
    lines, camera = call.one("lines", read_yaml), call.one("view", read_camera)
    models, truths = call.many("models", surface.read), call.many("truths", read_truth)
    names = [name for name in models if name in truths]
    tolerance_mm = call.options["tolerance_mm"]
    found = [compared(lines, models[name], truths[name], camera, tolerance_mm) for name in names]
    best = min(filter(None, found), key=lambda one: one["worst_mm"], default={})
    result = {name: exactly(value) for name, value in best.items()}
    return result | {"log_likelihood": exactly(lines["log_likelihood"])}
