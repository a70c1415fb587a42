# SPDX-License-Identifier: Apache-2.0
"""Damaged and unfit data: each a clear error, a non-zero exit, what is unaffected kept, and nothing overwritten."""
import json
import math
import os
import pathlib
import random
import shutil

from harness.cases import FEMUR, SMALL, contents, copy_case, replace, simulate
from harness.formats import dicom_series, grey_png, mha, straight, tiff
from harness.program import Case, main, marrow
from harness.sample import sample
from harness.shipped import PIPELINES, shipped

READ_VOLUME = "marrow: 1\nnodes:\n  ct: {uses: read.volume, with: {path: %s}}\noutputs: {ct: ct}\n"
SIZE = 512
STACK = "ct.tif, voxel_size_mm: [1, 1, 1]"
WHOLE_STACK = tiff(16, 12, [[number * 100] * 192 for number in range(6)])


class BadData(Case):
    has_own_store = False

    def failed(self, pipeline, *arguments):
        """Runs beside the results of an earlier run; gives the text of the error and the folder."""
        shutil.rmtree(self.scratch / "runs", ignore_errors=True)
        self.write("runs/earlier/pose.yaml", "mine")
        before = contents(self.scratch)
        error = self.expect(1, "run", pipeline, *arguments, "--out", "runs/out", "--quiet").stderr
        self.assertEqual(self.json("runs/out/run.json")["status"], "failed")
        after = contents(self.scratch)
        self.assertEqual({name: after.get(name) for name in before}, before, "something was overwritten")
        return error, self.scratch / "runs" / "out"

    def assert_nothing_made(self, out):
        self.assertEqual([path for path in (out / "outputs").rglob("*")], [])

    def write_dicom(self, folder):
        dicom_series(folder, (16, 12, 6), [number * 100 for number in range(6) for _ in range(192)])


