# SPDX-License-Identifier: Apache-2.0
"""Named points of a bone in X-ray images, as heat maps. The points are those that marrow places on the bone's surface,
so a user's CT gives the same ones."""
import dataclasses
import pathlib
import sys

import cv2
import numpy as np
import torch
import yaml
from torch.nn import functional

import export
import images
import simulated
import training
from model import Head, UNet

HELP = "named points of a bone in X-ray images, from simulated bones"
TILE_PX, OVERLAP_PX = (192, 192), 32
STRIDE_PX = 2
SIGMA = 2.0  # of a point's heat map, in its pixels
BATCH = 8
POINT_WEIGHT = 30.0  # of a pixel at a point, because these are few
WIDTHS = (8, 16, 32, 64, 96)
LEAST, REACH = 0.3, 6  # as the node that uses the network has them

# What is drawn for each bone. kind: as simulated.BONES has it; sides_deg: from which sides the views are taken;
# pixel_mm: of the network.
ANATOMIES = {
    "femur": {
        "kind": "femur",
        "pipeline": "training-landmarks.yaml",
        "fragment": "distal",
        "sides_deg": (0, 90),  # from the other side, the image is nearly its mirror image, with other names
        "isocentre_mm": (45, 100),
        "pixel_mm": 1.0,
        "good_for": "the distal end of left femora in fluoroscopy from the front and from the side with beta = 90 "
        "degrees, up to 20 degrees off these; of right femora from the front and with beta = -90 degrees (the option "
        "mirrored)",
        "not_for": "other bones; views from the other side, above or along the bone; children; implants of the knee; "
        "any use on patients",
    },
    "pelvis": {
        "kind": "pelvis",
        "pipeline": "training-landmarks-pelvis.yaml",
        "fragment": "bone",
        "sides_deg": (0, 40, -40),
        "pixel_mm": 1.6,
        "good_for": "plain simulated pelves from the front and 40 degrees off it to both sides, up to 20 degrees off "
        "these",
        "not_for": "views from the side; fractures; children; implants of the hip; any use on patients",
    },
}


@dataclasses.dataclass
class Shown:
    """A view in the network's pixels, and where it shows each point (NaN: it does not)."""

    values: np.ndarray
    points_px: np.ndarray  # n x 2, (u, v)
    pixel_mm: float = 1.0


def settings_of(bone, seed, views, size_px):
    """What is drawn for a case: as for all bones of the kind, but seen from its sides. A femur is a left one whose
    distal end is in view."""
    random = np.random.default_rng([seed, 55])
    drawn, collimator = simulated.settings_of(bone["kind"], seed, views, size_px)
    if bone["kind"] == "femur":
        drawn["bone.side"] = "left"
        drawn["bone.isocentre_from_distal_end_mm"] = "%.1f" % random.uniform(*bone["isocentre_mm"])
    first = random.integers(len(bone["sides_deg"]))
    sides = [bone["sides_deg"][(first + i) % len(bone["sides_deg"])] for i in range(views)]
    drawn["cameras.beta_deg"] = simulated.numbers(np.array(sides) + random.uniform(-20, 20, views))
    drawn["cameras.alpha_deg"] = simulated.numbers(random.uniform(-20, 20, views))
    return drawn, collimator


def make_cases(data, anatomy, seeds, views, size_px):
    bone = ANATOMIES[anatomy]
    folder = data / ("landmarks-" + anatomy)
    folder.mkdir(parents=True, exist_ok=True)
    for i, seed in enumerate(seeds):
        if not (folder / str(seed)).exists():
            drawn, collimator = settings_of(bone, seed, views, size_px)
            simulated.run_pipeline(
                folder / str(seed), anatomy, bone["pipeline"], seed, drawn, collimator, ["views", "truths", "points"]
            )
        print("\rcases of %s: %d of %d" % (anatomy, i + 1, len(seeds)), end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)


def names_of(data, anatomy, seed):
    text = next((data / ("landmarks-" + anatomy) / str(seed)).glob("points*.yaml")).read_text()
    (fragment,) = yaml.safe_load(text)["fragments"].values()
    return fragment["points"]


def views_of(data, anatomy, seed):
    """The views of a case, with the points' places."""
    folder = data / ("landmarks-" + anatomy) / str(seed)
    truth = yaml.safe_load((folder / "truths" / (ANATOMIES[anatomy]["fragment"] + ".yaml")).read_text())
    world_from_model = np.array(truth["matrix"], float)
    places = np.array(list(names_of(data, anatomy, seed).values()), float)
    world_mm = places @ world_from_model[:3, :3].T + world_from_model[:3, 3]
    pixel_mm = ANATOMIES[anatomy]["pixel_mm"]
    return [shown_in(path, world_mm, pixel_mm) for path in sorted((folder / "views").iterdir())]


