# SPDX-License-Identifier: Apache-2.0
"""Where bone is in the slices of a CT: the network of segment.network. Bone counts as solid, with its marrow."""
import pathlib

import cv2
import numpy as np
import torch
from scipy import ndimage
from torch.nn import functional

import export
import images
import scanned
import simulated
import training
from model import Head, UNet

HELP = "bone in the slices of a CT, from simulated femora, pelves and vertebrae"
PIXEL_MM = 0.8
SLICES = 3
TILE_PX, OVERLAP_PX = (160, 160), 32
HIGH_HU = 1000  # 1 for the network; 0 HU is 0
BATCH = 4
WIDTHS = (8, 16, 28, 40)  # of the U-Net: 0.3 MB, so that a CT is computed in a minute or two
GAP_PX, GAP_WEIGHT = 9, 4  # gaps of a fracture or a joint up to this wide count more: there fragments are told apart
LEAST_VOXELS = 100  # smaller pieces of the truth, such as calcified vessels, are not bone

CARD = {
    "marrow-network": 1,
    "name": "bone-in-slices",
    "help": "Bone, with its marrow, in the axial slices of a CT",
    "version": "1.0.0",
    "licence": "Apache-2.0",
    "input": {
        "values": "hounsfield",
        "bone": "bright",
        "pixel_mm": PIXEL_MM,
        "normalise": {"method": "fixed", "low": 0, "high": HIGH_HU},
        "size_px": list(TILE_PX),
        "overlap_px": OVERLAP_PX,
        "slices": SLICES,
    },
    "outputs": {"classes": {"layer": "classes", "names": ["bone"], "activation": "sigmoid"}},
}
GOOD_FOR = (
    "trials of how a network segments: femora, whole or broken, lumbar vertebrae and pelves in simulated CTs of 0.8 to "
    "3 mm between slices, with little metal"
)
NOT_FOR = (
    "CTs with much metal, whose streaks it takes for bone; sparse spongy bone of real pelves, which it misses in part; "
    "contrast medium; CTs that are not in Hounsfield units; any use on patients"
)


