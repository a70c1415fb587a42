# SPDX-License-Identifier: Apache-2.0
"""Public data sets: `marrow data check`, and the pipelines and experiments that read them."""
import importlib.util

from harness import SOURCE, skip
from harness.cases import simulate
from harness.program import Case, main

for module in ("h5py", "PIL", "scipy", "numpy"):
    if not importlib.util.find_spec(module):
        skip("%s is missing: apt-get install python3-h5py python3-pil python3-scipy" % module)
import h5py
import numpy as np
import yaml
from harness.public_data import deepfluoro_file, utrecht_folder

# What the command says of a file in which one thing is wrong.
DEEPFLUORO = {
    "extrinsic": "apart if 'extrinsic' of 'proj-params' is inverted",
    "pose": "apart if the poses 'cam-to-pelvis-vol' are inverted",
    "reflected": "proj-params/extrinsic: expected a rotation and a translation as a 4x4 matrix; the file is damaged",
    "forward": "if the camera's y axis runs up and its z axis away from the detector",
    "focal_length": "if the image is mirrored left to right; mirror it back",
    "columns": "if the image is mirrored left to right; mirror it back",
    "rows": "if the image is upside down, or its rows are counted from below; turn it",
    "exchanged": "apart if the marks 'gt-landmarks' are taken as (row, column)",
    "ras": "if the x and y axes of the points are reversed (RAS in place of LPS)",
    "z": "if the z axis of the points is reversed",
    "metres": "if the points are in metres, not mm",
}
UTRECHT = {
    "inverse_pose": "if 'world_from_volume' is inverted",
    "columns": "if 'columns' runs the other way, or the image is mirrored",
    "rows": "if 'rows' runs the other way, or the image is upside down",
}
EXPERIMENT = "experiment: 1\nextends: %s\nname: few\ncases: {seeds: 1..%d}\ntimed_cells: 0\n"
PUBLIC = SOURCE / "pipelines/experiments/public"


