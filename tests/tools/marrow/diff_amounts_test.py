# SPDX-License-Identifier: Apache-2.0
"""By how much two runs differ, in the terms of the field."""
import json
import re
import shutil

import yaml

from diff_cases import CHAIN, Runs
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


# Runs whose folders are not as the runs left them: damaged, incomplete, older or none at all.
POWERS = "marrow: 1\nnodes:\n  p: {uses: test.powers}\n  n: {uses: test.last_power, in: {powers: p}}\noutputs: {n: n}\n"
SIDES = CHAIN.replace("outputs: {", "  s: {uses: test.sides, with: {names: [one, two]}}\noutputs: {both: s.both, ")
ADVICE = (
    "; give a folder that 'marrow run' wrote, or one of the cells of a comparison (FOLDER/cells/VARIANT/CASE/START)\n"
)


class Folders(Runs):
    def test_values_that_the_store_no_longer_has(self):
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}  # that no other test has filled
        self.use_version(1)
        self.run_into("a", POWERS, "--no-cache", "--seed", 3)
        self.use_version(2)
        self.run_into("b", POWERS, "--no-cache")
        told = self.diff(1, "a", "b")
        self.assertIn("\n  powers  by how much is not known: the store no longer has the value of both runs\n", told)
        self.assertIn("\n  n  value                    6.25 mm, was 4 (+2.25) (by the files in outputs/)\n", told)
        self.assertTrue(
            told.endswith(
                "\nWhat the store no longer has is made again by running a folder's pipeline.yaml with its seed, as  "
                "marrow run a/pipeline.yaml --seed 3\n"
            ),
            told,
        )

    def test_output_files_that_are_damaged_or_gone(self):
        self.run_both(SIDES, SIDES)
        (self.scratch / "a/outputs/sum.json").unlink()
        drawn, item = self.scratch / "b/outputs/drawn.json", self.scratch / "b/outputs/both/two.json"
        whole = drawn.read_bytes()
        drawn.write_bytes(whole[:-1] + b" ")
        item.unlink()
        item.symlink_to(self.scratch / "p.yaml")
        damaged = [
            "a/outputs/sum.json is missing",
            "b/outputs/both/two.json leads out of the folder",
            "b/outputs/drawn.json was changed since the run wrote it",
        ]
        told = self.diff(1, "a", "b")
        self.assertTrue(
            told.startswith(
                "first run (was): a\nsecond run (is): b\n\n"
                + "\n".join(damaged)
                + "\nEverything else compares what the runs computed, not these files\n\n"
                "What took part in both runs came out the same: 6 nodes\n"
            ),
            told,
        )
        self.assertNotIn("identical", told)
        told = json.loads(self.diff(1, "a", "b", "--json"))
        self.assertEqual((told["identical"], told["damaged_files"]), (False, damaged))
        self.assertIn("a/outputs/sum.json is missing\n", self.diff(1, "a", "a"))
        shutil.copy(self.scratch / "b/outputs/sum.json", self.scratch / "a/outputs")
        item.unlink()
        shutil.copy(self.scratch / "a/outputs/both/two.json", item)
        drawn.write_bytes(whole)
        self.assertIn("identical: all 6 nodes came out the same\n", self.diff(0, "a", "b"))

    def test_a_record_without_digests_is_compared_by_keys(self):
        self.run_into("a", CHAIN)
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        record = self.json("b/run.json")
        for output in record["outputs"]:
            self.assertEqual(len(output.pop("digests")), 1)
        self.write("b/run.json", json.dumps(record))
        (self.scratch / "b/outputs/sum.json").unlink()
        self.assertIn("identical", self.diff(0, "a", "b"))

    def test_folders_that_are_not_of_runs(self):
        self.run_into("a", CHAIN)
        pipeline, record = self.read("a/pipeline.yaml"), self.json("a/run.json")
        for node in record["nodes"]:
            del node["items"]
        (self.scratch / "empty").mkdir()
        for name in ("killed", "damaged", "old"):
            self.write(name + "/pipeline.yaml", pipeline)
        self.write("damaged/run.json", "{")
        self.write("bare/run.json", self.read("a/run.json"))
        self.write("old/run.json", json.dumps(record))
        shutil.copytree(self.scratch / "a", self.scratch / "linked")
        (self.scratch / "linked/pipeline.yaml").rename(self.scratch / "elsewhere.yaml")
        (self.scratch / "linked/pipeline.yaml").symlink_to(self.scratch / "elsewhere.yaml")
        for name, text in (
            ("nothing", " is not a folder" + ADVICE),
            ("empty", " is not the folder of a run: it has no run.json" + ADVICE),
            ("bare", " is not the whole folder of a run: it has a run.json, but no pipeline.yaml" + ADVICE),
            ("killed", " did not come to its end: it has a pipeline.yaml, but no run.json; run it again\n"),
            ("damaged", "/run.json is not what 'marrow run' wrote: "),
            (
                "linked",
                "/pipeline.yaml is a link to a file outside of the folder, and such files are not shown; copy it into "
                "the folder\n",
            ),
            (
                "old",
                "/run.json was written by an older marrow, which kept too little to compare it; run its pipeline.yaml "
                "again, with --seed 1\n",
            ),
        ):
            said = "marrow: error: " + ("the run in " if name == "killed" else "") + name + text
            for command in (["diff", name, "a"], ["diff", "a", name], ["rerun", name]):
                result = self.expect(2, *command)
                self.assertEqual(result.stdout, "")
                self.assertTrue(result.stderr.startswith(said), result.stderr)


if __name__ == "__main__":
    main()
