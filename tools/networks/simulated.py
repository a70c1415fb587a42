# SPDX-License-Identifier: Apache-2.0
"""Simulated images with exact truth, as data of trainings. Each case is one bone in its clutter, seen by several views.
All that is drawn depends on the case's seed alone, so the anatomies of training, choice and judgement never mix, and a
folder of cases can be made in parts."""
import concurrent.futures
import dataclasses
import pathlib
import shutil
import subprocess
import sys

import cv2
import numpy as np
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
PIPELINES = ROOT / "pipelines/simulate"

# Seeds of the anatomies. Experiments of marrow use 1 to 50.
SEEDS = {"training": range(1000, 2000), "choice": range(2000, 2200), "judgement": range(3000, 3200)}

LEVELS = ("off", "mild", "usual", "bad")
CLASSES = ("background", "bone", "metal", "outside")
CLASS_STEP = 80  # of the values of simulate.labels


@dataclasses.dataclass
class View:
    """One image. camera_from_world is 4 x 4, in mm; pixel = intrinsics (camera_from_world X), divided by its third."""

    name: str
    grey: np.ndarray  # rows x columns, 8 or 16 bits, air is bright
    intrinsics: np.ndarray
    camera_from_world: np.ndarray
    classes: np.ndarray  # numbers of CLASSES
    borders_px: np.ndarray  # n x 2, (u, v), of the fragments' outlines

    def pixel_mm(self):
        """The width of a pixel at the world's origin, where the bone lies."""
        return float(self.camera_from_world[2, 3] / self.intrinsics[0, 0])

    def project(self, world_mm):
        """The pixels (n x 2) of points of the world (n x 3)."""
        seen = self.intrinsics @ (
            self.camera_from_world[:3, :3] @ np.transpose(world_mm) + self.camera_from_world[:3, 3:]
        )
        return (seen[:2] / seen[2]).T


@dataclasses.dataclass
class Fragment:
    name: str
    world_from_model: np.ndarray  # 4 x 4, in mm
    surface: pathlib.Path  # PLY as marrow writes it; made only with surfaces=True

    def mesh(self):
        """Corners in mm (n x 3) in the frame of the model, and triangles (m x 3). A fragment of a broken bone has the
        corners of the whole bone, but only its own triangles."""
        content = self.surface.read_bytes()
        header, end = content.split(b"end_header\n", 1)[0].decode(), content.index(b"end_header\n") + 11
        corners, faces = (int(header.split("element %s " % name)[1].split()[0]) for name in ("vertex", "face"))
        vertices_mm = np.frombuffer(content, "<f8", 3 * corners, end).reshape(-1, 3)
        face = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
        return vertices_mm, np.frombuffer(content, face, faces, end + 24 * corners)["corners"]

    def vertices_mm(self):
        """The corners of the fragment's own triangles (n x 3), in the frame of the model."""
        vertices_mm, triangles = self.mesh()
        return vertices_mm[np.unique(triangles)]


@dataclasses.dataclass
class Case:
    seed: int
    views: list
    fragments: list


# What is drawn for each bone. bone: what makes it; broken: whether it is a femur with a fracture.
BONES = {
    "femur": {"bone": "simulate.femur", "broken": True, "isocentre_mm": (10, 330), "turn_deg": 15},
    "whole-femur": {"bone": "simulate.femur", "broken": False, "isocentre_mm": (10, 430), "turn_deg": 15},
    "pelvis": {"bone": "simulate.pelvis", "broken": False, "pixel_mm": 0.8, "turn_deg": 10},
    "vertebra": {"bone": "simulate.vertebra", "broken": False, "turn_deg": 10},
}


def level(random, chances):
    return str(random.choice(LEVELS, p=chances))


def numbers(values, digits=3):
    return "[%s]" % ", ".join("%.*f" % (digits, value) for value in values)


def clutter_of(random, kind):
    """Levels of the clutter: each thing is off in about half of the cases; a tenth of the cases is plain."""
    names = ["fat", "folds", "vessels", "cable", "clamp", "table"] + (["knee"] if "femur" in kind else [])
    names += ["pin", "plate"] if kind == "femur" else []
    plain = random.random() < 0.1
    chances = {"knee": (0.2, 0.2, 0.3, 0.3)}
    usual = (0.5, 0.15, 0.2, 0.15)
    return {"clutter." + name: "off" if plain else level(random, chances.get(name, usual)) for name in names}


def motion_of(random, bone):
    """Where the fragments are; those of a fracture are apart by up to about 15 mm and 15 degrees."""
    turns, shifts = (random.normal(0, size, 3) for size in (bone["turn_deg"] / 2, 5))
    drawn = {"phantom.rotation_deg": numbers(turns), "phantom.translation_mm": numbers(shifts)}
    if bone["broken"]:
        drawn["phantom.proximal_rotation_deg"] = numbers(random.normal(0, bone["turn_deg"] / 2, 3))
        drawn["phantom.proximal_translation_mm"] = numbers(random.normal(0, 5, 3))
        drawn["phantom.height_fraction"] = "%.3f" % random.uniform(0.25, 0.75)
        drawn["phantom.obliquity_deg"] = "%.1f" % random.uniform(0, 45)
    return drawn


