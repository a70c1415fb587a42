# SPDX-License-Identifier: Apache-2.0
"""CTs, X-ray images and cases that the tests of the page "Case" choose: small ones whose content is known."""
import math


def turned(angles_deg):
    """A rotation about x, then y, then z, as rows."""
    (cx, cy, cz), (sx, sy, sz) = (
        [f(math.radians(a)) for a in angles_deg] for f in (math.cos, math.sin)
    )  # fmt: skip
    return [
        [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
        [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
        [-sy, sx * cy, cx * cy],
    ]


def point_of(grid, index):
    """Where a voxel's centre is, in mm."""
    return [
        grid["origin_mm"][row] + sum(grid["direction"][row][k] * index[k] * grid["spacing_mm"][k] for k in range(3))
        for row in range(3)
    ]


def ball(index, centre, radius):
    return sum((a - b) ** 2 for a, b in zip(index, centre)) <= radius**2


def two_balls(size, first, second, radius):
    """Air with two balls of bone, given by indices."""
    return [
        900 if ball((x, y, z), first, radius) or ball((x, y, z), second, radius) else -1000
        for z in range(size[2])
        for y in range(size[1])
        for x in range(size[0])
    ]


def seg_nrrd(grid, values, segments):
    """Labels as 3D Slicer writes them: the bytes of a .seg.nrrd. segments: (name, label)."""
    size, spacing, origin, direction = (grid[key] for key in ("size", "spacing_mm", "origin_mm", "direction"))
    axes = " ".join("(%s)" % ",".join(str(direction[row][k] * spacing[k]) for row in range(3)) for k in range(3))
    notes = "".join(
        "Segment%d_ID:=Segment_%d\nSegment%d_Name:=%s\nSegment%d_LabelValue:=%d\nSegment%d_Layer:=0\n"
        % (i, i + 1, i, name, i, label, i)
        for i, (name, label) in enumerate(segments)
    )
    header = (
        "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: %s\n"
        "space directions: %s\nkinds: domain domain domain\nencoding: raw\nspace origin: (%s)\n%s\n"
        % (" ".join(map(str, size)), axes, ",".join(map(str, origin)), notes)
    )
    return header.encode() + bytes(values)


def labelled_balls(grid, balls):
    """The voxels of balls, given as (label, centre in mm, radius in mm); 0 elsewhere."""
    size = grid["size"]
    values = []
    for z in range(size[2]):
        for y in range(size[1]):
            for x in range(size[0]):
                place = point_of(grid, (x, y, z))
                values.append(next((label for label, centre, radius in balls if ball(place, centre, radius)), 0))
    return values


CAMERA = {
    "width_px": 64,
    "height_px": 64,
    "c_arm": {
        "alpha_deg": 0,
        "beta_deg": 0,
        "source_to_detector_mm": 1000,
        "source_to_isocentre_mm": 600,
        "pixel_mm": 1,
    },
}
