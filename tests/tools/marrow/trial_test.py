# SPDX-License-Identifier: Apache-2.0
"""`marrow check` names the files that a pipeline would miss, also those that a trial of Autoscoper names; and the real
wrist, if its data are there."""
import json

import yaml

from harness import SOURCE
from harness.formats import tiff
from harness.program import Case, main, marrow
from harness.shipped import PIPELINES, inputs_of, shipped
from harness.wrist import POSES, radius_inputs, real_trial

WRIST = SOURCE / "pipelines" / "wrist"
CAMERA = """image size
6,4

camera matrix
10,0,3
0,10,2
0,0,1

rotation
1,0,0
0,1,0
0,0,1

translation
0
0
600
"""
TRIAL = """Version 1.1
mayaCam_csv Calibration/one.txt
CameraRootDir Frames
VolumeFile Volumes/radius.tif
VolumeFlip 0 0 0
VoxelSize 1 1 1
"""
NEAREST = "the last folder on the way that there is: "
READING = """marrow: 1
inputs: {trial: {type: path}}
nodes:
  bone: {uses: read.autoscoper, with: {path: $trial, frame_name: 7}}
outputs: {ct: bone.ct}
"""


class MissingFiles(Case):
    def missing(self, *arguments):
        """What `check` says is missing, without the name of the folder."""
        result = marrow("check", self.scratch / "p.yaml", *arguments)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return [one.replace(str(self.scratch), "") for one in result.stdout.split("  missing: ")[1:]]

    def test_each_path_that_leads_nowhere(self):
        self.write("one.mha", "")
        self.write(
            "p.yaml",
            "marrow: 1\ninputs: {folder: {type: path}, second: {type: text, default: tow}}\nnodes:\n"
            "  a: {uses: read.volume, with: {path: $folder/one.mha}}\n"
            "  b: {uses: read.volume, with: {path: $folder/onne.mha}}\n"
            "  c: {uses: read.images, with: {paths: [$folder/one.mha, $folder/$second/x/y.png]}}\n"
            "  d: {uses: read.volume, with: {path: $folder/may.mha}, may_fail: true}\n"
            "  e: {uses: read.volume, with: {path: $folder/not-needed.mha}}\n"
            "outputs: {a: a, b: b, c: c, d: d}\n",
        )
        self.assertEqual(self.missing(), [])  # a folder that is not given cannot miss files
        self.assertEqual(
            self.missing("folder=%s" % self.scratch),
            [
                "/p.yaml:5: node 'b' would read /onne.mha, which is not there; did you mean 'one.mha'?\n",
                "/p.yaml:6: node 'c' would read /tow/x/y.png, which is not there; " + NEAREST + "\n",
            ],
        )

    def test_a_trial_s_own_files(self):
        self.write("p.yaml", READING)
        self.write_trial()
        trial = "trial=%s" % (self.scratch / "t/trial.cfg")
        (said,) = self.missing(trial)
        self.assertTrue(said.startswith("/p.yaml:4: node 'bone': /t/trial.cfg:2:1: error: mayaCam_csv: "), said)
        for file in (
            "mayaCam_csv: /t/Calibration/one.txt is not there",
            "/t/trial.cfg:3:1: error: CameraRootDir: /t/Frames is not there",
            "/t/trial.cfg:4:1: error: VolumeFile: /t/Volumes/radius.tif is not there",
        ):
            self.assertIn(file, said)
        self.complete()
        self.assertEqual(self.missing(trial), [])

    def write_trial(self):
        (self.scratch / "t").mkdir()
        self.write("t/trial.cfg", TRIAL)

    def complete(self, bone=1000):
        for folder in ("Calibration", "Frames", "Volumes"):
            (self.scratch / "t" / folder).mkdir(exist_ok=True)
        self.write("t/Calibration/one.txt", CAMERA)
        (self.scratch / "t/Frames/a.0007.tif").write_bytes(tiff(6, 4, [[9] * 24]))
        (self.scratch / "t/Volumes/radius.tif").write_bytes(tiff(2, 2, [[0, 0, 0, bone]] * 3))

    def test_a_change_of_a_file_that_the_trial_names_counts(self):
        self.write("p.yaml", READING)
        self.write_trial()
        trial = "trial=%s" % (self.scratch / "t/trial.cfg")
        cache = {"MARROW_CACHE": str(self.scratch / "cache")}
        planned = lambda: json.loads(
            marrow("plan", self.scratch / "p.yaml", trial, "--json", extra_environment=cache).stdout
        )["nodes"]["bone"]["state"]
        self.complete()
        for bone in (1000, 700):
            self.complete(bone)
            self.assertEqual(planned(), "runs")
            out = self.scratch / ("out%d" % bone)
            result = marrow("run", self.scratch / "p.yaml", trial, "-q", "--out", out, extra_environment=cache)
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertEqual(planned(), "cached")


class Shipped(Case):
    def test_no_default_leads_out_of_the_pipelines(self):
        for file in shipped():
            for name, one in inputs_of(file).items():
                if one.get("type") == "path" and one.get("default"):
                    place = (file.parent / one["default"]).resolve()
                    self.assertTrue(place.is_relative_to(PIPELINES), "%s: %s" % (file, name))


class RealWrist(Case):
    """These poses were found before the wrist was read as a trial, by another optimizer. 0.1 to 0.2 degrees lie between
    them, a fifth of what is predicted about the long axis."""

    def registered(self, trial, bone, frame, start):
        out = self.scratch / bone
        inputs = ["trial=%s" % trial, "bone=%s" % bone, "frame=%s" % frame, "start=%s" % (POSES / start)]
        result = marrow("run", WRIST / "wrist-intensity.yaml", *inputs, "--only", "pose", "-q", "--out", out)
        self.assertEqual(result.returncode, 0, result.stderr)
        return yaml.safe_load((out / "outputs/pose/bone.yaml").read_text())["matrix"]

    def test_the_radius_and_the_metacarpal(self):
        trial = real_trial(self.scratch / "wrist")
        if not trial:
            self.skipTest("the data of the wrist are not on this machine")
        for bone, frame, name in (("rad", "0002", "radius"), ("mc3", "0002", "metacarpal")):
            known = yaml.safe_load((POSES / ("%s-%s.medoid.yaml" % (name, frame))).read_text())["matrix"]
            found = self.registered(trial, bone, frame, "%s-%s.pose.yaml" % (name, frame))
            for i in range(3):
                for k in range(4):
                    self.assertAlmostEqual(found[i][k], known[i][k], delta=0.1 if k == 3 else 0.004)

    def test_the_cameras(self):
        trial = real_trial(self.scratch / "wrist")
        if not trial:
            self.skipTest("the data of the wrist are not on this machine")
        out = self.scratch / "out"
        inputs = radius_inputs(trial, ("trial", "bone", "frame", "points"))
        result = marrow("run", WRIST / "wrist-cameras.yaml", *inputs, "-q", "--out", out)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        figures = json.loads((out / "outputs/metrics.json").read_text())["metrics"]
        self.assertLess({one["name"]: one["value"] for one in figures}["error"], 0.4)


if __name__ == "__main__":
    main()
