# SPDX-License-Identifier: Apache-2.0
"""docs/i-have.md: each of its commands on files as its section describes them, made from a simulated femur."""
import json
import pathlib
import re
import shlex
import shutil
import unittest
import zlib

import numpy as np
import yaml

try:
    import h5py
    import scipy
    from PIL import Image
    from harness import public_data
except ImportError:
    public_data = None

from documents import BUILD, IS_SANITIZED, SOURCE, Documents, blocks, main
from harness.cases import SMALL, copy_case, simulate
from harness.wrist import real_trial

PAGE = "docs/i-have"
LANDMARKS = [0, 400, 900, 1500, 2500]  # vertices of the surface


def yaml_file(path, content):
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def moved(pose, points):
    return points @ pose[:3, :3].T + pose[:3, 3]


def vertices_of(path):
    """The vertices and the rest of a binary PLY as marrow writes it, and its header."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode()
    count = int(re.search(r"element vertex (\d+)", header).group(1))
    kind = {"float": "<f4", "double": "<f8"}[re.search(r"property (\w+) x", header).group(1)]
    points = np.frombuffer(data, kind, 3 * count, end).reshape(-1, 3)
    return header, points, data[end + points.nbytes :]


def labels_of(path, to):
    """A label map of a signed field: 1 where it is negative."""
    data = path.read_bytes()
    head = re.match(rb"(?s)(.*?ElementDataFile = LOCAL\n)", data).group(1).decode()
    values = np.frombuffer(zlib.decompress(data[len(head) :]), "<f4")
    head = re.sub(r"CompressedData = True\nCompressedDataSize = \d+\n", "", head).replace("MET_FLOAT", "MET_UCHAR")
    to.write_bytes(head.encode() + (values < 0).astype(np.uint8).tobytes())
    return to


@unittest.skipIf(IS_SANITIZED, "it would take minutes")
class Held(Documents):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # The packages that the page names are those of Debian's Python.
        cls.environment["PATH"] = "%s:/usr/bin:%s" % (BUILD / "bin", cls.environment["PATH"])
        folder, cls.given = cls.folder, {}
        case = simulate(folder / "simulated", *SMALL, "start=exact")
        cls.told = yaml.safe_load((case / "case.yaml").read_text())
        cls.truth = np.array(cls.told["fragments"]["distal"]["truth"]["matrix"])
        cls.sections = cls.sections_of_the_page()
        cls.give(CASE=case, CT=case / "ct.mha")
        for view in cls.told["views"]:
            name = view["name"].upper()
            cls.give(**{name: case / view["image"], name + "_CAMERA": case / view["camera"]})
        seeds = {name: {"seeds": one["seeds"]} for name, one in cls.told["fragments"].items()}
        cls.give(SEEDS=yaml_file(folder / "seeds.yaml", {"marrow-seeds": 1, "fragments": seeds}))
        for i in range(5):
            copy_case(case, folder / "cases" / str(i))

    @classmethod
    def give(cls, **paths):
        cls.given.update(paths)

    @classmethod
    def sections_of_the_page(cls):
        """{title: its command}. The files of the page are written beside the pipelines."""
        found = {}
        for part in re.split(r"^## ", cls.documents[PAGE], flags=re.M)[1:]:
            for block in blocks.blocks_of(part):
                if block.about and block.language == "yaml":
                    (cls.folder / block.about).write_text(block.text)
                elif block.language == "shell":
                    assert part not in found, "one command in each section"
                    found[part.splitlines()[0]] = block.text
        return found

    def run_section(self, title, ends=0, **given):
        """The outputs of the section's command. `given`: what its words in capitals stand for, beside the usual."""
        words = {**self.given, **given}
        command = re.sub(
            r"=([A-Z_]+)\b", lambda word: "=" + shlex.quote(str(words[word.group(1)])), self.sections[title]
        )
        out = self.folder / re.sub(r"\W+", "-", title)
        result = self.run_here("bash", "-ec", command.rstrip() + " --out " + str(out))
        self.assertEqual(result.returncode, ends, result.stdout[-3000:] + result.stderr[-3000:])
        return out / "outputs" if (out / "outputs").is_dir() else out

    def expect_pose(self, path, within_mm):
        """Points of the fragment lie where the truth places them."""
        pose = np.array(yaml.safe_load(path.read_text())["matrix"])
        points = np.array([[x, y, z] for x in (-30, 30) for y in (-20, 20) for z in (0, 120)])
        away = np.linalg.norm(moved(pose, points) - moved(self.truth, points), axis=1).max()
        self.assertLess(away, within_mm)

    def bone(self):
        """outputs of "A CT only", which other sections need."""
        out = self.folder / "A-CT-only" / "outputs"
        return out if out.is_dir() else self.run_section("A CT only")

    def surface(self):
        return self.bone() / "model" / "distal.ply"

    def test_every_section_is_tried(self):
        tried = set(re.findall(r'run_section\(\s*"([^"]+)"', pathlib.Path(__file__).read_text()))
        self.assertEqual(tried, set(self.sections))

    def test_a_ct_and_two_images(self):
        out = self.run_section("A CT and two X-ray images")
        self.expect_pose(out / "pose" / "distal.yaml", 2)

    def test_one_image(self):
        one = copy_case(self.given["CASE"], self.folder / "one", lambda told: told.update(views=told["views"][:1]))
        out = self.run_section("One X-ray image", CASE=one)
        self.expect_pose(out / "pose" / "distal.yaml", 6)

    def test_a_segmentation(self):
        def change(told):
            told["labels"], told["fragments"] = "labels.mha", {"distal": told["fragments"]["distal"]}
            del told["fragments"]["distal"]["seeds"]
            told["fragments"]["distal"]["label"] = 1

        case = copy_case(self.given["CASE"], self.folder / "labelled", change)
        labels_of(self.bone() / "bone" / "distal.mha", case / "labels.mha")
        out = self.run_section("A segmentation of TotalSegmentator or 3D Slicer", CASE=case)
        self.expect_pose(out / "pose" / "distal.yaml", 2)

    def test_a_label_map(self):
        labels = labels_of(self.bone() / "bone" / "distal.mha", self.folder / "labels.mha")
        only = copy_case(self.given["CASE"], self.folder / "distal", lambda told: told["fragments"].pop("proximal"))
        out = self.run_section("A label map", CASE=only, LABELS=labels)
        self.expect_pose(out / "pose" / "distal.yaml", 2)

    def test_a_surface(self):
        start = self.truth.copy()
        start[:3, 3] += (2, -2, 3)
        told = {"marrow-pose": 1, "target": "world", "source": "ct", "matrix": start.tolist()}
        out = self.run_section(
            "A surface of the bone, or of an implant",
            SURFACE=self.surface(),
            START=yaml_file(self.folder / "start.yaml", told),
        )
        self.expect_pose(out / "pose.yaml", 2)

    def test_a_video(self):
        frames = {}
        for name in ("FRONTAL", "LATERAL"):
            frames[name] = self.folder / "frames" / name
            frames[name].mkdir(parents=True)
            for i in range(3):
                shutil.copy(self.given[name], frames[name] / ("%d.png" % i))
        out = self.run_section("A video", **frames)
        rows = (out / "way" / "distal.csv").read_text().splitlines()
        self.assertEqual(len(rows), 4, rows)

    def test_a_plate(self):
        v, u = np.mgrid[0:320, 0:320]
        bent = [at - 159.5 for at in (u, v)]
        off = [at * (1 - 0.03 * (bent[0] ** 2 + bent[1] ** 2) / 160**2) for at in bent]
        grey = 9000 + 8000 * np.prod([0.5 + 0.5 * np.cos(2 * np.pi * at / 14) for at in off], axis=0) ** 2
        plate = self.folder / "plate.png"
        Image.fromarray(grey.astype("u2")).save(plate)
        out = self.run_section("Images of an intensifier that are bent", PLATE=plate)
        told = {one["name"]: one["value"] for one in json.loads((out / "report.json").read_text())["metrics"]}
        self.assertLess(told["validated"], 0.1)
        self.assertGreater(told["points"], 300)
        self.assertEqual(yaml.safe_load((out / "distortion.yaml").read_text())["width_px"], 320)

    def test_five_patients(self):
        out = self.run_section("Five patients")
        self.assertEqual(len((out / "cells.csv").read_text().splitlines()), 6)

    def test_markers(self):
        points = vertices_of(self.surface())[1].astype(float)[LANDMARKS]
        named = lambda values: {"m%d" % i: [float(x) for x in value] for i, value in enumerate(values)}
        told = {"points": named(points), "tracked": named(moved(self.truth, points))}
        markers = yaml_file(self.folder / "marks.yaml", {"marrow-landmarks": 1, "fragments": {"distal": told}})
        out = self.run_section("Landmarks or markers", SURFACE=self.surface(), MARKERS=markers)
        self.expect_pose(out / "pose" / "distal.yaml", 0.01)

    def test_a_touched_surface(self):
        header, points, rest = vertices_of(self.surface())
        scan, shift = self.folder / "scan.ply", np.array([2, -1, 1], points.dtype)
        scan.write_bytes(header.encode() + (points + shift).tobytes() + rest)
        out = self.run_section("A surface that was touched or scanned in the room", SURFACE=self.surface(), SCAN=scan)
        pose = np.array(yaml.safe_load((out / "pose.yaml").read_text())["matrix"])
        np.testing.assert_allclose(pose[:3, 3], shift, atol=0.3)

    @unittest.skipIf(public_data is None, "needs the Debian packages python3-h5py, python3-pil and python3-scipy")
    def test_deepfluoro(self):
        case = simulate(self.folder / "whole", pipeline="simulate/simulate-vertebra.yaml")
        public_data.deepfluoro_file([case], self.folder / "data.h5")
        self.run_section("A file of DeepFluoro")

    def test_a_trial(self):
        trial = real_trial(self.folder / "wrist")
        if not trial:
            self.skipTest("the data of the wrist are not on this machine")
        start = SOURCE / "pipelines/wrist/radius-0158.pose.yaml"
        out = self.run_section("A trial of Autoscoper", TRIAL=trial, START=start)
        self.assertTrue((out / "pose/bone.yaml").exists())

    def test_bones_that_overlap(self):
        # Fragments that lie beside each other, and images that show both.
        inputs = ["level=0.4", "start=exact", "isocentre_from_distal_end_mm=220"]
        inputs += ["shift_axial_mm=15", "shift_frontal_mm=36", "shift_lateral_mm=8", "--set", "cameras.height_px=1400"]
        inputs += ["--set", "case.register=[proximal, distal]", "--set", "ct.spacing_mm=[1.2, 1.2, 1.5]"]
        case = simulate(self.folder / "both", *inputs)
        out = self.run_section("Bones that overlap in the images", CASE=case)
        told = yaml.safe_load((case / "case.yaml").read_text())
        for name in ("proximal", "distal"):
            found = yaml.safe_load((out / "pose" / (name + ".yaml")).read_text())["matrix"]
            truth = told["fragments"][name]["truth"]["matrix"]
            np.testing.assert_allclose(np.array(found)[:3, :3], np.array(truth)[:3, :3], atol=0.01)

    def test_nothing(self):
        out = self.run_section("Nothing yet")
        self.assertTrue((out / "pose" / "distal.yaml").exists())


if __name__ == "__main__":
    main()
