# SPDX-License-Identifier: Apache-2.0
"""By how much two runs differ, in the terms of the field."""
import json
import re

import yaml

from diff_cases import Runs
from harness.cases import FEMUR, SMALL, matrix_product, rotation_vector_deg, simulate, transposed
from harness.formats import grey_png, mha, straight
from harness.program import main

POSE = """marrow-pose: 1
target: world
source: ct
matrix:
  - [%s, 5]
  - [%s, 6]
  - [0, 0, 1, 7]
  - [0, 0, 0, 1]
warnings: []
cost: %s
evaluations: 12
fragment_frame:
  origin_mm: [10, 0, 0]
  axes:
    - [1, 0, 0]
    - [0, 1, 0]
    - [0, 0, 1]
"""
FILES = """marrow: 1
nodes:
  volume: {uses: read.volume, with: {path: ct.mha}}
  image: {uses: read.image, with: {path: view.png}}
  pose: {uses: read.pose, with: {path: pose.yaml}}
outputs: {volume: volume, image: image, pose: pose}
"""
POSES_DIFFER = (
    "\n  pose\n      90 deg and 14.14 mm apart at the fragment's centroid (+90 deg about and +0 mm along its long "
    "axis)\n      cost 0.25, was 0.5; 12 evaluations, were 12%s\n"
)
NUMBER = r"[-+]?[0-9.e-]+"


class Amounts(Runs):
    """Of files whose difference is known."""

    has_own_store = True

    def run_on(self, name, hu, grey, pose, *arguments):
        self.write("ct.mha", mha(straight((4, 5, 6)), [0.0] * 119 + [hu], "MET_FLOAT"))
        self.write("view.png", grey_png(8, 9, lambda u, v: grey if (u, v) == (3, 4) else 100))
        self.write("pose.yaml", pose)
        self.run_into(name, FILES, *arguments)

    def both(self, *arguments):
        self.run_on("a", 0.0, 100, POSE % ("1, 0, 0", "0, 1, 0", 0.5), *arguments)
        self.run_on("b", -7.5, 400, POSE % ("0, -1, 0", "1, 0, 0", 0.25), *arguments)
        return self.diff(1, "a", "b")

    def test_by_values(self):
        told = self.both()
        why = "\n  why: the content of the file %s/%s (option 'path') differs\n"
        self.assertIn(
            "First difference: node 'volume' (read.volume)"
            + why % (self.scratch, "ct.mha")
            + "  volume  1 of 120 voxels differ (0.833 %), by at most 7.5 HU\n"
            + "Node 'image' (read.image) differs by itself, too"
            + why % (self.scratch, "view.png")
            + "Node 'pose' (read.pose) differs by itself, too\n",
            told,
        )
        self.assertIn(
            "\nOutputs that differ\n  volume  as above\n"
            "  image   1 of 72 pixels differ (1.39 %), by at most 300 grey values" + POSES_DIFFER % "",
            told,
        )

    def test_by_files(self):
        told = self.both("--no-cache")
        by_files = " (by the files in outputs/)"
        for name in ("volume", "image "):
            said = r"\n  %s  (\d+ of \d+ bytes of the file differ|the file of \d+ bytes, were \d+)%s\n"
            self.assertRegex(told, said % (name, re.escape(by_files)))
        self.assertIn(POSES_DIFFER % by_files, told)


class Femur(Runs):
    def test_poses_in_degrees_and_mm(self):
        case = simulate(self.scratch / "simulated", *SMALL)
        slow = ", ".join(name + ": null" for name in ("scene", "landscape", "profiles", "view3d", "result"))
        text = "marrow: 1\nextends: %s\noutputs: {%s}\n" % (FEMUR, slow)
        changes = ["--set", "model.smoothing=3", "--set", "edges.high=80"]
        self.run_into("a", text, "case=%s" % case)
        self.run_into("b", text, "case=%s" % case, *changes)
        told = self.diff(1, "a", "b")
        for pattern in (
            r"First difference: node 'model' \(mesh.marching_cubes\)\n  why: option 'smoothing' is 3, was 0 "
            r"\(--set model.smoothing=3, was the default\)\n"
            r"  mesh distal  \d+ of \d+ vertices lie elsewhere, by at most NUMBER mm\n",
            r"\n  pose distal\n      NUMBER deg and NUMBER mm apart at the fragment's centroid "
            r"\(NUMBER deg about and NUMBER mm along its long axis\)\n"
            r"      cost NUMBER, was NUMBER; \d+ evaluations, were \d+\n",
            r"\n  errors distal/final\n      rotation_deg             NUMBER deg, was NUMBER \(NUMBER\)\n",
            r"\n  edges frontal           \d+ edge pixels, were \d+: \d+ gone, 0 new\n",
            r"\n  overlay distal/frontal  \d+ of \d+ pixels differ \(NUMBER %\), by at most \d+ grey values\n",
        ):
            self.assertRegex(told, pattern.replace("NUMBER", NUMBER))
        for text in (
            "Node 'edges' (edges.adaptive_relaxation) differs by itself, too\n  why: option 'high' is 80, was 75 (--set"
            " edges.high=80, was %s:17)\n" % FEMUR.resolve(),
            "In consequence differ: shaft, start, pose, stated, verdict, calibrated, errors, distance, overlay, ",
            "\n  model distal            as above\n",
        ):
            self.assertIn(text, told)
        # The poses' distance by their files, worked out here.
        outputs = {output["name"]: output for output in json.loads(self.diff(1, "a", "b", "--json"))["outputs"]}
        amount = outputs["pose"]["items"][0]["amount"]
        poses = [yaml.safe_load(self.read(run + "/outputs/pose/distal.yaml")) for run in "ab"]
        origin = poses[0]["fragment_frame"]["origin_mm"] + [1]
        moved = [[sum(r * c for r, c in zip(row, origin)) for row in pose["matrix"][:3]] for pose in poses]
        displacement_mm = sum((a - b) ** 2 for a, b in zip(*moved)) ** 0.5
        self.assertAlmostEqual(amount["displacement_mm"], displacement_mm, 9)
        was, now = ([row[:3] for row in pose["matrix"][:3]] for pose in poses)
        turned_deg = rotation_vector_deg(matrix_product(transposed(was), now))
        self.assertAlmostEqual(amount["rotation_deg"], sum(x * x for x in turned_deg) ** 0.5, 9)


if __name__ == "__main__":
    main()
