# SPDX-License-Identifier: Apache-2.0
"""The silhouette and the landmarks of your own bone or implant in X-ray images, from its surface alone: the network of
mask.network (leave_out: [background]) and landmarks.network. Any view is shown, or views about a rotation; the
anatomies behind the part are simulated. The landmarks are points of the surface that are far from one another; their
file of marrow's lies beside the network.

    tools/networks/train surface femoral.stl --data runs/networks/femoral-data --out runs/networks/femoral
"""
import pathlib

import numpy as np
import torch
from torch.nn import functional

import export
import images
import shadows
import simulated
import surface_images
import surface_points
import training
from model import Head, UNet

HELP = "silhouette and landmarks of your own bone or implant, from its surface"
TILE_PX, OVERLAP_PX, STRIDE = 192, 64, 2
WIDTHS = (8, 16, 32, 48, 64)  # one part is easier than all anatomies
BATCH, SPREAD_PX = 6, 1.5  # of a heat map's peak, in its own pixels
PERCENTILES = (1, 99)
NEAR_PX = 4  # a point is found within this distance
FEWER = {"training": 1, "choice": 0.15, "judgement": 0.15}  # shadows and anatomies of each part


def declare(parser):
    parser.add_argument("surface", type=pathlib.Path, help="closed surface in mm: STL, PLY, OBJ or VTP")
    parser.add_argument("--material", choices=["metal", "bone"], default="metal", help="(default: %(default)s)")
    parser.add_argument(
        "--distance-mm",
        type=float,
        nargs=2,
        default=[600, 1300],
        metavar=("NEAR", "FAR"),
        help="distance of the part from the source (default: 600 1300)",
    )
    parser.add_argument("--pixel-mm", type=float, default=0, help="pixel at the part; 0: its diameter / 60 (default)")
    parser.add_argument("--shadows", type=int, default=2000, help="poses of the training (default: %(default)s)")
    parser.add_argument("--anatomies", type=int, default=12, help="femora of the training (default: %(default)s)")
    parser.add_argument("--points", type=int, default=12, help="number of landmarks (default: %(default)s)")
    parser.add_argument("--name", default="", help="name of the files (default: that of the surface)")


