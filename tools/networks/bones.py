# SPDX-License-Identifier: Apache-2.0
"""Classes (background, bone, metal, outside of the field) and borders of the femur in X-ray images: the network of
edges.network and mask.network."""
import pathlib

import cv2
import numpy as np
import torch
from torch.nn import functional

import export
import images
import simulated
import training
from model import Head, UNet

HELP = "classes and borders of bone in X-ray images, from simulated femora"
KIND = "femur"
PIXEL_MM = 0.75
TILE_PX, OVERLAP_PX = (256, 256), 64
TRAINING_PX = (192, 192)  # a step costs half of one with whole tiles
WIDTHS = (8, 16, 32, 64, 80)
BATCH = 8
METAL, BONE, OUTSIDE = (simulated.CLASSES.index(name) for name in ("metal", "bone", "outside"))
ROUND_FIELDS = 0.3  # of the tiles are as an image intensifier shows them
CLASS_WEIGHTS = torch.tensor([1.0, 1.0, 3.0, 1.0])
BORDER_WEIGHT = 3.0  # of a pixel on a border, because these are few
NEAR_PX = 2  # a border is found within this distance
THRESHOLDS = np.arange(0.1, 0.95, 0.05)

CARD = {
    "marrow-network": 1,
    "name": "bones-of-femur",
    "help": "Bone, metal and the collimator's rim in X-ray images of femora, and the borders of the femur's fragments",
    "version": "1.0.0",
    "licence": "Apache-2.0",
    "input": images.input_of_card(PIXEL_MM, TILE_PX, OVERLAP_PX),
    "outputs": {
        "classes": {"layer": "classes", "names": list(simulated.CLASSES), "activation": "softmax"},
        "edge_strength": {"layer": "borders", "activation": "sigmoid"},
    },
}
GOOD_FOR = (
    "simulated femora in fluoroscopy, as far as the figures on other femora go; pixels of 0.15 to 0.75 mm at the bone"
)
NOT_FOR = (
    "other bones, whose borders it does not know; contrast medium; images without the size of their pixels; "
    "photographs; any use on patients"
)


class Plane:
    """A view in the network's pixels."""

    def __init__(self, view):
        step = PIXEL_MM / view.pixel_mm()
        self.values = images.resized(images.line_integrals(view.grey), step)
        rows, columns = self.values.shape
        self.classes = cv2.resize(view.classes, (columns, rows), interpolation=cv2.INTER_NEAREST)
        scale = np.array([columns / view.grey.shape[1], rows / view.grey.shape[0]])
        self.borders_px = (view.borders_px + 0.5) * scale - 0.5


def planes_of(data, seeds):
    return [Plane(view) for seed in seeds for view in simulated.read_case(data, KIND, seed).views]


def border_map(points_px, size_px):
    """1 within about a pixel of the points."""
    at = np.rint(points_px).astype(int)
    inside = ((at >= 0) & (at < np.array(size_px[::-1]))).all(axis=1)
    found = np.zeros(size_px, np.uint8)
    found[at[inside, 1], at[inside, 0]] = 1
    return cv2.dilate(found, np.ones((3, 3), np.uint8))


def tile_of(random, plane):
    """A random tile of a view, changed at random: image, classes, borders, and where it is part of the view."""
    rows, columns = plane.values.shape
    middle = random.uniform(0.25, 0.75, 2) * (columns, rows)
    matrix = images.random_motion(random, TRAINING_PX, middle, zoom=1.25)
    values, seen_classes = images.changed(random, plane.values), plane.classes
    if random.random() < ROUND_FIELDS:
        outside = images.outside_of_round_field(random, values.shape)
        values, seen_classes = images.covered(random, values, outside), np.where(outside, OUTSIDE, seen_classes)
    inside = cv2.warpAffine(np.ones_like(plane.classes), matrix, TRAINING_PX[::-1], flags=cv2.INTER_NEAREST)
    points = plane.borders_px @ matrix[:, :2].T + matrix[:, 2]
    classes = images.moved(seen_classes.astype(np.uint8), matrix, TRAINING_PX, cv2.INTER_NEAREST)
    return (
        images.moved(images.scaled(values), matrix, TRAINING_PX)[None],
        classes.astype(np.int64),
        (border_map(points, TRAINING_PX) * (classes != OUTSIDE)).astype(np.float32)[None],
        inside.astype(np.float32)[None],
    )


def batches(planes):
    def batch(random):
        tiles = [tile_of(random, planes[i]) for i in random.integers(len(planes), size=BATCH)]
        return [torch.from_numpy(np.stack(part)) for part in zip(*tiles)]

    return batch


def loss_of(outputs, classes, borders, inside):
    """Cross entropy of the classes; cross entropy and 1 - Dice of the borders. Only pixels of the view count."""
    class_scores, border_scores = outputs
    of_classes = functional.cross_entropy(class_scores, classes, CLASS_WEIGHTS, reduction="none")[:, None]
    strength, weights = torch.sigmoid(border_scores), 1 + (BORDER_WEIGHT - 1) * borders
    of_borders = weights * functional.binary_cross_entropy_with_logits(border_scores, borders, reduction="none")
    overlap = 2 * (inside * strength * borders).sum() + 1
    dice = overlap / ((inside * (strength + borders)).sum() + 1)
    return ((of_classes + of_borders) * inside).sum() / inside.sum() + 0.5 * (1 - dice)