def shown_in(folder, world_mm, pixel_mm):
    camera = yaml.safe_load((folder / "camera.yaml").read_text())
    intrinsics = np.array(camera["intrinsics"], float)
    camera_from_world = np.array(camera["camera_from_world"]["matrix"], float)
    grey = cv2.imread(str(folder / "image.png"), -1)
    seen = intrinsics @ (camera_from_world[:3, :3] @ world_mm.T + camera_from_world[:3, 3:])
    values = images.resized(images.line_integrals(grey), pixel_mm * intrinsics[0, 0] / camera_from_world[2, 3])
    scale = np.array(values.shape[::-1]) / grey.shape[::-1]
    points_px = ((seen[:2] / seen[2]).T + 0.5) * scale - 0.5
    points_px[((points_px < 0) | (points_px > np.array(values.shape[::-1]) - 1)).any(axis=1)] = np.nan
    return Shown(values, points_px, pixel_mm)


def random_motion(random, shown):
    """A 2 x 3 matrix that takes pixels of a view to those of a tile: turned by up to 30 degrees, larger or smaller by
    up to 15 %, with the middle of what is seen up to 30 pixels off the tile's middle."""
    angle, factor = np.radians(random.uniform(-30, 30)), np.exp(random.uniform(-1, 1) * np.log(1.15))
    turn = factor * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    seen = shown.points_px[np.isfinite(shown.points_px[:, 0])]
    middle = seen.mean(axis=0) if len(seen) else 0.5 * np.array(shown.values.shape[::-1])
    place = 0.5 * (np.array(TILE_PX[::-1]) - 1) + random.uniform(-30, 30, 2)
    return np.column_stack([turn, place - turn @ middle])