def sources_of(arguments, mesh, points_mm, pixel_mm, part):
    """What the images of training, choice or judgement are composed of. Their poses, anatomies and other parts of metal
    are apart."""
    random = np.random.default_rng([arguments.seed, list(FEWER).index(part), 7])
    count = max(8, round(arguments.shadows * FEWER[part]))
    anatomies = simulated.SEEDS[part][: max(1, round(arguments.anatomies * FEWER[part]))]
    folder, distances = arguments.data, arguments.distance_mm
    own = shadows.kept(
        folder / ("%s-%d-%gmm.npz" % (part, count, pixel_mm)),
        lambda: shadows.shadows_of(
            mesh, points_mm, shadows.poses_of(random, count, distances), pixel_mm, "shadows of " + part
        ),
    )
    others = []
    for number, name in enumerate(["femoral", "tray"]):
        seed = anatomies[0] + number
        make = shadows.marrow().simulate.knee_implant
        others.append(
            shadows.kept(
                folder / ("%s-other-%s-%gmm.npz" % (part, name, pixel_mm)),
                lambda: shadows.shadows_of(
                    make(part=name, variation=1, implant_seed=seed, resolution_mm=1.5),
                    np.zeros((0, 3)),
                    shadows.poses_of(random, max(8, count // 10), distances),
                    pixel_mm,
                ),
            )
        )
    file = folder / ("%s-water-%d-%gmm.npy" % (part, len(anatomies), pixel_mm))
    if not file.exists():
        np.save(file, surface_images.water_pictures(anatomies, 40, TILE_PX, pixel_mm, distances))
    return surface_images.Sources(own, np.load(file), others, arguments.material)


def heat_maps(points_px):
    """points x rows x columns: 1 at a point, falling as a Gaussian."""
    side = TILE_PX // STRIDE
    grid = np.arange(side, dtype=np.float32)
    at = (points_px - 0.5 * (STRIDE - 1)) / STRIDE
    squares_u, squares_v = (((grid - at[:, k : k + 1]) / SPREAD_PX) ** 2 for k in (0, 1))
    return np.exp(-0.5 * (squares_v[:, :, None] + squares_u[:, None, :])).astype(np.float32)


def input_of(grey):
    """As plugins/toolbox/network makes it of grey values in which bone is dark."""
    return images.normalised(-grey, *PERCENTILES)


def pictures_of(sources, pixel_mm, count, seed):
    return [surface_images.picture(np.random.default_rng([seed, i]), sources, TILE_PX, pixel_mm) for i in range(count)]


def batches(sources, pixel_mm):
    def batch(random):
        some = [surface_images.picture(random, sources, TILE_PX, pixel_mm) for _ in range(BATCH)]
        return [
            torch.from_numpy(np.stack([input_of(one.grey)[None] for one in some])),
            torch.from_numpy(np.stack([one.mask for one in some]).astype(np.int64)),
            torch.from_numpy(np.stack([heat_maps(one.points_px) for one in some])),
        ]

    return batch


def loss_of(outputs, mask, maps):
    """Cross entropy and 1 - Dice of the silhouette; cross entropy of the heat maps, in which peaks count more."""
    scores, peaks = outputs
    of_classes = functional.cross_entropy(scores, mask, torch.tensor([1.0, 2.0]))
    inside = torch.softmax(scores, 1)[:, 1]
    dice = (2 * (inside * mask).sum() + 1) / (inside.sum() + mask.sum() + 1)
    weights = 1 + 30 * maps
    of_points = (weights * functional.binary_cross_entropy_with_logits(peaks, maps, reduction="none")).mean()
    return of_classes + 0.5 * (1 - dice) + 2 * of_points


def measured(network, pictures, pixel_mm):
    """Dice of the silhouette over all pictures, and for points in the picture the share found and the median error."""
    both = sizes = 0
    errors_mm = []
    for one in pictures:
        with torch.no_grad():
            scores, peaks = network(torch.from_numpy(input_of(one.grey)[None, None]))
        found = scores[0].argmax(0).numpy()
        both += 2 * np.sum(found & one.mask)
        sizes += np.sum(found) + np.sum(one.mask)
        for point, peak in zip(one.points_px, peaks[0].numpy()):
            if not (np.all(point > 0) and np.all(point < TILE_PX - 1)):
                continue
            v, u = np.unravel_index(np.argmax(peak), peak.shape)
            at = np.array([u, v]) * STRIDE + 0.5 * (STRIDE - 1)
            errors_mm.append(pixel_mm * float(np.linalg.norm(at - point)))
    errors_mm = np.array(errors_mm or [np.inf])
    return {
        "dice": both / max(sizes, 1),
        "points_found": float(np.mean(errors_mm < NEAR_PX * pixel_mm)),
        "points_median_mm": float(np.median(errors_mm)),
    }


def card_of(arguments, name, names, pixel_mm, is_symmetric):
    part = "a part of metal" if arguments.material == "metal" else "a bone"
    return {
        "file": name,
        "marrow-network": 1,
        "name": name,
        "help": "The silhouette of %s, and %d points of its surface, in X-ray images from any side"
        % (part, len(names)),
        "version": "1.0.0",
        "licence": "that of the surface",
        "trained": {
            "data": "%d poses of %s before %d simulated femora, %d steps of %d images (tools/networks/train surface)"
            % (arguments.shadows, arguments.surface.name, arguments.anatomies, arguments.steps, BATCH),
            "good_for": "this part alone, %.0f to %.0f mm from the source" % tuple(arguments.distance_mm),
            "not_for": "other parts, also of the same shape in another size; any use on patients"
            + ("; points of one view alone: it is nearly symmetric, so they lie in a plane" if is_symmetric else ""),
        },
        "input": {
            "values": "grey_values",
            "bone": "dark",
            "pixel_mm": pixel_mm,
            "normalise": {"method": "percentiles", "low": PERCENTILES[0], "high": PERCENTILES[1]},
            "size_px": [TILE_PX, TILE_PX],
            "overlap_px": OVERLAP_PX,
        },
        "outputs": {
            "classes": {"layer": "classes", "names": ["background", "implant"], "activation": "softmax"},
            "heat_maps": {"layer": "points", "names": names, "stride_px": STRIDE, "activation": "sigmoid"},
        },
    }


def run(arguments):
    """Draws the shadows, trains, exports, and writes the landmarks and figures.json."""
    out, name = arguments.out, arguments.name or arguments.surface.stem
    out.mkdir(parents=True, exist_ok=True)
    arguments.data.mkdir(parents=True, exist_ok=True)
    package = shadows.marrow()
    mesh = package.load(str(arguments.surface))
    vertices, triangles, holes = surface_points.closed(np.asarray(mesh.vertices_mm), np.asarray(mesh.triangles))
    if holes:
        print("%d small holes of the surface are closed" % holes)
        mesh = package.Mesh(vertices, triangles)
    points, is_symmetric = surface_points.points_of(vertices, triangles, arguments.points)
    if is_symmetric:
        print("the part is nearly symmetric: its points lie in the plane of symmetry, where one view can name them")
    points_mm = np.array(list(points.values()))
    diameter = 2 * np.linalg.norm(vertices - shadows.middle_of(vertices), axis=1).max()
    pixel_mm = arguments.pixel_mm or float(round(diameter / 60, 2))
    (out / (name + "-points.yaml")).write_text(surface_points.landmarks_text(points))
    sources = {part: sources_of(arguments, mesh, points_mm, pixel_mm, part) for part in FEWER}
    count = min(100, max(8, arguments.shadows // 20))
    pictures = {part: pictures_of(some, pixel_mm, count, 90 + i) for i, (part, some) in enumerate(sources.items())}
    torch.manual_seed(arguments.seed)
    network = UNet(1, {"classes": Head(2), "points": Head(len(points), STRIDE)}, WIDTHS)

    def judge(trained):
        figures = measured(trained, pictures["choice"], pixel_mm)
        return figures["dice"] + 0.5 * figures["points_found"]

    losses = training.train_as_told(arguments, network, batches(sources["training"], pixel_mm), loss_of, judge)
    figures = {part: measured(network, some, pixel_mm) for part, some in pictures.items()}
    training.tell(arguments, figures, pixel_mm=pixel_mm, losses=losses)
    export.write(network, card_of(arguments, name, list(points), pixel_mm, is_symmetric), out)