class Scan:
    """A CT in the network's pixels, and where bone is."""

    def __init__(self, values, bone, spacing_mm):
        labels, count = ndimage.label(bone)
        sizes = ndimage.sum_labels(bone, labels, np.arange(count + 1))
        bone = (sizes >= LEAST_VOXELS)[labels] & bone
        bone = np.stack([ndimage.binary_fill_holes(slice_of) for slice_of in bone])  # metal inside of bone
        steps = PIXEL_MM / spacing_mm[0]
        self.values = np.stack([images.resized(one.astype(np.float32), steps) for one in values])
        shares = np.stack([images.resized(one.astype(np.float32), steps) for one in bone])
        self.bone = (shares > 0.5).astype(np.float32)
        self.weights = np.stack([weights_of(one) for one in self.bone])

    def planes(self, z):
        """The slice and its neighbours, as the network takes them."""
        at = np.clip(np.arange(z - SLICES // 2, z + SLICES // 2 + 1), 0, len(self.values) - 1)
        return self.values[at] / HIGH_HU


def weights_of(bone):
    """How much each pixel of a slice counts: more in the narrow gaps of bone."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (GAP_PX, GAP_PX))
    gaps = cv2.morphologyEx(bone, cv2.MORPH_CLOSE, disc) - bone
    return (1 + (GAP_WEIGHT - 1) * gaps).astype(np.float32)


def scans_of(data, seeds):
    return [Scan(*scanned.read_case(data, seed)) for seed in seeds]


def changed(random, planes):
    """Planes as another scanner might show them: another scale, a shift, blur, noise, streaks, air around the field."""
    planes = planes * np.float32(np.exp(random.normal(0, 0.08))) + np.float32(random.normal(0, 0.02))
    if random.random() < 0.3:
        width = random.uniform(0.3, 0.9)
        planes = np.stack([cv2.GaussianBlur(plane, (0, 0), width) for plane in planes])
    if random.random() < 0.5:
        planes = planes + abs(random.normal(0, 0.03)) * random.normal(0, 1, planes.shape).astype(np.float32)
    if random.random() < 0.2:
        planes = planes + abs(random.normal(0, 0.1)) * streaks(random, planes.shape[1:])
    if random.random() < 0.15:
        planes[:, beyond_field(random, planes.shape[1:])] = random.choice([-1, -1.024, -2, -3.024])
    return planes.astype(np.float32)


def streaks(random, shape):
    """Bright and dark rays from a random place."""
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    v, u = random.uniform(0, 1, 2) * shape
    angle = np.arctan2(rows - v, columns - u)
    return np.cos(random.integers(2, 30) * angle + random.uniform(0, 6)).astype(np.float32)


def beyond_field(random, shape):
    """Outside of a circle, as a scanner fills what it did not measure; or above a line, as air over the skin."""
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    if random.random() < 0.5:
        angle = random.uniform(0, 2 * np.pi)
        return np.cos(angle) * (columns - shape[1] / 2) + np.sin(angle) * (rows - shape[0] / 2) > random.uniform(30, 80)
    return np.hypot(rows - shape[0] / 2, columns - shape[1] / 2) > random.uniform(50, 110)


def tile_of(random, scan):
    """A random tile of a slice, changed at random, where bone is, and how much each pixel counts: nothing beyond
    what was scanned."""
    z = random.integers(len(scan.values))
    rows, columns = scan.values.shape[1:]
    middle = random.uniform(0.2, 0.8, 2) * (columns, rows)
    matrix = images.random_motion(random, TILE_PX, middle, zoom=1.2)
    planes = np.stack([images.moved(plane, matrix, TILE_PX) for plane in scan.planes(z)])
    if random.random() < 0.5:
        planes = planes[::-1]
    weights = cv2.warpAffine(scan.weights[z], matrix, TILE_PX[::-1], flags=cv2.INTER_NEAREST)
    bone = images.moved(scan.bone[z], matrix, TILE_PX)
    return changed(random, planes), bone[None], weights[None]


def batches(scans):
    def batch(random):
        tiles = [tile_of(random, scans[i]) for i in random.integers(len(scans), size=BATCH)]
        return [torch.from_numpy(np.stack(part)) for part in zip(*tiles)]

    return batch


def loss_of(outputs, bone, weights):
    """Cross entropy, and 1 - Dice."""
    scores = outputs[0]
    entropy = functional.binary_cross_entropy_with_logits(scores, bone, reduction="none")
    inside = (weights > 0).float()
    found = torch.sigmoid(scores) * inside
    dice = (2 * (found * bone).sum() + 1) / (found.sum() + (bone * inside).sum() + 1)
    return (entropy * weights).sum() / weights.sum() + 0.5 * (1 - dice)


def found_in(network, scan, z):
    """The probability of bone in each pixel of a slice."""
    planes = scan.planes(z).astype(np.float32)
    rows, columns = planes.shape[1:]
    pads = ((0, 0), (16, 16 + -rows % 16), (16, 16 + -columns % 16))
    with torch.no_grad():
        scores = network(torch.from_numpy(np.pad(planes, pads, "reflect")[None]))[0][0, 0]
    return torch.sigmoid(scores).numpy()[16 : 16 + rows, 16 : 16 + columns]


def distances_mm(found, true):
    """Distances of each border from the other, in mm, within the slice; none where one of them has no border."""
    borders = [one & ~ndimage.binary_erosion(one) for one in (found, true)]
    if not all(border.any() for border in borders):
        return np.empty(0)
    away = [ndimage.distance_transform_edt(~border) * PIXEL_MM for border in borders]
    return np.concatenate([away[1][borders[0]], away[0][borders[1]]])


def measured(network, scans, every=4):
    """Dice over all voxels, the worst case's Dice, and distances of the borders in the slices."""
    each, distances = [], []
    for scan in scans:
        overlap = sizes = 0
        for z in range(0, len(scan.values), every):
            found, true = found_in(network, scan, z) > 0.5, scan.bone[z] > 0.5
            overlap, sizes = overlap + (found & true).sum(), sizes + found.sum() + true.sum()
            distances.append(distances_mm(found, true))
        each.append(2 * overlap / max(sizes, 1))
    away = np.concatenate(distances)
    return {
        "dice": float(np.mean(each)),
        "least_dice": float(np.min(each)),
        "mean_mm": float(away.mean()) if len(away) else float("nan"),
        "percentile_95_mm": float(np.percentile(away, 95)) if len(away) else float("nan"),
    }


def declare(parser):
    for part, count in (("training", 80), ("choice", 8), ("judgement", 16)):
        parser.add_argument("--" + part, type=int, default=count, help="number of CTs (default: %(default)s)")
    parser.add_argument("--name", default="slices", help="name of the files (default: %(default)s)")


def run(arguments):
    """Makes the CTs, trains, exports, and writes figures.json."""
    data, out = pathlib.Path(arguments.data), pathlib.Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    scans = {}
    for part, seeds in simulated.SEEDS.items():
        seeds = seeds[: getattr(arguments, part)]
        scanned.make_cases(data, seeds)
        scans[part] = scans_of(data, seeds)
    torch.manual_seed(arguments.seed)
    network = UNet(SLICES, {"classes": Head(1)}, widths=WIDTHS, limits=(-0.5, 2))
    training.train_as_told(
        arguments,
        network,
        batches(scans["training"]),
        loss_of,
        lambda trained: measured(trained, scans["choice"])["dice"],
    )
    figures = {part: measured(network, some[:16]) for part, some in scans.items()}
    training.tell(arguments, figures)
    trained_on = "%d simulated CTs of femora, pelves and vertebrae (marrow, tools/networks/train slices), %d steps" % (
        len(scans["training"]),
        arguments.steps,
    )
    card = {**CARD, "file": arguments.name, "trained": {"data": trained_on, "good_for": GOOD_FOR, "not_for": NOT_FOR}}
    export.write(network, card, out)
