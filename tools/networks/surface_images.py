# SPDX-License-Identifier: Apache-2.0
"""X-ray images of a part at any place among bone, tissue, tables, cables and other metal, drawn wide (domain
randomisation, Tobin et al., IROS 2017). Each is composed of lengths along rays, so its truth is exact."""
import dataclasses

import cv2
import numpy as np

import shadows

WATER_PER_MM = 0.019  # attenuation by water at about 60 keV
METAL_PER_MM = (0.15, 0.8)  # titanium to steel and cobalt-chrome, behind a hardened beam
BONE_PER_MM = (0.02, 0.055)  # a whole bone, from porous to dense


@dataclasses.dataclass
class Sources:
    """What images are composed of: shadows of the part, pictures of water behind anatomies in mm, other metal."""

    part: shadows.Shadows
    water_mm: np.ndarray  # pictures x rows x columns
    others: list  # of Shadows
    material: str


@dataclasses.dataclass
class Picture:
    grey: np.ndarray  # rows x columns, 0 to 1, air is bright
    mask: np.ndarray  # 1 where the part is
    points_px: np.ndarray  # points x 2, (u, v)


def water_pictures(seeds, pictures, size_px, pixel_mm, distances_mm):
    """Mm of water behind the lower end of simulated femora with their tissue, from all sides."""
    package = shadows.marrow()
    result = []
    for seed in seeds:
        random = np.random.default_rng([seed, 5])
        bone = package.simulate.femur(shape_seed=seed, variation=1, isocentre_from_distal_end_mm=20, resolution_mm=2)
        ct = package.simulate.ct(package.simulate.whole(bone), spacing_mm=[2, 2, 2], noise_hu=0)
        projector = package.project.joseph(volume=ct)
        for _ in range(pictures):
            distance = random.uniform(*distances_mm)
            focal, centre = distance / pixel_mm, 0.5 * (size_px - 1)
            camera = package.Camera(size_px, size_px, [[focal, 0, centre], [0, focal, centre], [0, 0, 1]], np.eye(4))
            pose = np.eye(4)
            pose[:3, :3] = shadows.random_rotation(random)
            pose[:3, 3] = [*random.normal(0, 25, 2), distance]
            result.append(np.asarray(projector(camera, pose)))
    return np.array(result, np.float16)


def pasted(random, shadow, i, size_px, zoom, spread):
    """A shadow at a random place of a picture, turned and scaled: chords in mm, and the 2 x 3 matrix that moves its
    pixels."""
    factor, angle = np.exp(random.uniform(-1, 1) * np.log(zoom)), random.uniform(0, 2 * np.pi)
    turn = factor * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    chords = shadow.chords_mm[i].astype(np.float32)
    middle = 0.5 * (np.array(chords.shape[::-1]) - 1)
    at = 0.5 * (size_px - 1) + random.uniform(-spread, spread, 2) * size_px
    matrix = np.column_stack([turn, at - turn @ middle])
    return cv2.warpAffine(chords, matrix, (size_px, size_px), flags=cv2.INTER_LINEAR), matrix


def limb(random, size_px, pixel_mm):
    """Mm of water of a round limb across the picture, with an uneven border."""
    v, u = np.mgrid[:size_px, :size_px].astype(np.float32)
    angle, offset = random.uniform(0, np.pi), random.normal(0, 0.15) * size_px
    across = (u - size_px / 2) * np.cos(angle) + (v - size_px / 2) * np.sin(angle) - offset
    along = (v - size_px / 2) * np.cos(angle) - (u - size_px / 2) * np.sin(angle)
    radius = random.uniform(40, 110) / pixel_mm * (1 + random.normal(0, 0.25) * along / size_px)
    return 2 * pixel_mm * np.sqrt(np.maximum(radius**2 - across**2, 0))


def things(random, size_px, pixel_mm):
    """Mm of water and mm of metal of tables, cables, screws, beads and rods."""
    water, metal = (np.zeros((size_px, size_px), np.float32) for _ in range(2))
    point = lambda: tuple(int(x) for x in random.uniform(-0.1, 1.1, 2) * size_px)
    if random.random() < 0.3:  # tables: strips
        for _ in range(random.integers(1, 4)):
            strip = np.zeros_like(water)
            cv2.line(strip, point(), point(), 1, int(random.uniform(4, 60) / pixel_mm) + 1)
            water += random.uniform(10, 120) * strip
    for _ in range(random.poisson(0.7)):  # cables, wires, rods and screws
        line = np.zeros_like(water)
        ends = np.array([point() for _ in range(random.integers(2, 5))], np.int32)
        cv2.polylines(
            line, [ends], False, 1, max(1, int(np.exp(random.uniform(np.log(1), np.log(12))) / pixel_mm)), cv2.LINE_AA
        )
        metal += random.uniform(0.3, 8) * line
    for _ in range(random.poisson(0.7)):  # beads, markers and coins
        disc = np.zeros_like(water)
        cv2.circle(disc, point(), max(1, int(random.uniform(1, 9) / pixel_mm)), 1, -1, cv2.LINE_AA)
        metal += random.uniform(0.2, 6) * disc
    return water, metal


