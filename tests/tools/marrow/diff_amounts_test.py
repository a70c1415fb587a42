# SPDX-License-Identifier: Apache-2.0
"""By how much two runs differ, in the terms of the field."""
import json

from harness.cases import FEMUR, SMALL, matrix_product, rotation_vector_deg, simulate, transposed
from diff_cases import Runs
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


class Amounts(Runs):
    """In the terms of the field: what is read from files whose difference is known."""

    def setUp(self):
        super().setUp()
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}
        self.pipeline = "marrow: 1\nnodes:\n" + "".join(
            "  %s: {uses: read.%s, with: {path: %s}}\n" % (kind, kind, name)
            for kind, name in (("volume", "ct.mha"), ("image", "view.png"), ("pose", "pose.yaml"))
        )
        self.pipeline += "outputs: {volume: volume, image: image, pose: pose}\n"

    def run_on(self, name, hu, grey, pose, *arguments):
        (self.scratch / "ct.mha").write_bytes(mha(straight((4, 5, 6)), [0.0] * 119 + [hu], "MET_FLOAT"))
        (self.scratch / "view.png").write_bytes(grey_png(8, 9, lambda u, v: grey if (u, v) == (3, 4) else 100))
        self.write("pose.yaml", pose)
        self.run_into(name, self.pipeline, *arguments)

    def both(self, *arguments):
        self.run_on("a", 0.0, 100, POSE % ("1, 0, 0", "0, 1, 0", 0.5), *arguments)
        self.run_on("b", -7.5, 400, POSE % ("0, -1, 0", "1, 0, 0", 0.25), *arguments)
        return self.diff(1, "a", "b")

    def test_by_values(self):
        told = self.both()
        self.assertIn(
            "First difference: node 'volume' (read.volume)\n  why: the content of the file %s/ct.mha (option 'path')"
            " differs\n  volume  1 of 120 voxels differ (0.833 %%), by at most 7.5 HU\nNode 'image' (read.image)"
            " differs by itself, too\n  why: the content of the file %s/view.png (option 'path') differs\nNode 'pose'"
            " (read.pose) differs by itself, too\n" % (self.scratch, self.scratch),
            told,
        )
        self.assertIn(
            (
                "\nOutputs that differ\n  volume  as above\n  image   1 of 72 pixels differ (1.39 %), by at most 300"
                " grey values\n  pose\n      90 deg and 14.14 mm apart at the fragment's centroid (+90 deg about and +0"
                " mm along its long axis)\n      cost 0.25, was 0.5; 12 evaluations, were 12\n"
            ),
            told,
        )

    def test_by_files(self):
        told = self.both("--no-cache")
        self.assertRegex(
            told,
            (
                r"\n  volume  (\d+ of \d+ bytes of the file differ|the file of \d+ bytes, were \d+) \(by the files in"
                r" outputs/\)\n"
            ),
        )
        self.assertRegex(
            told,
            (
                r"\n  image   (\d+ of \d+ bytes of the file differ|the file of \d+ bytes, were \d+) \(by the files in"
                r" outputs/\)\n"
            ),
        )
        self.assertIn(
            (
                "\n  pose\n      90 deg and 14.14 mm apart at the fragment's centroid (+90 deg about and +0 mm along"
                " its long axis)\n      cost 0.25, was 0.5; 12 evaluations, were 12 (by the files in outputs/)\n"
            ),
            told,
        )


class Femur(Runs):
    def test_poses_in_degrees_and_mm(self):
        case = simulate(self.scratch / "simulated", *SMALL)
        slow = ", ".join(name + ": null" for name in ("scene", "landscape", "profiles", "view3d", "result"))
        pipeline = self.write("femur.yaml", "marrow: 1\nextends: %s\noutputs: {%s}\n" % (FEMUR, slow))
        for name, options in (("a", []), ("b", ["--set", "model.smoothing=3", "--set", "edges.high=80"])):
            result = self.marrow("run", pipeline, "case=%s" % case, "--out", name, "--quiet", *options)
            self.assertEqual(result.returncode, 0, result.stderr)
        told = self.diff(1, "a", "b")
        number = r"[-+]?[0-9.e-]+"
        self.assertRegex(
            told,
            r"First difference: node 'model' \(mesh.marching_cubes\)\n  why: option 'smoothing' is 3, was 0 "
            r"\(--set model.smoothing=3, was the default\)\n"
            r"  mesh distal  \d+ of \d+ vertices lie elsewhere, by at most %s mm\n" % number,
        )
        self.assertIn(
            "Node 'edges' (edges.adaptive_relaxation) differs by itself, too\n  why: option 'high' is 80, was 75 (--set"
            " edges.high=80, was %s:17)\n" % FEMUR.resolve(),
            told,
        )
        self.assertIn(
            "In consequence differ: shaft, start, pose, stated, verdict, calibrated, errors, distance, overlay, ", told
        )
        self.assertRegex(
            told,
            r"\n  pose distal\n      %s deg and %s mm apart at the fragment's centroid \(%s deg about and %s mm along"
            r" its long axis\)\n"
            r"      cost %s, was %s; \d+ evaluations, were \d+\n" % ((number,) * 6),
        )
        self.assertRegex(
            told, r"\n  errors distal/final\n      rotation_deg             %s deg, was %s \(%s\)\n" % ((number,) * 3)
        )
        self.assertIn("\n  model distal            as above\n", told)
        self.assertRegex(told, r"\n  edges frontal           \d+ edge pixels, were \d+: \d+ gone, 0 new\n")
        self.assertRegex(
            told,
            r"\n  overlay distal/frontal  \d+ of \d+ pixels differ \(%s %%\), by at most \d+ grey values\n" % number,
        )
        # The poses' distance by their files, worked out here.
        amount = next(
            output for output in json.loads(self.diff(1, "a", "b", "--json"))["outputs"] if output["name"] == "pose"
        )["items"][0]["amount"]
        poses = [self.pose(name) for name in "ab"]
        moved = [sum(r * c for r, c in zip(row, poses[0][1] + [1])) for pose in poses for row in pose[0][:3]]
        self.assertAlmostEqual(
            amount["displacement_mm"], sum((moved[i] - moved[i + 3]) ** 2 for i in range(3)) ** 0.5, 9
        )
        turned = rotation_vector_deg(
            matrix_product(
                *(
                    [row[:3] for row in pose[0][:3]] if i else transposed([row[:3] for row in pose[0][:3]])
                    for i, pose in enumerate(poses)
                )
            )
        )
        self.assertAlmostEqual(amount["rotation_deg"], sum(x * x for x in turned) ** 0.5, 9)

    def pose(self, run):
        import yaml

        pose = yaml.safe_load((self.scratch / run / "outputs" / "pose" / "distal.yaml").read_text())
        return pose["matrix"], pose["fragment_frame"]["origin_mm"]


if __name__ == "__main__":
    main()
