# SPDX-License-Identifier: Apache-2.0
"""Simulated CTs with exact truth, as data of trainings. Each case is a part of one bone in its clutter. All that is
drawn depends on the case's seed alone."""
import pathlib
import shutil
import subprocess
import sys
import zlib

import numpy as np

import simulated

# Which bone a seed belongs to: broken femora most, because their gaps are what is hardest.
KINDS = ("femur", "femur", "femur", "pelvis", "vertebra", "femur", "whole-femur", "pelvis")
COARSE_MM = {"simulate.femur": 2, "simulate.pelvis": 3, "simulate.vertebra": 1.2}
SOLID_HU = 725  # bone of the truth is 1450, all else 0 or metal
METAL_HU = 2500
LENGTH_MM = 70  # of the scanned part


def kind_of(seed):
    return KINDS[seed % len(KINDS)]


def range_of(random, kind, height):
    """The heights that are scanned: of a femur often the fracture, the knee or the hip."""
    if kind == "vertebra":
        return 0, 0
    if kind == "pelvis":
        first = random.uniform(0, 140)
    elif random.random() < 0.35:
        first = random.choice([random.uniform(-25, 20), random.uniform(340, 390)])
    elif kind == "femur" and random.random() < 0.8:
        first = 446 * height - random.uniform(0.3, 0.7) * LENGTH_MM
    else:
        first = random.uniform(0, 380)
    return first, first + LENGTH_MM


def settings_of(seed):
    """What is drawn for a case: node.option -> value."""
    random, kind = np.random.default_rng([seed, 55]), kind_of(seed)
    bone, height = simulated.BONES[kind]["bone"], random.uniform(0.2, 0.75)
    drawn = {"bone.uses": bone, "bone.resolution_mm": COARSE_MM[bone], **simulated.clutter_of(random, kind)}
    if "femur" in kind:
        drawn["bone.side"] = str(random.choice(["left", "right"]))
    if kind == "femur":
        gap = np.append(random.normal(0, 4, 2), -random.uniform(0, 6))
        drawn.update({"phantom.height_fraction": "%.3f" % height, "phantom.ct_gap_mm": simulated.numbers(gap)})
        drawn["phantom.obliquity_deg"] = "%.1f" % random.uniform(0, 60)
        drawn["phantom.roughness_mm"] = "%.2f" % random.uniform(0.3, 2)
    slice_mm = random.choice([0.8, 1, 1.2, 2, 3])
    drawn["ct.slice_thickness_mm"] = slice_mm
    drawn["ct.metal_streaks"] = "%.2f" % random.uniform(0, 2)
    for option, low, high in [
        ("blur_mm", 0.3, 1),
        ("noise_hu", 5, 70),
        ("cortical_hu", 1000, 1700),
        ("marrow_hu", -90, 60),
        ("muscle_hu", 30, 75),
        ("fat_hu", -120, -70),
    ]:
        drawn["ct." + option] = "%.2f" % random.uniform(low, high)
    pixel_mm = random.uniform(0.75, 1)
    first, last = range_of(random, kind, height)
    for node in ("ct", "truth"):
        drawn[node + ".spacing_mm"] = simulated.numbers([pixel_mm, pixel_mm, slice_mm])
        drawn[node + ".range_mm"] = simulated.numbers([first, last])
    return drawn


def make_case(folder, seed):
    """Makes the case in the folder, unless it is there. Ends the program if marrow cannot."""
    if (folder / "truth.mha").exists():
        return
    broken = simulated.BONES[kind_of(seed)]["broken"]
    pipeline = simulated.PIPELINES / ("training-ct.yaml" if broken else "training-ct-whole.yaml")
    work = folder.parent / (folder.name + ".run")
    shutil.rmtree(work, ignore_errors=True)
    words = [simulated.ROOT / "build/bin/marrow", "run", pipeline, "seed=%d" % seed]
    words += ["--out", work, "--seed", seed, "-q", "--no-cache", "--threads", "1"]
    for item in settings_of(seed).items():
        words += ["--set", "%s=%s" % item]
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit("train: the simulation of %s, seed %d, failed:\n%s" % (kind_of(seed), seed, done.stdout))
    shutil.rmtree(folder, ignore_errors=True)
    shutil.move(work / "outputs", folder)
    shutil.rmtree(work)


def make_cases(data, seeds):
    """Makes the cases that the folder DATA/ct lacks. Shows how many are done."""
    folder = pathlib.Path(data) / "ct"
    folder.mkdir(parents=True, exist_ok=True)
    for i, seed in enumerate(seeds):
        make_case(folder / str(seed), seed)
        print("\rCTs: %d of %d" % (i + 1, len(seeds)), end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)


def read_mha(path):
    """Values (slices x rows x columns, 32-bit floats) and spacing [x, y, z] in mm, as marrow writes a volume."""
    content = path.read_bytes()
    end = content.index(b"LOCAL\n") + len(b"LOCAL\n")
    header = dict(line.split(" = ") for line in content[:end].decode().splitlines())
    values = np.frombuffer(zlib.decompress(content[end:]), np.float32)
    columns, rows, slices = map(int, header["DimSize"].split())
    return values.reshape(slices, rows, columns), np.array(header["ElementSpacing"].split(), float)


def read_case(data, seed):
    """CT in HU, where bone is, and spacing [x, y, z] in mm."""
    folder = pathlib.Path(data) / "ct" / str(seed)
    values, spacing_mm = read_mha(folder / "ct.mha")
    truth, _ = read_mha(folder / "truth.mha")
    return values, (truth > SOLID_HU) & (truth < METAL_HU), spacing_mm
