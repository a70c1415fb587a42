# SPDX-License-Identifier: Apache-2.0
"""CTs, X-ray images and cases whose content is known."""
import functools
import json
import math
import pathlib
import shutil
import struct
import tempfile
import unittest
import zlib

import numpy
import yaml

from harness import formats
from harness.cases import SMALL, simulate

SIZE, LOWER, UPPER, RADIUS = (40, 36, 44), (20, 18, 11), (20, 18, 32), 8  # a CT with two balls of bone
ARM = {"source_to_detector_mm": 1000, "source_to_isocentre_mm": 600, "pixel_mm": 1.0}
CAMERA = {"width_px": 64, "height_px": 64, "c_arm": {"alpha_deg": 0, "beta_deg": 0, **ARM}}
WIDTH, HEIGHT = 320, 240
BETA_DEG = {"frontal": 0, "lateral": 90}
MODEL = {"a": [10, 0, 20], "b": [-25, 12, 5], "c": [5, -20, -30], "d": [30, 25, -8], "e": [-10, -15, 35]}
SHIFT = numpy.array([4.0, -3.0, 6.0])  # the truth: the bone is moved, and not turned
NONE = ",".join(["NaN"] * 16)  # of a .tra file: no pose in this frame
FRAMES = 6
VIEWS = {name: {"images": "film", "pattern": "*/%s/image.png" % name} for name in BETA_DEG}
MOVING = """
marrow: 1
nodes:
  femur:   {uses: simulate.femur, with: {isocentre_from_distal_end_mm: 40}}
  whole:   {uses: simulate.whole, in: {bone: femur}}
  ct:      {uses: simulate.ct, in: {phantom: whole}, with: {spacing_mm: [1.5, 1.5, 1.5]}}
  cameras:
    uses: camera.carm
    with: {names: [frontal, lateral], alpha_deg: [0, 0], beta_deg: [0, 90], source_to_detector_mm: 1000,
      source_to_isocentre_mm: 600, width_px: 256, height_px: 256, pixel_mm: 1.1}
  motion:  {uses: simulate.bone_motion, in: {phantom: whole}, with: {frames: %d, frame_rate_hz: 60}}
  views:   {uses: simulate.fluoroscopy, in: {phantom: whole, posture: motion, cameras: cameras}}
  still:   {uses: simulate.fluoroscopy, in: {phantom: whole, cameras: cameras}}
  truths:  {uses: simulate.truth, in: {phantom: whole, posture: motion}}
  case:    {uses: simulate.case, in: {volume: ct, views: still, phantom: whole}, with: {register: [bone]}}
outputs: {case: case, views: views, truths: truths.truths}
"""


