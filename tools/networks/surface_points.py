# SPDX-License-Identifier: Apache-2.0
"""Points of a surface without anatomy: as far from one another as can be, so its ends and corners come first."""
import numpy as np

LARGEST_HOLE = 0.1  # that is closed, in diameters
NEARLY_SYMMETRIC = 0.015  # mean distance of the surface from its mirror image, in diameters


def farthest(points_mm, count):
    """`count` of the points: first the one that is farthest from their middle, then always the one that is farthest
    from all before (Gonzalez 1985)."""
    chosen = [int(np.argmax(np.linalg.norm(points_mm - points_mm.mean(axis=0), axis=1)))]
    away = np.linalg.norm(points_mm - points_mm[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points_mm - points_mm[chosen[-1]], axis=1))
    return points_mm[chosen]


def symmetry_of(points_mm):
    """The plane across an axis of inertia in which the points are most like their mirror image: a point on it, its
    normal, and their mean distance from the mirror image in diameters."""
    from scipy.spatial import cKDTree

    middle = points_mm.mean(axis=0)
    tree, diameter = cKDTree(points_mm), np.ptp(points_mm, axis=0).max()
    found = []
    for normal in np.linalg.eigh(np.cov((points_mm - middle).T))[1].T:
        some = points_mm[:3000]
        mirrored = some - 2 * np.outer((some - middle) @ normal, normal)
        found.append((float(tree.query(mirrored)[0].mean() / diameter), normal))
    rest, normal = min(found, key=lambda one: one[0])
    return middle, normal, rest


def holes_of(triangles):
    """The borders of a surface's holes, each a list of corners in the order in which the missing triangles run."""
    sides = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there = set(map(tuple, sides.tolist()))
    after = {b: a for a, b in there if (b, a) not in there}
    holes = []
    while after:
        start, corner = next(iter(after.items()))
        hole = [start]
        del after[start]
        while corner != start and corner in after:
            hole.append(corner)
            corner = after.pop(corner)
        if corner != start:
            raise SystemExit("train: the surface has a border that is no ring; repair it, or give another surface")
        holes.append(hole)
    return holes


def closed(vertices_mm, triangles):
    """The surface with its small holes closed, each by a fan about its middle, and how many these are. Ends the program
    if a hole is large: what it would look like there, nobody knows."""
    holes = holes_of(triangles)
    diameter = np.ptp(vertices_mm, axis=0).max()
    for hole in holes:
        wide_mm = np.ptp(vertices_mm[hole], axis=0).max()
        if wide_mm > LARGEST_HOLE * diameter:
            raise SystemExit("train: the surface has a hole of %.1f mm; close it, or give a closed surface" % wide_mm)
        vertices_mm = np.vstack([vertices_mm, vertices_mm[hole].mean(axis=0)])
        fan = [[a, b, len(vertices_mm) - 1] for a, b in zip(hole, hole[1:] + hole[:1])]
        triangles = np.vstack([triangles, np.array(fan, triangles.dtype)])
    return vertices_mm, triangles, len(holes)


def evenly(vertices_mm, triangles, count, seed=1):
    """Random points, evenly by area."""
    random = np.random.default_rng(seed)
    a, b, c = (vertices_mm[triangles[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    of = random.choice(len(triangles), count, p=areas / areas.sum())
    s, t = np.sqrt(random.uniform(size=count)), random.uniform(size=count)
    return (1 - s)[:, None] * a[of] + (s * (1 - t))[:, None] * b[of] + (s * t)[:, None] * c[of]


def points_of(vertices_mm, triangles, count=12):
    """The points, by the names p1, p2, ..., and whether the part is nearly symmetric.

    In one view, a symmetric part and its mirror pose (evaluate.mirror_pose) give the same image, in which a point and
    its mirror image have changed places. A network cannot tell them apart. So the points of a nearly symmetric part lie
    in its plane of symmetry, where each is its own mirror image. They lie in a plane, so one view gives two poses:
    initial.landmarks says so, and initial.silhouette gives both."""
    spread = evenly(vertices_mm, triangles, 60000)
    middle, normal, rest = symmetry_of(spread)
    is_symmetric = rest < NEARLY_SYMMETRIC
    if is_symmetric:
        off = (spread - middle) @ normal
        near = np.argsort(np.abs(off))[: max(20 * count, len(spread) // 30)]
        spread = spread[near] - np.outer(off[near], normal)
    chosen = farthest(spread, count)
    return {"p%d" % (i + 1): point for i, point in enumerate(chosen)}, is_symmetric


def landmarks_text(points, fragment="part"):
    """marrow's file of landmarks (docs/case.md)."""
    lines = ["marrow-landmarks: 1", "fragments:", "  %s:" % fragment, "    points:"]
    lines += ["      %s: [%s]" % (name, ", ".join("%.3f" % x for x in point)) for name, point in points.items()]
    return "\n".join(lines) + "\n"
