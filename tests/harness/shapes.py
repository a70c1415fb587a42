# SPDX-License-Identifier: Apache-2.0
"""Meshes, cameras and simulated X-rays for the report's synthetic data, in the Python standard library alone."""
import base64
import math
import random
import struct

from harness import formats


def bone(around=28, along=36):
    """The lower end of something like a femur, closed, its outside counter-clockwise: vertices in mm, triangles."""
    vertices, triangles = [], []
    for i in range(along):
        z = -60 + 120 * i / (along - 1)
        flare = math.exp(-(((z + 52) / 24) ** 2))
        for k in range(around):
            angle = 2 * math.pi * k / around
            radius = 13 + 17 * flare * (1 + 0.28 * math.cos(2 * angle)) + 5 * flare * math.sin(3 * angle)
            radius *= min(1, math.sqrt(max(0.02, 1 - ((abs(z) - 48) / 12.5) ** 2)) if z < -48 else 1)
            vertices.append((radius * math.cos(angle), radius * math.sin(angle) - 4 * flare + 0.0012 * z * z, z))
    for i in range(along - 1):
        for k in range(around):
            a, b = i * around + k, i * around + (k + 1) % around
            triangles += [(a, b, a + around), (b, b + around, a + around)]
    for ring, turned in ((0, False), (along - 1, True)):
        centre = [sum(vertices[ring * around + k][axis] for k in range(around)) / around for axis in range(3)]
        vertices.append(tuple(centre))
        for k in range(around):
            a, b = ring * around + k, ring * around + (k + 1) % around
            triangles.append((len(vertices) - 1, a, b) if turned else (len(vertices) - 1, b, a))
    return vertices, triangles


def cube(half=20.0):
    vertices = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]


def mesh_entry(name, mesh):
    vertices, triangles = mesh
    pack = lambda kind, rows: base64.b64encode(
        struct.pack("<%d%s" % (3 * len(rows), kind), *(value for row in rows for value in row))
    ).decode()
    return {"name": name, "vertices": pack("f", vertices), "triangles": pack("I", triangles)}


def rotation(axis, angle_deg):
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    i, k = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = [[float(row == column) for column in range(4)] for row in range(4)]
    matrix[i][i] = matrix[k][k] = c
    matrix[i][k], matrix[k][i] = -s, s
    return matrix


def multiply(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def pose(angles_deg, shift_mm):
    matrix = multiply(multiply(rotation(0, angles_deg[0]), rotation(1, angles_deg[1])), rotation(2, angles_deg[2]))
    for axis in range(3):
        matrix[axis][3] = shift_mm[axis]
    return matrix


def flat(matrix):
    return [value for row in matrix for value in row]


def apply(matrix, point):
    return [sum(matrix[i][k] * point[k] for k in range(3)) + matrix[i][3] for i in range(3)]


def camera(name, direction, width_px=256, height_px=256, focal_px=(900.0, 900.0), centre_px=None, distance_mm=650.0):
    """A view of the world's origin: frontal (source on -y) or lateral (source on -x), z up in the image."""
    rows = {"frontal": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "lateral": [[0, -1, 0], [0, 0, -1], [1, 0, 0]]}[direction]
    centre_px = centre_px or ((width_px - 1) / 2, (height_px - 1) / 2)
    return {
        "name": name,
        "width_px": width_px,
        "height_px": height_px,
        "intrinsics": [focal_px[0], 0, centre_px[0], 0, focal_px[1], centre_px[1], 0, 0, 1],
        "camera_from_world": flat([row + [0.0] for row in rows[:2]] + [rows[2] + [distance_mm], [0, 0, 0, 1]]),
    }


def project(view, point):
    """The pixel (u, v) of a world point, and its depth along the camera's axis."""
    matrix, K = view["camera_from_world"], view["intrinsics"]
    x, y, z = (sum(matrix[4 * i + k] * point[k] for k in range(3)) + matrix[4 * i + 3] for i in range(3))
    return (K[0] * x + K[1] * y + K[2] * z) / z, (K[4] * y + K[5] * z) / z, z


def thickness(mesh, world_from_model, view):
    """What each pixel's ray passes of the mesh, in mm: depths of the far sides less those of the near ones."""
    width, height = view["width_px"], view["height_px"]
    sums = [0.0] * (width * height)
    points = [project(view, apply(world_from_model, vertex)) for vertex in mesh[0]]
    for a, b, c in mesh[1]:
        (u0, v0, z0), (u1, v1, z1), (u2, v2, z2) = points[a], points[b], points[c]
        area = (u1 - u0) * (v2 - v0) - (u2 - u0) * (v1 - v0)
        if abs(area) < 1e-9:
            continue
        sign = 1 if area > 0 else -1
        for v in range(max(0, math.ceil(min(v0, v1, v2))), min(height - 1, math.floor(max(v0, v1, v2))) + 1):
            for u in range(max(0, math.ceil(min(u0, u1, u2))), min(width - 1, math.floor(max(u0, u1, u2))) + 1):
                s = ((u - u0) * (v2 - v0) - (u2 - u0) * (v - v0)) / area
                t = ((u1 - u0) * (v - v0) - (u - u0) * (v1 - v0)) / area
                if s >= 0 and t >= 0 and s + t <= 1:
                    sums[v * width + u] += sign * (z0 + s * (z1 - z0) + t * (z2 - z0))
    return [abs(value) for value in sums]


def picture(width, height, pixels, channels):
    """A PNG as a page holds it."""
    return "data:image/png;base64," + base64.b64encode(formats.png(width, height, pixels, channels=channels)).decode()


def xray(depths, view, seed):
    """Grey values of an X-ray with soft tissue, bone and noise."""
    chance, width, height = random.Random(seed), view["width_px"], view["height_px"]
    grey = bytearray(width * height)
    for i, depth in enumerate(depths):
        across = (i % width - 0.5 * width) / (0.5 * width)
        tissue = 60 * math.sqrt(max(0.0, 1 - across * across))
        grey[i] = max(0, min(255, int(232 * math.exp(-0.012 * tissue - 0.017 * min(depth, 70)) + chance.gauss(0, 3))))
    return grey


def overlay(grey, depths, view, colour):
    """The X-ray with the outline of what casts these depths."""
    width, height = view["width_px"], view["height_px"]
    pixels = bytearray(value for value in grey for _ in range(3))
    for v in range(1, height - 1):
        for u in range(1, width - 1):
            i = v * width + u
            if depths[i] > 0.5 and min(depths[i - 1], depths[i + 1], depths[i - width], depths[i + width]) <= 0.5:
                pixels[3 * i : 3 * i + 3] = bytes(colour)
    return pixels
