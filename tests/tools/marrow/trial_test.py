# SPDX-License-Identifier: Apache-2.0
"""`marrow check` names the files that a pipeline would miss, also those that a trial of Autoscoper names; and the real
wrist, if its data are there."""
import yaml

from harness import SOURCE
from harness.cases import metrics
from harness.formats import tiff
from harness.program import Case, main
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


MANY = """marrow: 1
inputs: {folder: {type: path}, second: {type: text, default: tow}}
nodes:
  a: {uses: read.volume, with: {path: $folder/one.mha}}
  b: {uses: read.volume, with: {path: $folder/onne.mha}}
  c: {uses: read.images, with: {paths: [$folder/one.mha, $folder/$second/x/y.png]}}
  d: {uses: read.volume, with: {path: $folder/may.mha}, may_fail: true}
  e: {uses: read.volume, with: {path: $folder/not-needed.mha}}
outputs: {a: a, b: b, c: c, d: d}
"""


class MissingFiles(Case):
    def missing(self, *arguments):
        """What `check` says is missing, without the name of the folder."""
        result = self.expect(0, "check", "p.yaml", *arguments)
        self.assertEqual(result.stderr, "")
        return [one.replace(str(self.scratch), "") for one in result.stdout.split("  missing: ")[1:]]

    def test_each_path_that_leads_nowhere(self):
        self.write("one.mha", "")
        self.write("p.yaml", MANY)
        self.assertEqual(self.missing(), [])  # a folder that is not given cannot miss files
        self.assertEqual(
            self.missing("folder=%s" % self.scratch),
            [
                "p.yaml:5: node 'b' would read /onne.mha, which is not there; did you mean 'one.mha'?\n",
                "p.yaml:6: node 'c' would read /tow/x/y.png, which is not there; " + NEAREST + "\n",
            ],
        )

    def test_a_trial_s_own_files_and_their_changes_count(self):
        self.write("p.yaml", READING)
        self.write("t/trial.cfg", TRIAL)
        trial = "trial=%s" % (self.scratch / "t/trial.cfg")
        (said,) = self.missing(trial)
        self.assertTrue(said.startswith("p.yaml:4: node 'bone': /t/trial.cfg:2:1: error: mayaCam_csv: "), said)
        for file in (
            "mayaCam_csv: /t/Calibration/one.txt is not there",
            "/t/trial.cfg:3:1: error: CameraRootDir: /t/Frames is not there",
            "/t/trial.cfg:4:1: error: VolumeFile: /t/Volumes/radius.tif is not there",
        ):
            self.assertIn(file, said)
        self.write("t/Calibration/one.txt", CAMERA)
        self.write("t/Frames/a.0007.tif", tiff(6, 4, [[9] * 24]))
        planned = lambda: self.json_of("plan", "p.yaml", trial)["nodes"]["bone"]["state"]
        for bone in (1000, 700):
            self.write("t/Volumes/radius.tif", tiff(2, 2, [[0, 0, 0, bone]] * 3))
            self.assertEqual(self.missing(trial), [])
            self.assertEqual(planned(), "runs")
            ran = self.expect(0, "run", "p.yaml", trial, "-q", "--out", "out%d" % bone)
            self.assertEqual(ran.stderr, "")
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

    def setUp(self):
        super().setUp()
        self.trial = real_trial(self.scratch / "wrist")
        if not self.trial:
            self.skipTest("the data of the wrist are not on this machine")

    def test_the_radius_and_the_metacarpal(self):
        for bone, name in (("rad", "radius-0002"), ("mc3", "metacarpal-0002")):
            known = yaml.safe_load((POSES / (name + ".medoid.yaml")).read_text())["matrix"]
            inputs = [
                "trial=%s" % self.trial,
                "bone=" + bone,
                "frame=0002",
                "start=%s" % (POSES / (name + ".pose.yaml")),
            ]
            self.expect(0, "run", WRIST / "wrist-intensity.yaml", *inputs, "--only", "pose", "-q", "--out", bone)
            found = yaml.safe_load(self.read(bone + "/outputs/pose/bone.yaml"))["matrix"]
            for i in range(3):
                for k in range(4):
                    self.assertAlmostEqual(found[i][k], known[i][k], delta=0.1 if k == 3 else 0.004)

    def test_the_cameras(self):
        inputs = radius_inputs(self.trial, ("trial", "bone", "frame", "points"))
        result = self.expect(0, "run", WRIST / "wrist-cameras.yaml", *inputs, "-q", "--out", "out")
        self.assertEqual(result.stderr, "")
        self.assertLess(metrics(self.scratch / "out/outputs/metrics.json")["error"], 0.4)


if __name__ == "__main__":
    main()