class Volumes(BadData):
    def setUp(self):
        super().setUp()
        self.write_dicom(self.scratch / "series")
        self.write("ct.tif", WHOLE_STACK)
        self.write("ct.mha", mha(straight((4, 4, 4)), [1.5] * 64, "MET_FLOAT"))

    def test_whole_ones_are_read_and_damaged_ones_are_not(self):
        for name in ("series", STACK, "ct.mha"):
            pipeline = self.write("p.yaml", READ_VOLUME % name)
            self.expect(0, "run", pipeline, "--out", "out-" + name.split(",")[0], "--quiet")
        slice_3, values = "series/slice7-003.dcm", [50.0] * 64
        values[1 + 4 * (2 + 4 * 3)] = math.nan
        cut_off = "ct.tif: is cut off or damaged: only %d pages are whole (libtiff: "
        for volume, name, damaged, said in (
            (
                *("series", slice_3, (self.scratch / slice_3).read_bytes()[:-100]),
                slice_3 + ": is cut off: 384 bytes of pixels expected, got 284; copy or export it again",
            ),
            (
                *("series", slice_3, None),
                "2 mm between slice7-002.dcm and slice7-004.dcm, 1 mm between most slices; a slice is missing",
            ),
            (STACK, "ct.tif", WHOLE_STACK[: len(WHOLE_STACK) // 2], cut_off % 2),
            (STACK, "ct.tif", WHOLE_STACK[:-100], cut_off % 5),
            (
                *("ct.mha", "ct.mha", mha(straight((4, 4, 4)), values, "MET_FLOAT")),
                "ct.mha: voxel (1, 2, 3) is not a finite number; replace NaN and infinities (with -1000 HU for air)",
            ),
        ):
            with self.subTest(said):
                (self.scratch / name).unlink()
                if damaged:
                    self.write(name, damaged)
                error, out = self.failed(self.write("p.yaml", READ_VOLUME % volume))
                self.assertIn("node 'ct' (read.volume) failed: ", error)
                self.assertIn(said, error)
                self.assert_nothing_made(out)

    def test_unwritable_output_folder(self):
        self.write("file", "mine")
        pipeline = self.write("p.yaml", READ_VOLUME % "ct.mha")
        places = [self.scratch / "file" / "out", pathlib.Path("/proc/out")]
        if os.geteuid() != 0:  # root may write everywhere
            (self.scratch / "locked").mkdir(mode=0o500)
            places.append(self.scratch / "locked" / "out")
        for place in places:
            error = self.expect(2, "run", pipeline, "--out", place).stderr
            self.assertRegex(error, "cannot make the output folder %s: .*; choose another with --out" % place)
        self.assertEqual(self.read("file"), "mine")


class Cases(BadData):
    @classmethod
    def setUpClass(cls):
        cls.simulated = simulate(cls.shared_folder() / "simulated", *SMALL)

    def failed_case(self, change=lambda description: None, damage=lambda folder: None, settings=()):
        """Segments by a threshold, which is quicker: what fails is found before or beside it."""
        shutil.rmtree(self.scratch / "case", ignore_errors=True)
        damage(copy_case(self.simulated, self.scratch / "case", change))
        return self.failed(FEMUR, "case=case", "--set", "bone.uses=segment.threshold", *settings)

    def assert_unreadable(self, said, **more):
        error, out = self.failed_case(**more)
        self.assertIn("node 'case' (read.case) failed: ", error)
        self.assertRegex(error, said)
        self.assert_nothing_made(out)

    def test_a_dicom_series_cut_off(self):
        def damage(case):
            self.write_dicom(case / "series")
            first = (case / "series" / "slice7-000.dcm").read_bytes()
            replace(case / "series" / "slice7-000.dcm", first[:-384])

        self.assert_unreadable(
            r"case.yaml:2:5: case: ct: .*series/slice7-000.dcm: is cut off: 384 bytes of pixels expected, got 0; "
            r"copy or export it again",
            change=lambda description: description.update(ct="series"),
            damage=damage,
        )

    def test_a_tiff_image_cut_off(self):
        self.assert_unreadable(
            r"case.yaml:8:10: a view: image: .*lateral.tif: is cut off or damaged: only 0 pages are whole",
            change=lambda description: description["views"][1].update(image="lateral.tif"),
            damage=lambda case: replace(case / "lateral.tif", tiff(SIZE, SIZE, [[1000] * SIZE * SIZE])[:-SIZE]),
        )

    def test_image_and_camera_of_different_size(self):
        self.assert_unreadable(
            r"case.yaml:8:10: a view: view 'lateral': the image has 256 x 300 pixels, but its camera is for 512 x 512; "
            "give the camera that belongs to this image",
            damage=lambda case: replace(case / "lateral.png", grey_png(256, 300, lambda u, v: 1000)),
        )

    def assert_others_are_made(self, failed, grey, *said, settings=()):
        """What does not need the lateral view's shaft is made, and the record says what is missing and why."""
        error, out = self.failed_case(
            damage=lambda case: replace(case / "lateral.png", grey_png(SIZE, SIZE, grey)), settings=settings
        )
        for text in said:
            self.assertIn(text, error)
        kept = contents(out / "outputs")
        for name in ("model/distal.ply", "edges/frontal.png", "shaft/frontal.yaml"):
            self.assertIn(name, kept)
        self.assertNotIn("pose/distal.yaml", kept)
        status = {name: node["status"] for name, node in self.nodes("runs/out").items()}
        self.assertEqual([status[name] for name in ("model", failed, "pose")], ["done", "failed", "not run"])

    def test_images_in_which_nothing_is_found(self):
        self.assert_others_are_made(
            "edges",
            lambda u, v: 20000,
            "node 'edges' (edges.adaptive_relaxation) for lateral failed: view 'lateral': all pixels have the same"
            " value 20000, so there is no edge; check the image file (its inputs: view = case.views)",
        )
        self.assert_others_are_made(
            "shaft",
            lambda u, v: 20000 + 10 * u,
            "node 'shaft' (shaft.hough_pairs) for lateral failed: view 'lateral': the edge map is empty, so there"
            " is no shaft in it; look at the image, and lower the thresholds of the edge detector (its inputs:"
            " edges = edges, view = case.views, views = case.views)",
            settings=["--set", "edges.uses=edges.canny"],
        )
        self.assert_others_are_made(
            "shaft",
            lambda u, v: 10000 if math.hypot(u - 256, v - 256) < 150 else 40000,
            "node 'shaft' (shaft.hough_pairs) for lateral failed: view 'lateral': no shaft pair found: ",
            "; look at the edges, and set the edge detector's thresholds or this bone's width_mm (its inputs: ",
        )

    def test_seeds_outside_the_bone_and_outside_the_volume(self):
        for point, fault in (
            (
                [35, 0, 20],
                r"is not in bone: the CT shows -?\d+ HU there, at least 150 HU expected; move it into cortical or"
                r" spongy bone",
            ),
            ([500, 0, 20], "lies outside the volume; seeds are points of the CT's frame 'ct' in mm"),
        ):
            for uses in ("segment.level_set", "segment.threshold"):
                with self.subTest(fault, uses=uses):
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


# 200 random mutations of the shipped pipelines: each is either still good or diagnosed, and none crashes the program.


def mutated(text, chance):
    """The text with one change, and the line it was made on."""
    lines = text.splitlines()
    candidates = [i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    at = chance.choice(candidates)
    line = lines[at]
    column = chance.randrange(len(line))
    kind = chance.randrange(5)
    other = chance.choice("abcxyz019.:{}[],\"'$&*!%@ ") if kind in (0, 2) else ""
    if kind == 4:
        lines.insert(at, line)
    else:
        head, tail = line[:column], line[column:]
        line = head + (other + tail, tail[1:], other + tail[1:], tail[::-1])[kind]
    lines[at] = line
    return "\n".join(lines) + "\n", at + 1


class Mutations(Case):
    def test_each_is_good_or_diagnosed(self):
        chance = random.Random(20261121)
        files = shipped()
        self.assertGreater(len(files), 2)
        folder = shutil.copytree(PIPELINES, self.scratch / "pipelines")  # with the files that they name
        good = at_line = elsewhere = 0
        paths = [files[number % len(files)] for number in range(200)]
        trials = [(path, *mutated(path.read_text(), chance)) for path in paths]
        chosen = sample(trials, 60, key=lambda trial: trial[0])
        for path, text, line in chosen:
            copy = folder / path.relative_to(PIPELINES)
            copy.write_text(text)
            result = marrow("check", copy, "--json")
            copy.write_text(path.read_text())
            self.assertIn(result.returncode, (0, 2), "%s\n%s" % (text, result.stderr))
            faults = json.loads(result.stdout)
            self.assertEqual(bool(faults), result.returncode == 2)
            if not faults:
                good += 1
            elif any(abs(fault["line"] - line) <= 1 for fault in faults):
                at_line += 1
            else:
                # A change of YAML's structure, such as of an indentation, may show later in the file.
                elsewhere += 1
                print("line %d changed, diagnosed at %s" % (line, sorted({fault["line"] for fault in faults})))
                print("   ", text.splitlines()[line - 1])
        print("%d still good, %d diagnosed at the line, %d where the change is missed" % (good, at_line, elsewhere))
        self.assertEqual(good + at_line + elsewhere, len(chosen))
        self.assertLess(elsewhere, 4)


if __name__ == "__main__":
    main()