def turned(angles_deg):
    """A rotation about x, then y, then z, as rows."""
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(a), math.sin(a)) for a in map(math.radians, angles_deg))
    return [
        [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
        [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
        [-sy, sx * cy, cx * cy],
    ]


def point_of(grid, index):
    """Where voxels' centres are, in mm, by their indices along the last axis."""
    axes = numpy.array(grid["direction"]) * grid["spacing_mm"]
    return (numpy.array(index) @ axes.T + grid["origin_mm"]).tolist()


def balls(grid, *marked, outside=0):
    """The voxels of balls, given as (value, centre in mm, radius in mm), x fastest."""
    z, y, x = numpy.indices(grid["size"][::-1])
    places = numpy.array(point_of(grid, numpy.stack([x, y, z], -1)))
    values = numpy.full(z.shape, outside, "<i2")
    for value, centre, radius in reversed(marked):
        values[((places - centre) ** 2).sum(-1) <= radius**2] = value
    return values.ravel()


def two_balls(size=SIZE, first=LOWER, second=UPPER, radius=RADIUS):
    """Air with two balls of bone, given by indices."""
    return balls(formats.straight(size), (900, first, radius), (900, second, radius), outside=-1000)


def write_scan(folder, name="scan.mha", grid=None, values=None):
    grid = grid or formats.straight(SIZE)
    (folder / name).write_bytes(formats.mha(grid, two_balls() if values is None else values))


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
    return header.encode() + values.astype("u1").tobytes()


def camera(view, pixel_mm=ARM["pixel_mm"]):
    """By docs/case.md: z from the source to the detector, v to the feet in the frontal view."""
    beta = math.radians(BETA_DEG[view])
    # In the frontal view the detector is in front of the patient (-y), and the patient's left (+x) is on the left.
    frontal = numpy.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
    about_z = numpy.array([[math.cos(beta), -math.sin(beta), 0], [math.sin(beta), math.cos(beta), 0], [0, 0, 1]])
    motion = numpy.eye(4)
    motion[:3, :3], motion[2, 3] = frontal @ about_z.T, ARM["source_to_isocentre_mm"]
    focal = ARM["source_to_detector_mm"] / pixel_mm
    intrinsics = [[focal, 0, (WIDTH - 1) / 2], [0, focal, (HEIGHT - 1) / 2], [0, 0, 1]]
    return {"intrinsics": intrinsics, "camera_from_world": motion.tolist(), "width_px": WIDTH, "height_px": HEIGHT}


def seen(camera, world_mm):
    """Pixel and depth of a world point."""
    place = numpy.array(camera["intrinsics"]) @ at(camera["camera_from_world"], world_mm)
    return [place[0] / place[2], place[1] / place[2], place[2]]


def pixel(view, world_mm):
    return numpy.array(seen(camera(view) if isinstance(view, str) else view, world_mm)[:2])


def ray(camera, at):
    """(source, unit direction) in the world."""
    motion = numpy.array(camera["camera_from_world"])
    direction = motion[:3, :3].T @ numpy.linalg.solve(camera["intrinsics"], [*at, 1])
    return -motion[:3, :3].T @ motion[:3, 3], direction / numpy.linalg.norm(direction)


def at(pose, point):
    return (numpy.array(pose) @ [*point, 1])[:3].tolist()


def angle_deg(a, b):
    """Of the rotation from one pose to the other."""
    trace = sum(a[i][j] * b[i][j] for i in range(3) for j in range(3))
    return math.degrees(math.acos(max(-1, min(1, (trace - 1) / 2))))


def write_png(path, image, bits=16):
    pixels = image.astype(">u2" if bits == 16 else "u1").tobytes()
    path.write_bytes(formats.png(image.shape[1], image.shape[0], pixels, bits))


def read_png(path):
    """Reads a PNG of one channel of 8 bits."""
    data, start, body = path.read_bytes(), 8, b""
    while start < len(data):
        size, kind = struct.unpack(">I4s", data[start : start + 8])
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", data[start + 8 : start + 18])
        if kind == b"IDAT":
            body += data[start + 8 : start + 8 + size]
        start += size + 12
    assert (bits, colour) == (8, 0), (bits, colour)
    raw, rows = zlib.decompress(body), [numpy.zeros(width, int)]
    for row in range(height):
        line = numpy.frombuffer(raw[row * (width + 1) : (row + 1) * (width + 1)], numpy.uint8).astype(int)
        kind, values = line[0], line[1:].copy()
        for i in range(width if kind else 0):
            left, up = values[i - 1] if i else 0, rows[-1][i]
            corner = rows[-1][i - 1] if i else 0
            paeth = min((left, up, corner), key=lambda one: abs(left + up - corner - one))
            values[i] = (values[i] + [0, left, up, (left + up) // 2, paeth][kind]) % 256
        rows.append(values)
    return numpy.array(rows[1:])


def shadow(view):
    """Grey values of an ellipsoid, shaped like a limb, with half axes 40, 30 and 400 mm. Air has 20000."""
    source = ray(camera(view), [0, 0])[0]
    turn = numpy.array(camera(view)["camera_from_world"])[:3, :3]
    u, v = numpy.meshgrid(numpy.arange(WIDTH), numpy.arange(HEIGHT))
    rays = numpy.stack([u, v, numpy.ones_like(u)], -1) @ numpy.linalg.inv(camera(view)["intrinsics"]).T @ turn
    rays /= numpy.linalg.norm(rays, axis=-1, keepdims=True)
    half = numpy.array([40.0, 30, 400])
    a = ((rays / half) ** 2).sum(-1)
    b = (rays / half * (source / half)).sum(-1)
    inside = numpy.maximum(0, b * b - a * (((source / half) ** 2).sum() - 1))
    return numpy.round(20000 * numpy.exp(-0.02 * 2 * numpy.sqrt(inside) / a)).astype(int)


def write_xrays(folder):
    """Writes two shadows and the files of their cameras; the views of a draft."""
    views = []
    for name, beta_deg in BETA_DEG.items():
        write_png(folder / (name + ".png"), shadow(name))
        arm = {"alpha_deg": 0, "beta_deg": beta_deg, **ARM}
        known = {"width_px": WIDTH, "height_px": HEIGHT, "c_arm": arm}
        (folder / (name + ".camera.yaml")).write_text(json.dumps({"marrow-camera": 1, **known}))
        views.append({"name": name, "image": name + ".png", "camera": known})
    return views


def scratch():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow-made-"))
    unittest.addModuleCleanup(shutil.rmtree, folder, ignore_errors=True)
    return folder


@functools.lru_cache
def femur():
    """The folder of a simulated femur, made once, and its true pose."""
    case = simulate(scratch() / "sim", *SMALL)
    return case, yaml.safe_load((case / "case.yaml").read_text())["fragments"]["distal"]["truth"]["matrix"]


@functools.lru_cache
def moving():
    """A femur that moves through small X-rays, made once: the folder of case, views and truths, and its true poses."""
    folder = scratch()
    (folder / "moving.yaml").write_text(MOVING % FRAMES)
    outputs = simulate(folder / "made", pipeline=folder / "moving.yaml").parent
    files = [outputs / "truths" / ("%04d" % frame) / "bone.yaml" for frame in range(1, FRAMES + 1)]
    return outputs, [yaml.safe_load(file.read_text())["matrix"] for file in files]


def truth(frame):
    return moving()[1][frame - 1]


def line(pose):
    """A line of a .tra file."""
    return ",".join("%.17g" % value for row in pose for value in row)


def shifted(pose, x_mm):
    return [[*row[:3], row[3] + (x_mm if i == 0 else 0)] for i, row in enumerate(pose)]