def maps_of(network, plane):
    """Number of the most probable class, and strength of borders, of a whole view."""
    with torch.no_grad():
        classes, borders = network(torch.from_numpy(images.widened(images.scaled(plane.values))[None, None]))
    inside = tuple(slice(images.RIM_PX, images.RIM_PX + side) for side in plane.values.shape)
    return classes[0].argmax(0).numpy()[inside], torch.sigmoid(borders[0, 0]).numpy()[inside]


def far_from(mask):
    """Distance of each pixel from the pixels of the mask."""
    if not mask.any():
        return np.full(mask.shape, np.inf, np.float32)
    return cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


class Figures:
    """Counts over views: Dice of the classes, precision and recall of the borders at each threshold."""

    def __init__(self):
        self.overlap, self.sizes = np.zeros(4), np.zeros(4)
        self.right, self.found, self.met, self.true = (np.zeros(len(THRESHOLDS)) for _ in range(4))

    def add(self, classes, strength, plane):
        for i in range(4):
            found, true = classes == i, plane.classes == i
            self.overlap[i] += np.sum(found & true)
            self.sizes[i] += np.sum(found) + np.sum(true)
        at = np.rint(plane.borders_px).astype(int)
        at = np.clip(at, 0, np.array(strength.shape[::-1]) - 1)
        true = np.zeros(strength.shape, bool)
        true[at[:, 1], at[:, 0]] = True
        from_true = far_from(true)
        for i, threshold in enumerate(THRESHOLDS):
            found = strength >= threshold
            self.right[i] += np.sum(found & (from_true <= NEAR_PX))
            self.found[i] += np.sum(found)
            self.met[i] += np.sum(far_from(found)[true] <= NEAR_PX)
            self.true[i] += np.sum(true)

    def dice(self):
        return 2 * self.overlap / np.maximum(self.sizes, 1)

    def precision(self):
        return self.right / np.maximum(self.found, 1)

    def recall(self):
        return self.met / np.maximum(self.true, 1)

    def balance(self):
        """The harmonic mean of precision and recall (F1) at each threshold."""
        return 2 * self.precision() * self.recall() / np.maximum(self.precision() + self.recall(), 1e-9)

    def at(self, threshold):
        i, dice = int(np.argmin(np.abs(THRESHOLDS - threshold))), self.dice()
        return {
            "bone_dice": dice[BONE],
            "metal_dice": dice[METAL],
            "outside_dice": dice[OUTSIDE],
            "border_precision": self.precision()[i],
            "border_recall": self.recall()[i],
        }


def measured(network, planes):
    figures = Figures()
    for plane in planes:
        figures.add(*maps_of(network, plane), plane)
    return figures


def liked(figures):
    """One number for the choice of the weights."""
    dice = figures.dice()
    return float(dice[BONE] + dice[METAL] + figures.balance().max()) / 3


def make_half_the_threshold(network, planes):
    """Shifts the borders' scores so that a strength of 0.5 means what the best threshold for these views meant, the
    one with the largest harmonic mean of precision and recall. Returns that threshold."""
    threshold = float(THRESHOLDS[np.argmax(measured(network, planes).balance())])
    with torch.no_grad():
        network.out["borders"].bias -= float(np.log(threshold / (1 - threshold)))
    return threshold


def declare(parser):
    parser.add_argument("--training", type=int, default=300, help="anatomies of training (default: %(default)s)")
    parser.add_argument("--choice", type=int, default=20, help="anatomies of choice (default: %(default)s)")
    parser.add_argument("--judgement", type=int, default=40, help="anatomies of judgement (default: %(default)s)")
    parser.add_argument("--views", type=int, default=3, help="views of each anatomy (default: %(default)s)")
    parser.add_argument("--size-px", type=int, default=288, help="side of the images (default: %(default)s)")
    parser.add_argument("--name", default="bones", help="name of the files (default: %(default)s)")


def run(arguments):
    """Makes the cases, trains, chooses the threshold, exports, and writes figures.json."""
    data, out = pathlib.Path(arguments.data), pathlib.Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    counts = {part: getattr(arguments, part) for part in simulated.SEEDS}
    seeds = {part: simulated.SEEDS[part][:count] for part, count in counts.items()}
    planes = {}
    for part in simulated.SEEDS:
        simulated.make_cases(data, KIND, seeds[part], views=arguments.views, size_px=arguments.size_px)
        planes[part] = planes_of(data, seeds[part])
    torch.manual_seed(arguments.seed)
    network = UNet(1, {"classes": Head(len(simulated.CLASSES)), "borders": Head(1)}, WIDTHS)
    losses = training.train_as_told(
        arguments,
        network,
        batches(planes["training"]),
        loss_of,
        lambda trained: liked(measured(trained, planes["choice"])),
    )
    threshold = make_half_the_threshold(network, planes["choice"])
    figures = {part: measured(network, some[:120]).at(0.5) for part, some in planes.items()}
    training.tell(arguments, figures, threshold=threshold, losses=losses)
    made_by = "simulated femora of %d views each (marrow, tools/networks/train bones)" % arguments.views
    told = ", ".join("%s %.2f" % (name.replace("_", " "), value) for name, value in figures["judgement"].items())
    trained_on = "%d %s, %d steps of %d tiles; on %d other femora: %s" % (
        counts["training"],
        made_by,
        arguments.steps,
        BATCH,
        counts["judgement"],
        told,
    )
    card = {**CARD, "file": arguments.name, "trained": {"data": trained_on, "good_for": GOOD_FOR, "not_for": NOT_FOR}}
    export.write(network, card, out)
