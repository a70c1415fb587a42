# SPDX-License-Identifier: Apache-2.0
"""Damaged and unfit data: each a clear error, a non-zero exit, what is unaffected kept, and nothing overwritten."""
import json
import math
import os
import pathlib
import shutil

from harness.cases import FEMUR, SMALL, contents, copy_case, replace, simulate
from harness.formats import dicom_series, grey_png, mha, straight, tiff
from harness.program import Case, main, marrow

READ_VOLUME = "marrow: 1\nnodes:\n  ct: {uses: read.volume, with: {path: %s}}\noutputs: {ct: ct}\n"
SIZE = 512


class BadData(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.shared_folder()
        cls.simulated = simulate(cls.shared / "simulated", *SMALL)

    def failed(self, pipeline, *arguments, code=1):
        """Runs beside the results of an earlier run; gives the text of the error and the folder."""
        earlier = self.scratch / "runs" / "earlier"
        earlier.mkdir(parents=True)
        (earlier / "pose.yaml").write_text("mine")
        before = contents(self.scratch)
        out = self.scratch / "runs" / "out"
        result = marrow("run", pipeline, *arguments, "--out", out, "--quiet")
        print("\n   " + result.stderr.strip().replace(str(self.scratch), ""))
        self.assertEqual(result.returncode, code, result.stderr)
        if code == 1:
            self.assertEqual(json.loads((out / "run.json").read_text())["status"], "failed")
        after = contents(self.scratch)
        self.assertEqual({name: after.get(name) for name in before}, before, "something was overwritten")
        return result.stderr, out

    def failed_case(self, change=lambda description: None, damage=lambda folder: None, settings=()):
        """Segments by a threshold, which is quicker: what fails is found before or beside it."""
        case = copy_case(self.simulated, self.scratch / "case", change)
        damage(case)
        return self.failed(FEMUR, "case=%s" % case, "--set", "bone.uses=segment.threshold", *settings)

    def assert_nothing_made(self, out):
        self.assertEqual([path for path in (out / "outputs").rglob("*")], [])

    def write_dicom(self, folder):
        dicom_series(folder, (16, 12, 6), [number * 100 for number in range(6) for _ in range(192)])

    def test_whole_files_are_read(self):
        self.write_dicom(self.scratch / "series")
        (self.scratch / "ct.tif").write_bytes(tiff(16, 12, [[number * 100] * 192 for number in range(6)]))
        (self.scratch / "ct.mha").write_bytes(mha(straight((4, 4, 4)), [1.5] * 64, "MET_FLOAT"))
        for name in ("series", "ct.tif, voxel_size_mm: [1, 1, 1]", "ct.mha"):
            result = marrow(
                "run",
                self.write("p.yaml", READ_VOLUME % name),
                "--out",
                self.scratch / ("out-" + name.split(",")[0]),
                "--quiet",
            )
            self.assertEqual(result.returncode, 0, result.stderr)

    def test_dicom_slice_cut_off(self):
        self.write_dicom(self.scratch / "series")
        slice_3 = self.scratch / "series" / "slice7-003.dcm"
        slice_3.write_bytes(slice_3.read_bytes()[:-100])
        error, out = self.failed(self.write("p.yaml", READ_VOLUME % "series"))
        self.assertIn("node 'ct' (read.volume) failed: ", error)
        self.assertIn(
            "series/slice7-003.dcm: is cut off: 384 bytes of pixels expected, got 284; copy or export it again", error
        )
        self.assert_nothing_made(out)

    def test_dicom_slice_missing(self):
        self.write_dicom(self.scratch / "series")
        (self.scratch / "series" / "slice7-003.dcm").unlink()
        error, _ = self.failed(self.write("p.yaml", READ_VOLUME % "series"))
        self.assertIn(
            "2 mm between slice7-002.dcm and slice7-004.dcm, 1 mm between most slices; a slice is missing", error
        )

    def test_dicom_series_of_a_case_cut_off(self):
        def damage(case):
            self.write_dicom(case / "series")
            first = (case / "series" / "slice7-000.dcm").read_bytes()
            replace(case / "series" / "slice7-000.dcm", first[:-384])

        error, out = self.failed_case(lambda description: description.update(ct="series"), damage)
        self.assertIn("node 'case' (read.case) failed: ", error)
        self.assertRegex(
            error,
            r"case.yaml:2:5: case: ct: .*series/slice7-000.dcm: is cut off: 384 bytes of pixels expected, got 0; "
            r"copy or export it again",
        )
        self.assert_nothing_made(out)

    def test_tiff_stack_cut_off(self):
        whole = tiff(16, 12, [[number * 100] * 192 for number in range(6)])
        (self.scratch / "ct.tif").write_bytes(whole[: len(whole) // 2])
        error, out = self.failed(self.write("p.yaml", READ_VOLUME % "ct.tif, voxel_size_mm: [1, 1, 1]"))
        self.assertIn("node 'ct' (read.volume) failed: ", error)
        self.assertIn("ct.tif: is cut off or damaged: only 2 pages are whole (libtiff: ", error)
        self.assert_nothing_made(out)

    def test_tiff_stack_cut_off_in_its_last_page(self):
        (self.scratch / "ct.tif").write_bytes(tiff(16, 12, [[number * 100] * 192 for number in range(6)])[:-100])
        error, _ = self.failed(self.write("p.yaml", READ_VOLUME % "ct.tif, voxel_size_mm: [1, 1, 1]"))
        self.assertIn("ct.tif: is cut off or damaged: only 5 pages are whole (libtiff: ", error)

    def test_tiff_image_cut_off(self):
        error, out = self.failed_case(
            lambda description: description["views"][1].update(image="lateral.tif"),
            lambda case: replace(case / "lateral.tif", tiff(SIZE, SIZE, [[1000] * SIZE * SIZE])[:-SIZE]),
        )
        self.assertIn("node 'case' (read.case) failed: ", error)
        self.assertRegex(
            error, r"case.yaml:8:10: a view: image: .*lateral.tif: is cut off or damaged: only 0 pages are whole"
        )
        self.assert_nothing_made(out)

    def test_image_and_camera_of_different_size(self):
        error, out = self.failed_case(
            damage=lambda case: replace(case / "lateral.png", grey_png(256, 300, lambda u, v: 1000))
        )
        self.assertRegex(
            error,
            r"case.yaml:8:10: a view: view 'lateral': the image has 256 x 300 pixels, but its camera is for 512 x 512; "
            "give the camera that belongs to this image",
        )
        self.assert_nothing_made(out)

    def test_image_without_contrast(self):
        error, out = self.failed_case(
            damage=lambda case: replace(case / "lateral.png", grey_png(SIZE, SIZE, lambda u, v: 20000))
        )
        self.assertIn(
            (
                "node 'edges' (edges.adaptive_relaxation) for lateral failed: view 'lateral': all pixels have the same"
                " value 20000, so there is no edge; check the image file (its inputs: view = case.views)"
            ),
            error,
        )
        self.assert_kept(out, "edges")

    def test_empty_edge_map(self):
        error, out = self.failed_case(
            settings=["--set", "edges.uses=edges.canny"],
            damage=lambda case: replace(case / "lateral.png", grey_png(SIZE, SIZE, lambda u, v: 20000 + 10 * u)),
        )
        self.assertIn(
            (
                "node 'shaft' (shaft.hough_pairs) for lateral failed: view 'lateral': the edge map is empty, so there"
                " is no shaft in it; look at the image, and lower the thresholds of the edge detector (its inputs:"
                " edges = edges, view = case.views, views = case.views)"
            ),
            error,
        )
        self.assert_kept(out, "shaft")

    def test_no_shaft_pair(self):
        def disc(u, v):
            return 10000 if math.hypot(u - 256, v - 256) < 150 else 40000

        error, out = self.failed_case(damage=lambda case: replace(case / "lateral.png", grey_png(SIZE, SIZE, disc)))
        self.assertIn(
            "node 'shaft' (shaft.hough_pairs) for lateral failed: view 'lateral': no shaft pair found: ", error
        )
        self.assertIn(
            "; look at the edges, and set the edge detector's thresholds or this bone's width_mm (its inputs: ", error
        )
        self.assert_kept(out, "shaft")

    def assert_kept(self, out, failed):
        """What does not need the lateral view's shaft is made, and the record says what is missing and why."""
        kept = contents(out / "outputs")
        for name in ("model/distal.ply", "edges/frontal.png", "shaft/frontal.yaml"):
            self.assertIn(name, kept)
        self.assertNotIn("pose/distal.yaml", kept)
        status = {node["id"]: node["status"] for node in json.loads((out / "run.json").read_text())["nodes"]}
        self.assertEqual([status[name] for name in ("model", failed, "pose")], ["done", "failed", "not run"])

    def test_seed_outside_the_bone(self):
        self.check_seed(
            [35, 0, 20],
            (
                r"is not in bone: the CT shows -?\d+ HU there, at least 150 HU expected; move it into cortical or"
                r" spongy bone"
            ),
        )

    def test_seed_outside_the_volume(self):
        self.check_seed([500, 0, 20], "lies outside the volume; seeds are points of the CT's frame 'ct' in mm")

    def check_seed(self, point, fault):
        for uses in ("segment.level_set", "segment.threshold"):
            with self.subTest(uses):
                error, out = self.failed_case(
                    lambda description: description["fragments"]["distal"]["seeds"].insert(2, point),
                    settings=["--set", "bone.uses=" + uses],
                )
                self.assertRegex(
                    error,
                    r"node 'bone' \(%s\) failed: seeds of fragment 'distal': point 3 at \(%.1f, 0.0, 20.0\) mm %s"
                    % (uses, point[0], fault),
                )
                self.assertIn("(its inputs: volume = case.ct, seeds = case.seeds)", error)
                kept = contents(out / "outputs")
                self.assertIn("edges/frontal.png", kept)
                self.assertIn("shaft/lateral.yaml", kept)
                self.assertNotIn("model/distal.ply", kept)
                shutil.rmtree(self.scratch / "runs")
                shutil.rmtree(self.scratch / "case")

    def test_nan_in_a_volume(self):
        values = [50.0] * 64
        values[1 + 4 * (2 + 4 * 3)] = math.nan
        (self.scratch / "ct.mha").write_bytes(mha(straight((4, 4, 4)), values, "MET_FLOAT"))
        error, out = self.failed(self.write("p.yaml", READ_VOLUME % "ct.mha"))
        self.assertIn("node 'ct' (read.volume) failed: ", error)
        self.assertIn(
            "ct.mha: voxel (1, 2, 3) is not a finite number; replace NaN and infinities (with -1000 HU for air)", error
        )
        self.assert_nothing_made(out)

    def test_unwritable_output_folder(self):
        self.write("file", "mine")
        (self.scratch / "ct.mha").write_bytes(mha(straight((4, 4, 4)), [1.5] * 64, "MET_FLOAT"))
        pipeline = self.write("p.yaml", READ_VOLUME % "ct.mha")
        places = [self.scratch / "file" / "out", pathlib.Path("/proc/out")]
        if os.geteuid() != 0:  # root may write everywhere
            (self.scratch / "locked").mkdir(mode=0o500)
            places.append(self.scratch / "locked" / "out")
        for place in places:
            result = marrow("run", pipeline, "--out", place)
            self.assertEqual(result.returncode, 2)
            self.assertRegex(result.stderr, "cannot make the output folder %s: .*; choose another with --out" % place)
        self.assertEqual((self.scratch / "file").read_text(), "mine")


if __name__ == "__main__":
    main()