def heat_maps(points_px):
    """A Gaussian of height 1 for each point, in pixels of the heat maps."""
    rows, columns = (np.arange(side // STRIDE_PX) * STRIDE_PX + 0.5 * (STRIDE_PX - 1) for side in TILE_PX)
    maps = np.zeros((len(points_px), len(rows), len(columns)), np.float32)
    width = SIGMA * STRIDE_PX
    for i, (u, v) in enumerate(points_px):
        if np.isfinite(u):
            maps[i] = (
                np.exp(-0.5 * ((columns - u) / width) ** 2)[None] * np.exp(-0.5 * ((rows - v) / width) ** 2)[:, None]
            )
    return maps


def batches(views):
    def tile_of(random):
        shown = views[random.integers(len(views))]
        matrix = random_motion(random, shown)
        values = images.scaled(images.changed(random, shown.values))
        points = shown.points_px @ matrix[:, :2].T + matrix[:, 2]
        return images.moved(values, matrix, TILE_PX)[None], heat_maps(points)

    def batch(random):
        return [torch.from_numpy(np.stack(part)) for part in zip(*(tile_of(random) for _ in range(BATCH)))]

    return batch


def loss_of(outputs, maps):
    """Cross entropy, by which a map becomes the probability of a point being there."""
    (scores,) = outputs
    return (
        (1 + POINT_WEIGHT * maps) * functional.binary_cross_entropy_with_logits(scores, maps, reduction="none")
    ).mean()


def maps_of(network, values):
    """The heat maps of a whole view."""
    rows, columns = values.shape
    with torch.no_grad():
        maps = torch.sigmoid(network(torch.from_numpy(images.widened(images.scaled(values))[None, None]))[0])[0].numpy()
    skipped = images.RIM_PX // STRIDE_PX
    return maps[:, skipped : skipped + -(-rows // STRIDE_PX), skipped : skipped + -(-columns // STRIDE_PX)]


def peak_of(heat_map):
    """Centre (u, v), spread and height of a map's peak, as plugins/landmarks/network.cpp computes them."""
    v, u = np.unravel_index(np.argmax(heat_map), heat_map.shape)
    height = heat_map[v, u]
    rows = np.arange(max(0, v - REACH), min(heat_map.shape[0], v + REACH + 1))
    columns = np.arange(max(0, u - REACH), min(heat_map.shape[1], u + REACH + 1))
    weights = np.maximum(heat_map[np.ix_(rows, columns)] - 0.1 * height, 0)
    weights = weights / weights.sum()
    centre = np.array([(weights.sum(axis=0) * columns).sum(), (weights.sum(axis=1) * rows).sum()])
    squares = (columns - centre[0]) ** 2 @ weights.sum(axis=0) + (rows - centre[1]) ** 2 @ weights.sum(axis=1)
    return centre, max(0.3, np.sqrt(0.5 * squares)), height


class Found:
    """Errors of the points of some views, in mm at the bone."""

    def __init__(self):
        self.off_mm, self.spread_mm, self.heights, self.false, self.hidden = [], [], [], 0, 0

    def add(self, maps, shown):
        for heat_map, place in zip(maps, shown.points_px):
            centre, spread, height = peak_of(heat_map)
            if np.isfinite(place[0]):
                at = (centre + 0.5) * STRIDE_PX - 0.5
                self.off_mm.append(shown.pixel_mm * np.linalg.norm(at - place))
                self.spread_mm.append(shown.pixel_mm * STRIDE_PX * spread)
                self.heights.append(height)
            else:
                self.hidden += 1
                self.false += height >= LEAST

    def arrays(self):
        """Errors and spreads of the points that are seen."""
        seen = np.array(self.heights) >= LEAST
        return np.array(self.off_mm)[seen], np.array(self.spread_mm)[seen]

    def factor(self):
        """By which the spreads must be multiplied so that half of the errors lie within 1.177 deviations, as those of a
        normal distribution in two coordinates. Wrong points do not count so."""
        off, spread = self.arrays()
        return float(np.median(off / spread) / np.sqrt(2 * np.log(2))) if len(off) else 1.0

    def figures(self, factor):
        off, spread = self.arrays()
        if not len(off):
            return {"median_mm": float("nan"), "missed": 1.0}
        within = [float(np.mean(off <= radius * factor * spread)) for radius in (1, 2, 3)]
        return {
            "points": len(self.off_mm),
            "median_mm": float(np.median(off)),
            "p90_mm": float(np.percentile(off, 90)),
            "beyond_10_mm": float(np.mean(off > 10)),
            "missed": float(1 - len(off) / len(self.off_mm)),
            "false": float(self.false / max(1, self.hidden)),
            "within_1_deviation": within[0],  # 0.39 is honest for errors in two coordinates
            "within_2_deviations": within[1],  # 0.86
            "within_3_deviations": within[2],  # 0.99
        }


def measured(network, views):
    found = Found()
    for shown in views:
        found.add(maps_of(network, shown.values), shown)
    return found


def liked(found):
    """The mean error, at most 15 mm each, as a figure of which more is better."""
    return -float(np.mean(np.minimum(found.off_mm, 15)))


def card_of(arguments, names, factor, judged):
    bone = ANATOMIES[arguments.anatomy]
    trained_on = (
        "%d simulated bones of %d views each (marrow, tools/networks/train landmarks), %d steps of %d tiles; on %d "
        "other bones: median error %.1f mm, %.0f %% beyond 10 mm"
    )
    figures = (judged["median_mm"], 100 * judged.get("beyond_10_mm", 1))
    return {
        "marrow-network": 1,
        "file": "landmarks-" + arguments.anatomy,
        "name": "landmarks-of-" + arguments.anatomy,
        "help": "Named points of the %s in X-ray images" % arguments.anatomy,
        "version": "1.0.0",
        "licence": "Apache-2.0",
        "trained": {
            "data": trained_on
            % (arguments.training, arguments.views, arguments.steps, BATCH, arguments.judgement, *figures),
            "good_for": bone["good_for"],
            "not_for": bone["not_for"],
        },
        "input": images.input_of_card(bone["pixel_mm"], TILE_PX, OVERLAP_PX),
        "outputs": {
            "heat_maps": {
                "layer": "points",
                "names": names,
                "stride_px": STRIDE_PX,
                "activation": "sigmoid",
                "deviation_factor": round(factor, 3),
            }
        },
    }


def declare(parser):
    parser.add_argument("anatomy", choices=sorted(ANATOMIES), help="the bone")
    parser.add_argument("--training", type=int, default=300, help="anatomies of training (default: %(default)s)")
    parser.add_argument("--choice", type=int, default=20, help="anatomies of choice (default: %(default)s)")
    parser.add_argument("--judgement", type=int, default=40, help="anatomies of judgement (default: %(default)s)")
    parser.add_argument("--views", type=int, default=3, help="views of each anatomy (default: %(default)s)")
    parser.add_argument("--size-px", type=int, default=288, help="side of the images (default: %(default)s)")


def new_network(names):
    network = UNet(1, {"points": Head(len(names), STRIDE_PX)}, WIDTHS)
    with torch.no_grad():
        network.out["points"].bias.fill_(-4)  # points are rare
    return network


def run(arguments):
    """Makes the cases, trains, fits the deviations, exports, and writes figures.json."""
    data, out = pathlib.Path(arguments.data), pathlib.Path(arguments.out)
    out.mkdir(parents=True, exist_ok=True)
    views = {}
    for part, seeds in simulated.SEEDS.items():
        seeds = seeds[: getattr(arguments, part)]
        make_cases(data, arguments.anatomy, seeds, arguments.views, arguments.size_px)
        views[part] = [shown for seed in seeds for shown in views_of(data, arguments.anatomy, seed)]
    names = list(names_of(data, arguments.anatomy, simulated.SEEDS["training"][0]))
    torch.manual_seed(arguments.seed)
    network = new_network(names)
    losses = training.train_as_told(
        arguments,
        network,
        batches(views["training"]),
        loss_of,
        lambda trained: liked(measured(trained, views["choice"])),
    )
    factor = measured(network, views["choice"]).factor()
    figures = {part: measured(network, some[:120]).figures(factor) for part, some in views.items()}
    training.tell(arguments, figures, deviation_factor=factor, losses=losses)
    export.write(network, card_of(arguments, names, factor, figures["judgement"]), out)