def cameras_of(random, views, bone, size_px):
    """Views from all sides, of detectors and distances that differ."""
    detector_mm, distance_mm = random.uniform(230, 400), random.uniform(950, 1250)
    pixel_mm = bone.get("pixel_mm", 0) * 512 / size_px or detector_mm / size_px
    first = random.uniform(-180, 180)
    turns = (first + 360 / views * np.arange(views) + random.uniform(-20, 20, views) + 180) % 360 - 180
    return {
        "cameras.names": "[%s]" % ", ".join("v%d" % i for i in range(views)),
        "cameras.alpha_deg": numbers(np.clip(random.normal(0, 12, views), -40, 40)),
        "cameras.beta_deg": numbers(turns),
        "cameras.source_to_detector_mm": "%.1f" % distance_mm,
        "cameras.source_to_isocentre_mm": "%.1f" % (distance_mm * random.uniform(0.55, 0.78)),
        "cameras.width_px": size_px,
        "cameras.height_px": size_px,
        "cameras.pixel_mm": "%.4f" % pixel_mm,
    }


def settings_of(kind, seed, views, size_px):
    """What is drawn for a case: node.option -> value."""
    random = np.random.default_rng([seed, 54])
    bone = BONES[kind]
    drawn = {"bone.uses": bone["bone"], **clutter_of(random, kind), **motion_of(random, bone)}
    if "femur" in kind:
        drawn["bone.resolution_mm"] = 1.6
        drawn["bone.side"] = str(random.choice(["left", "right"]))
        at_knee_mm, anywhere_mm = random.uniform(20, 130), random.uniform(*bone["isocentre_mm"])
        drawn["bone.isocentre_from_distal_end_mm"] = "%.1f" % (at_knee_mm if random.random() < 0.6 else anywhere_mm)
        drawn["bone.thigh_radius_mm"] = "%.1f" % random.uniform(55, 100)
        drawn["bone.fat_mm"] = "%.1f" % random.uniform(5, 30)
    drawn.update(cameras_of(random, views, bone, size_px))
    drawn["exposed.photons"] = "%.0f" % np.exp(random.uniform(np.log(150), np.log(6000)))
    drawn["exposed.blur_px"] = "%.2f" % random.uniform(0.3, 1.3)
    drawn["exposed.scatter_to_primary"] = "%.2f" % random.uniform(0, 1.5)
    drawn["exported.saturation"] = level(random, (0.4, 0.2, 0.25, 0.15))
    drawn["exported.eight_bit"] = level(random, (0.3, 0.25, 0.3, 0.15))
    return drawn, level(random, (0.35, 0.2, 0.25, 0.2))


def run_pipeline(folder, kind, pipeline, seed, drawn, collimator, outputs):
    """Runs a pipeline of pipelines/simulate with these settings, and leaves its outputs in the folder. Ends the program
    if marrow cannot, and names the kind of the bone."""
    marrow = ROOT / "build/bin/marrow"
    if not marrow.exists():
        sys.exit("train: build marrow first, with tools/setup")
    work = folder.parent / (folder.name + ".run")
    shutil.rmtree(work, ignore_errors=True)
    words = [marrow, "run", PIPELINES / pipeline, "seed=%d" % seed, "collimator=" + collimator, "--out", work]
    words += ["--seed", seed, "-q", "--no-cache", "--threads", "1"]
    for item in drawn.items():
        words += ["--set", "%s=%s" % item]
    for output in outputs:
        words += ["--only", output]
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit("train: the simulation of %s, seed %d, failed:\n%s" % (kind, seed, done.stdout))
    shutil.rmtree(folder, ignore_errors=True)
    shutil.move(work / "outputs", folder)
    shutil.rmtree(work)


def make_case(folder, kind, seed, views=3, size_px=288, surfaces=False):
    """Makes the case in the folder, unless it is there. Ends the program if marrow cannot."""
    if (folder / "truths").exists() and (not surfaces or (folder / "models").exists()):
        return
    drawn, collimator = settings_of(kind, seed, views, size_px)
    outputs = ["views", "classes", "borders", "truths"] + ["models"] * surfaces
    pipeline = "training.yaml" if BONES[kind]["broken"] else "training-whole.yaml"
    run_pipeline(folder, kind, pipeline, seed, drawn, collimator, outputs)


def make_cases(data, kind, seeds, at_once=1, **options):
    """Makes the cases that the folder DATA/KIND lacks. Shows how many are done."""
    folder = pathlib.Path(data) / kind
    folder.mkdir(parents=True, exist_ok=True)
    seeds = list(seeds)
    with concurrent.futures.ThreadPoolExecutor(at_once) as pool:
        made = pool.map(lambda seed: make_case(folder / str(seed), kind, seed, **options), seeds)
        for i, _ in enumerate(made):
            print("\rcases of %s: %d of %d" % (kind, i + 1, len(seeds)), end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)


def read_case(data, kind, seed):
    """The case as arrays."""
    folder = pathlib.Path(data) / kind / str(seed)
    views = [read_view(folder, path.name) for path in sorted((folder / "views").iterdir())]
    fragments = []
    for path in sorted((folder / "truths").glob("*.yaml")):
        truth = yaml.safe_load(path.read_text())
        surface = folder / "models" / (path.stem + ".ply")
        fragments.append(Fragment(path.stem, np.array(truth["matrix"], float), surface))
    return Case(seed, views, fragments)


def read_view(folder, name):
    camera = yaml.safe_load((folder / "views" / name / "camera.yaml").read_text())
    classes, borders = (cv2.imread(str(folder / what / (name + ".png")), -1) for what in ("classes", "borders"))
    classes = classes // CLASS_STEP
    v, u = np.nonzero((borders > 0) & (classes < CLASSES.index("metal")))
    return View(
        name,
        cv2.imread(str(folder / "views" / name / "image.png"), -1),
        np.array(camera["intrinsics"], float),
        np.array(camera["camera_from_world"]["matrix"], float),
        classes,
        np.column_stack([u, v]).astype(np.float32),
    )