def field_of(random, size_px):
    """1 in the detector's field: a disc, a rectangle, or everything."""
    field = np.ones((size_px, size_px), np.uint8)
    kind = random.random()
    if kind < 0.55:
        return field
    middle = 0.5 * size_px + random.normal(0, 0.12, 2) * size_px
    inside = np.zeros_like(field)
    if kind < 0.8:
        cv2.circle(inside, tuple(int(x) for x in middle), int(random.uniform(0.42, 0.75) * size_px), 1, -1)
    else:
        half = random.uniform(0.35, 0.6, 2) * size_px
        cv2.rectangle(inside, tuple(int(x) for x in middle - half), tuple(int(x) for x in middle + half), 1, -1)
    return inside


def uneven(random, size_px):
    """Factors of the brightness over the picture: darker towards the rim, or to one side."""
    v, u = (np.mgrid[:size_px, :size_px].astype(np.float32) + 0.5) / size_px - 0.5
    rim = np.hypot(u - random.normal(0, 0.1), v - random.normal(0, 0.1)) / random.uniform(0.4, 0.7)
    slope = random.normal(0, 0.3) * u + random.normal(0, 0.3) * v
    return np.maximum(0.05, 1 + slope - random.uniform(0, 0.9) * np.minimum(rim, 1.2) ** random.uniform(2, 6))


def exposed(random, line_integrals):
    """Grey values from 0 to 1 of an exposure, by a device that nobody knows."""
    signal = np.exp(-line_integrals)
    if random.random() < 0.5:
        signal = signal * uneven(random, len(signal))
    if random.random() < 0.8:
        signal = signal + random.uniform(0, 0.35) * cv2.GaussianBlur(signal, (0, 0), random.uniform(8, 30))
    signal = cv2.GaussianBlur(signal, (0, 0), random.uniform(0.3, 1.2))
    photons = np.exp(random.uniform(np.log(100), np.log(20000))) / max(float(np.median(signal)), 1e-3)
    signal = random.poisson(np.minimum(signal * photons, 1e8)).astype(np.float32) / photons
    signal = np.minimum(signal / max(float(np.percentile(signal, random.uniform(60, 100))), 1e-6), 1)
    if random.random() < 0.35:  # shown as a logarithm
        dark = random.uniform(0.005, 0.05)
        signal = 1 - np.log(np.maximum(signal, dark)) / np.log(dark)
    signal = np.clip(signal, 0, 1) ** np.float32(random.uniform(0.4, 1.5))
    low = random.uniform(0, 0.2)
    return low + (random.uniform(0.75, 1) - low) * signal


def picture(random, sources, size_px, pixel_mm, zoom=1.25):
    """One image. A tenth is without the part."""
    water, metal = things(random, size_px, pixel_mm)
    if len(sources.water_mm) and random.random() < 0.8:
        drawn = sources.water_mm[random.integers(len(sources.water_mm))].astype(np.float32)
        turned = cv2.getRotationMatrix2D((size_px / 2, size_px / 2), random.uniform(0, 360), random.uniform(0.7, 1.6))
        water += random.uniform(0.3, 1.1) * cv2.warpAffine(
            drawn, turned, (size_px, size_px), borderMode=cv2.BORDER_REPLICATE
        )
    if random.random() < 0.5:
        water += random.uniform(0.3, 1) * limb(random, size_px, pixel_mm)
    for other in sources.others:
        if random.random() < 0.25:
            metal += pasted(random, other, random.integers(len(other)), size_px, 1.3, 0.45)[0]
    mask = np.zeros((size_px, size_px), np.uint8)
    points = np.full((sources.part.points_px.shape[1], 2), -1e3, np.float32)
    per_mm = np.exp(random.uniform(*np.log(METAL_PER_MM)))
    lines = WATER_PER_MM * water + per_mm * metal
    if random.random() < 0.9:
        i = random.integers(len(sources.part))
        chords, matrix = pasted(random, sources.part, i, size_px, zoom, 0.3)
        points = sources.part.points_px[i] @ matrix[:, :2].T + matrix[:, 2]
        mask = (chords > 0.5).astype(np.uint8)
        lines = lines + (per_mm if sources.material == "metal" else random.uniform(*BONE_PER_MM)) * chords
    grey, field = exposed(random, lines), field_of(random, size_px)
    grey[field == 0] = 0 if random.random() < 0.85 else 1
    mask[field == 0] = 0
    return Picture(np.round(255 * grey).astype(np.float32) / 255, mask, points.astype(np.float32))