class DataSet(Case):
    """Two simulated vertebrae, and what a command says of a file."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = cls.shared_folder()
        made = lambda seed: ["shape_seed=%d" % seed, "variation=1", "rotation_axial_deg=%d" % (4 * seed)]
        vertebra = {"pipeline": "simulate/simulate-vertebra.yaml"}
        cls.cases = [simulate(cls.folder / str(seed), *made(seed), **vertebra) for seed in (1, 2)]

    def check(self, file, status, *said):
        result = self.expect(status, "data", "check", file)
        told = " ".join((result.stdout + result.stderr).split())
        for part in said:
            self.assertIn(part, told)
        return told

    def compare(self, name, file, count):
        """The rows of the shipped experiment on the first cases."""
        self.write("few.yaml", EXPERIMENT % (PUBLIC / (name + ".yaml"), count))
        self.expect(0, "compare", "few.yaml", "file=%s" % file, "--out", "out", "--quiet")
        return self.rows()


class DeepFluoro(DataSet):
    def test_signs(self):
        good = deepfluoro_file(self.cases, self.folder / "good.h5")
        told = self.check(good, 0, "specimen 17-1882: 28 landmarks in 2 images lie ")
        self.assertEqual(told.count("all signs fit"), 2, told)
        for wrong, said in DEEPFLUORO.items():
            with self.subTest(wrong):
                self.check(deepfluoro_file(self.cases, self.folder / "wrong.h5", wrong=wrong), 1, said)

    def test_registration(self):
        rows = self.compare("deepfluoro", deepfluoro_file(self.cases, self.scratch / "data.h5"), 4)
        self.assertEqual(len(rows), 8)
        for number in range(1, 5):
            row = rows["patch_gradient_correlation/seed-%d/0" % number]
            self.assertLess(float(row["errors.pelvis.final.rotation_deg"]), 0.5)
            self.assertLess(float(row["errors.pelvis.final.translation_mm"]), 1)

    def test_what_is_asked_for(self):
        deepfluoro_file(self.cases, self.scratch / "data.h5")
        run = ["run", SOURCE / "pipelines/public/deepfluoro.yaml", "file=data.h5", "--only", "pose"]
        specimen = ["--set", "case.specimen=17-1882"]
        for changes, said in (
            (["number=5"], "number: the file has 4 images, so there is no image 5"),
            (["bone=left-femur"], "17-1882/projections/000/gt-poses/cam-to-left-femur-vol: is missing"),
            (["--set", "case.border_px=400"], "border_px: 400 px on each side leave nothing of the image of"),
            (specimen, "number counts the images of all specimens; leave specimen and"),
            (["number=0", "--set", "case.specimen=17-1883"], "the file has no '17-1883'; did you mean '17-1882'?"),
            (["number=0", *specimen], "images: name at least one, such as 000"),
            (
                ["number=0", *specimen, "--set", "case.images=[010]"],
                "images: specimen '17-1882' has no '010'; did you mean '000'?",
            ),
        ):
            with self.subTest(said):
                self.assertIn(said, " ".join(self.expect(1, *run, *changes).stderr.split()))

    def test_inputs_of_an_experiment(self):
        shipped = PUBLIC / "deepfluoro.yaml"
        file = deepfluoro_file(self.cases, self.scratch / "data.h5")
        self.marrow("compare", shipped, "file=data.h5", "--dry-run")
        made = yaml.safe_load(self.read("runs/compare/deepfluoro.yaml"))
        self.assertEqual(made, {"experiment": 1, "extends": str(shipped), "inputs": {"file": str(file)}})
        self.refusals(
            (
                "holds this experiment with other inputs; go on with that file, or remove it",
                *("compare", shipped, "file=other.h5", "--dry-run"),
            ),
            ("name=value", "compare", shipped, "file", "--dry-run"),
        )

    def test_files_of_other_kinds(self):
        self.write("text.h5", "no HDF5")
        self.write("a.txt", "x")
        with h5py.File(self.scratch / "other.h5", "w") as file:
            file["a/b"] = 1
        for name, status, said in (
            ("text.h5", 1, "is no HDF5 file that can be opened"),
            ("a.txt", 2, "expected a DeepFluoro file (.h5), or the description of Utrecht's data (.yaml)"),
            ("none.h5", 2, "none.h5: there is no such file"),
            ("other.h5", 1, "expected the file of full resolution of the DeepFluoro data set"),
        ):
            self.check(self.scratch / name, status, said)


class Utrecht(DataSet):
    def made(self, name, *arguments, **more):
        return utrecht_folder(self.cases[0], self.folder / name, *arguments, **more)

    def test_signs(self):
        said = "object L3, projection frontal: its mask shows 100 % of the object's voxels"
        told = self.check(self.made("utrecht"), 0, said)
        self.assertEqual(told.count("all signs fit"), 2, told)
        for wrong, said in UTRECHT.items():
            with self.subTest(wrong):
                self.check(self.made(wrong, wrong), 1, said)

    def test_registration(self):
        starts = [(3, -2, 4, 2, 3, -4), (-5, 4, 2, -3, 1, 5), (0, 0, 0, 0, 0, 0)]
        rows = self.compare("utrecht", self.made("starts", starts=starts), 3)
        self.assertEqual(len(rows), 6)
        for number, (x, y, z, *turn_deg) in enumerate(starts, 1):
            row = rows["patch_gradient_correlation/seed-%d/0" % number]
            self.assertLess(float(row["errors.object.final.mtre_mm"]), 0.5)
            # The mean displacement of a region about its centre: the shift, and what the rotation adds across it.
            shift, turn = np.linalg.norm([x, y, z]), np.radians(np.linalg.norm(turn_deg))
            self.assertGreaterEqual(float(row["initial_error"]), shift - 1e-6)
            self.assertLessEqual(float(row["initial_error"]), shift + turn * 60)
        self.assertEqual(float(rows["patch_gradient_correlation/seed-3/0"]["initial_error"]), 0)

    def test_faults_of_a_description(self):
        file = self.made("faults")
        told = yaml.safe_load(file.read_text())
        told["volume"].update(type="int8", voxel_mm=[1, 1])
        told["projections"]["frontal"]["rows"] = list(told["projections"]["frontal"]["columns"])
        file.write_text(yaml.safe_dump(told))
        of_type = "type: expected uint8, int16, uint16 or float32, got 'int8'"
        self.check(file, 1, of_type, "voxel_mm: expected 3 numbers [x, y, z], got a list of 2")
        file = self.made("faults")
        file.with_name("ct.raw").write_bytes(b"1234")
        self.check(file, 1, "ct.raw: has 4 bytes; its size and type in the description ask for")
        file = self.made("faults", starts=[(1, 2, 3, 4, 5, 6)])
        file.with_name("starts.txt").write_text("1 2 3 4 5\n")
        self.check(file, 1, "starts.txt:1: expected six numbers: translations along x, y, z in mm, then rotations")


if __name__ == "__main__":
    main()
