# SPDX-License-Identifier: Apache-2.0
"""Closed surfaces of short bones drawn at random, like metacarpals and the ends of forearm bones: a bowed shaft with
two wider ends, whose cross sections are round up to a few low harmonics. Nothing is taken from a real bone."""

import numpy as np

LEVELS, AROUND = 121, 72


def tube(random, length_mm, shaft_mm, ends_mm):
    """Rings of points (LEVELS, AROUND, 3) in mm around the z axis, from the lower end at -length / 2 to the upper."""
    t = np.linspace(-1, 1, LEVELS)
    z = length_mm / 2 * t
    # the shaft's radius, widened towards both ends, and closed by two rounded caps
    widened = [np.exp(-(((t - side) / random.uniform(0.3, 0.5)) ** 2)) for side in (-0.9, 0.9)]
    radius = shaft_mm + sum((end - shaft_mm) * w for end, w in zip(ends_mm, widened))
    caps = np.minimum(1, (1 - np.abs(t)) * length_mm / 2 / (0.7 * np.where(t < 0, *ends_mm)))
    radius = radius * np.sqrt(np.maximum(1 - (1 - caps) ** 2, 0))
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    factor = np.ones((LEVELS, AROUND))
    uneven = random.uniform(1, 2)  # how much less round the ends are than the shaft
    for harmonic, size in ((2, 0.14), (3, 0.07), (4, 0.03)):
        # each harmonic has one strength and direction at the shaft and others at the two ends
        sizes = size / np.sqrt(2) * np.array([1, uneven, uneven])
        shaft, low, high = (complex(*random.normal(0, one, 2)) for one in sizes)
        at = shaft + (low - shaft) * widened[0] + (high - shaft) * widened[1]
        factor += np.real(at[:, None] * np.exp(-1j * harmonic * angle))
    bow = random.uniform(0, 0.03) * length_mm * (1 - t**2)
    x = bow[:, None] + radius[:, None] * factor * np.cos(angle)
    y = radius[:, None] * factor * np.sin(angle)
    return np.stack([x, y, np.broadcast_to(z[:, None], x.shape)], axis=2)


def triangles(rings):
    """The closed surface of rings, the first and last of which are single points: (n, 3, 3), outward."""
    low, high = rings[:-1], rings[1:]
    next_low, next_high = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    lower = np.stack([low, next_low, next_high], axis=2)[1:]  # at the first ring these have no area
    upper = np.stack([low, next_high, high], axis=2)[:-1]  # and these at the last
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


def short_bone(random, length_mm=None):
    """Rings of one bone: 45 to 75 mm long, or longer for the end of a forearm bone."""
    length_mm = length_mm or random.uniform(45, 75)
    shaft_mm = random.uniform(3.5, 5)
    return tube(random, length_mm, shaft_mm, shaft_mm * random.uniform(1.3, 1.7, 2))


def write_stl(file, faces):
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    rows = np.zeros(len(faces), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]))
    rows["normal"], rows["corners"] = normals, faces
    file.write_bytes(b"short bones, drawn at random".ljust(80) + np.uint32(len(faces)).tobytes() + rows.tobytes())
