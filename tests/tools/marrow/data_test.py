# SPDX-License-Identifier: Apache-2.0
"""Public data sets: `marrow data check`, and the pipelines and experiments that read them."""
import importlib.util
import shutil
import tempfile
from pathlib import Path

from harness import SOURCE, skip
from harness.cases import simulate
from harness.program import Case, main, marrow

for module in ("h5py", "PIL", "scipy", "numpy"):
    if not importlib.util.find_spec(module):
        skip("%s is missing: apt-get install python3-h5py python3-pil python3-scipy" % module)
import h5py
import numpy as np
import yaml
from harness.public_data import deepfluoro_file, utrecht_folder

# What the command says of a file in which one thing is wrong.
SAID = {
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


EXPERIMENT = """experiment: 1
extends: %s
name: few
cases: {seeds: 1..%d}
timed_cells: 0
"""


class DataSet(Case):
    """Two simulated vertebrae, and what a command says of a file."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.cases = [
            simulate(
                cls.folder / str(seed),
                "shape_seed=%d" % seed,
                "variation=1",
                "rotation_axial_deg=%d" % (4 * seed),
                pipeline="simulate/simulate-vertebra.yaml",
            )
            for seed in (1, 2)
        ]

    def check(self, file, code, *said):
        result = marrow("data", "check", file)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        told = " ".join((result.stdout + result.stderr).split())
        for part in said:
            self.assertIn(part, told)
        return told

    def compare(self, name, file, count):
        """The rows of the shipped experiment on the first cases."""
        shipped = SOURCE / "pipelines/experiments/public" / (name + ".yaml")
        (self.scratch / "few.yaml").write_text(EXPERIMENT % (shipped, count))
        result = self.marrow("compare", "few.yaml", "file=%s" % file, "--out", "out", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.rows()


class DeepFluoro(DataSet):
    def test_a_file_that_is_right(self):
        file = deepfluoro_file(self.cases, self.folder / "good.h5")
        told = self.check(file, 0, "specimen 17-1882: 28 landmarks in 2 images lie ")
        self.assertEqual(told.count("all signs fit"), 2, told)

    def test_each_sign_once_wrong(self):
        for wrong, said in SAID.items():
            with self.subTest(wrong):
                file = deepfluoro_file(self.cases, self.folder / "wrong.h5", wrong=wrong)
                self.check(file, 1, said)

    def test_registration(self):
        file = deepfluoro_file(self.cases, self.scratch / "data.h5")
        rows = self.compare("deepfluoro", file, 4)
        self.assertEqual(len(rows), 8)
        for number in range(1, 5):
            row = rows["patch_gradient_correlation/seed-%d/0" % number]
            self.assertLess(float(row["errors.pelvis.final.rotation_deg"]), 0.5)
            self.assertLess(float(row["errors.pelvis.final.translation_mm"]), 1)

    def test_what_is_asked_for(self):
        file = deepfluoro_file(self.cases, self.scratch / "data.h5")
        pipeline = SOURCE / "pipelines/public/deepfluoro.yaml"
        for changes, said in (
            (["number=5"], "number: the file has 4 images, so there is no image 5"),
            (["bone=left-femur"], "17-1882/projections/000/gt-poses/cam-to-left-femur-vol: is missing"),
            (["--set", "case.border_px=400"], "border_px: 400 px on each side leave nothing of the image of"),
            (["--set", "case.specimen=17-1882"], "number counts the images of all specimens; leave specimen and"),
            (["number=0", "--set", "case.specimen=17-1883"], "the file has no '17-1883'; did you mean '17-1882'?"),
            (["number=0", "--set", "case.specimen=17-1882"], "images: name at least one, such as 000"),
            (
                ["number=0", "--set", "case.specimen=17-1882", "--set", "case.images=[010]"],
                "images: specimen '17-1882' has no '010'; did you mean '000'?",
            ),
        ):
            with self.subTest(said):
                result = self.marrow("run", pipeline, "file=%s" % file, "--only", "pose", *changes)
                self.assertEqual(result.returncode, 1)
                self.assertIn(said, " ".join(result.stderr.split()))

    def test_inputs_of_an_experiment(self):
        shipped = SOURCE / "pipelines/experiments/public/deepfluoro.yaml"
        file = deepfluoro_file(self.cases, self.scratch / "data.h5")
        self.marrow("compare", shipped, "file=data.h5", "--dry-run")
        made = yaml.safe_load((self.scratch / "runs/compare/deepfluoro.yaml").read_text())
        self.assertEqual(made, {"experiment": 1, "extends": str(shipped), "inputs": {"file": str(file)}})
        again = self.marrow("compare", shipped, "file=other.h5", "--dry-run")
        self.assertEqual(again.returncode, 2)
        self.assertIn("holds this experiment with other inputs; go on with that file, or remove it", again.stderr)
        wrong = self.marrow("compare", shipped, "file", "--dry-run")
        self.assertIn("name=value", wrong.stderr)

    def test_files_of_other_kinds(self):
        (self.scratch / "text.h5").write_text("no HDF5")
        (self.scratch / "a.txt").write_text("x")
        for name, code, said in (
            ("text.h5", 1, "is no HDF5 file that can be opened"),
            ("a.txt", 2, "expected a DeepFluoro file (.h5), or the description of Utrecht's data (.yaml)"),
            ("none.h5", 2, "none.h5: there is no such file"),
        ):
            self.check(self.scratch / name, code, said)
        with h5py.File(self.scratch / "other.h5", "w") as file:
            file["a/b"] = 1
        self.check(self.scratch / "other.h5", 1, "expected the file of full resolution of the DeepFluoro data set")


class Utrecht(DataSet):
    def test_signs(self):
        file = utrecht_folder(self.cases[0], self.folder / "utrecht")
        told = self.check(file, 0, "object L3, projection frontal: its mask shows 100 % of the object's voxels")
        self.assertEqual(told.count("all signs fit"), 2, told)
        for wrong, said in (
            ("inverse_pose", "if 'world_from_volume' is inverted"),
            ("columns", "if 'columns' runs the other way, or the image is mirrored"),
            ("rows", "if 'rows' runs the other way, or the image is upside down"),
        ):
            with self.subTest(wrong):
                self.check(utrecht_folder(self.cases[0], self.folder / wrong, wrong), 1, said)

    def test_registration(self):
        starts = [(3, -2, 4, 2, 3, -4), (-5, 4, 2, -3, 1, 5), (0, 0, 0, 0, 0, 0)]
        file = utrecht_folder(self.cases[0], self.folder / "starts", starts=starts)
        rows = self.compare("utrecht", file, 3)
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
        file = utrecht_folder(self.cases[0], self.folder / "faults")
        told = yaml.safe_load(file.read_text())
        told["volume"]["type"], told["volume"]["voxel_mm"] = "int8", [1, 1]
        told["projections"]["frontal"]["rows"] = list(told["projections"]["frontal"]["columns"])
        file.write_text(yaml.safe_dump(told))
        self.check(
            file,
            1,
            "type: expected uint8, int16, uint16 or float32, got 'int8'",
            "voxel_mm: expected 3 numbers [x, y, z], got a list of 2",
        )
        file = utrecht_folder(self.cases[0], self.folder / "faults")
        (self.folder / "faults/ct.raw").write_bytes(b"1234")
        self.check(file, 1, "ct.raw: has 4 bytes; its size and type in the description ask for")
        file = utrecht_folder(self.cases[0], self.folder / "faults", starts=[(1, 2, 3, 4, 5, 6)])
        (self.folder / "faults/starts.txt").write_text("1 2 3 4 5\n")
        self.check(file, 1, "starts.txt:1: expected six numbers: translations along x, y, z in mm, then rotations")


if __name__ == "__main__":
    main()
