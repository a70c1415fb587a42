# SPDX-License-Identifier: Apache-2.0
"""Distances of the bone's outline from the edges of the images.

The outline is the border of a shadow: points that lie densely on the surface darken the pixels of a finer image. The
edges are the pixels of the written edge pictures, moved to where the image's gradient is greatest. Both differ from
marrow's ways, so the figures agree to a part of a pixel only."""
import numpy as np
from scipy.ndimage import binary_fill_holes, gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

import surface
from figures import NotRecomputed, within
from values import read_camera, read_field, read_grey, read_pose, read_view_image

FINE = 4  # pixels of the shadow in a pixel of the image
ALLOWED_PX, ALLOWED_PERCENT = 0.1, 3


def shadow(mesh, place, camera):
    """Where rays meet the surface, in an image with finer pixels."""
    height, width = camera.height_px * FINE, camera.width_px * FINE
    dark = np.zeros((height, width), bool)
    flat = camera.project(place(mesh.vertices_mm))[mesh.triangles] * FINE + (FINE - 1) / 2
    longest = np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=2).max(axis=1)
    for steps in 2 ** np.arange(1, 12):
        of_size = flat[(longest <= steps) & (longest > (steps / 2 if steps > 2 else -1))]
        shares = [(i, j, 2 * steps - i - j) for i in range(2 * steps + 1) for j in range(2 * steps + 1 - i)]
        for share in np.array(shares) / (2 * steps) if len(of_size) else ():
            u, v = np.rint(np.einsum("k,tkx->xt", share, of_size)).astype(int)
            is_inside = (u >= 0) & (v >= 0) & (u < width) & (v < height)
            dark[v[is_inside], u[is_inside]] = True
    return binary_fill_holes(dark)


def outline(mesh, place, camera):
    """(points, outward normals) of the shadow's border, about one for each pixel of the image that it passes."""
    smooth = gaussian_filter(shadow(mesh, place, camera).astype(float), 0.6 * FINE)
    down, right = np.gradient(smooth)
    steep = np.hypot(down, right)
    # The pixels beside the border, moved onto it: there the smooth shadow is a half.
    v, u = np.nonzero((np.abs(smooth - 0.5) < 0.5 * steep) & (steep > 0.02))
    normals = -np.column_stack([right[v, u], down[v, u]]) / steep[v, u][:, None]
    # A pixel is dark wherever in it a point lies, so the shadow is half a pixel too large.
    points = np.column_stack([u, v]) + normals * ((smooth[v, u] - 0.5) / steep[v, u] - 0.5)[:, None]
    points = (points - (FINE - 1) / 2) / FINE
    size = [camera.width_px - 1, camera.height_px - 1]
    keep = ((points >= 1) & (points <= np.array(size) - 1)).all(axis=1)
    return points[keep], normals[keep]


def edges(picture, image, sigma_px):
    """(points, directions to the brighter side): the white pixels, moved along the gradient to its greatest value."""
    v, u = np.nonzero(picture > 0)
    logarithm = np.log(np.clip(image / image.max(), 0.005, 1))
    down = gaussian_filter(logarithm, sigma_px, order=(1, 0))
    right = gaussian_filter(logarithm, sigma_px, order=(0, 1))
    size = np.hypot(down, right)
    directions = np.column_stack([right[v, u], down[v, u]]) / size[v, u][:, None]
    points = np.column_stack([u, v]).astype(float)
    before, at, after = (map_coordinates(size, (points + step * directions)[:, ::-1].T, order=3) for step in (-1, 0, 1))
    curvature = np.minimum(before - 2 * at + after, -1e-12)
    return points + np.clip(0.5 * (before - after) / curvature, -1, 1)[:, None] * directions, directions


def outline_distance(call):
    options, place = call.options, call.one("pose", read_pose).world_from_ct
    mesh = call.one("projector.model", surface.read)
    check_whole(mesh, call)
    cameras, images = call.many("views", read_camera), call.many("views", read_view_image)
    sigma_px = call.run.option("sigma_px")
    result, everywhere = {}, []
    for view, picture in call.many("edges", read_grey).items():
        points, normals = outline(mesh, place, cameras[view])
        off, across = to_edges(points, normals, *edges(picture, images[view], sigma_px), options)
        depth_mm = cameras[view].depth_mm(place(mesh.frame().origin_mm))
        everywhere.append((off, off * cameras[view].on_a_plane([[1, 0]], [depth_mm])[0, 0], across))
        result |= figures(view + "_", *everywhere[-1])
    return result | figures("", *(np.concatenate(parts) for parts in zip(*everywhere)))


def check_whole(mesh, call):
    """Where the CT ends, the outline is left out, which is not done here."""
    wire = call.run.wire(call.node, "projector.volume")
    if not wire:
        return
    ct = call.one("projector.volume", read_field)
    index, last = ct.index(mesh.vertices_mm), np.array(ct.values_mm.shape) - 1
    if np.minimum(index, last - index).min() < 3:
        raise NotRecomputed("the bone reaches the end of the CT, where its outline is left out")


def to_edges(points, normals, places, directions, options):
    """(distances [px], of matched points along the normal [px]); a point without an edge counts with the reach."""
    tree, least = cKDTree(places), np.cos(np.radians(options["direction_tolerance_deg"]))
    off, across = np.full(len(points), options["reach_px"], float), []
    for number, (point, normal) in enumerate(zip(points, normals)):
        near = np.array(tree.query_ball_point(point, options["reach_px"]), int)
        near = near[directions[near] @ normal >= least]
        if len(near):
            apart = places[near] - point
            lengths = np.linalg.norm(apart, axis=1)
            best = lengths.argmin()
            off[number] = lengths[best]
            across.append(apart[best] @ normal)
    return off, np.array(across)


def figures(prefix, off_px, off_mm, across_px):
    middle = np.median(across_px)
    mm = ALLOWED_PX * np.median(off_mm / off_px)
    values = {
        "median_px": (np.median(off_px), ALLOWED_PX),
        "p90_px": (np.quantile(off_px, 0.9), 2 * ALLOWED_PX),
        "median_mm": (np.median(off_mm), mm),
        "p90_mm": (np.quantile(off_mm, 0.9), 2 * mm),
        "matched_percent": (100 * len(across_px) / len(off_px), ALLOWED_PERCENT),
        "offset_px": (middle, ALLOWED_PX),
        "spread_px": (np.median(np.abs(across_px - middle)), ALLOWED_PX),
    }
    return {prefix + name: within(*value) for name, value in values.items()}
