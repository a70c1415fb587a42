#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Saving a draft as a case: the case is read back, nothing in its folder is lost, and each fault is reported."""
import json
import os
import shutil
import subprocess
import time
import unittest

import yaml

import made_cases
from bench import BenchTest
from case_page_test import octahedron
from ct_requests_test import LABELS
from harness import SOURCE, formats
from harness.cases import contents
from made_cases import CAMERA, LOWER, RADIUS, UPPER

NASTY = "<img src=x onerror=alert(1)> & 'one': {2}"
BEFORE = "the case is not saved, and what was in its folder is as before: "


class SaveTest(BenchTest):
    case = "cases/7"

    def setUp(self):
        super().setUp()
        self.place = self.folder / self.case
        made_cases.write_scan(self.folder)
        (self.folder / "front.png").write_bytes(formats.png(64, 64, [128] * 4096))
        (self.folder / "side.png").write_bytes(formats.png(64, 64, [90] * 4096))
        side = {**CAMERA, "c_arm": {**CAMERA["c_arm"], "beta_deg": 90}, "marrow-camera": 1}
        (self.folder / "side.yaml").write_text(yaml.safe_dump(side))

    def document(self, **changes):
        return {
            "ct": {"file": "scan.mha"},
            "views": [
                {"name": "frontal", "image": "front.png", "camera": CAMERA},
                {"name": "lateral", "image": "side.png", "camera": {"file": "side.yaml"}},
            ],
            "fragments": {
                "distal": {"seeds": [list(LOWER)], "register": True},
                "proximal": {"seeds": [list(UPPER)], "register": False},
            },
            "landmarks": [],
            **changes,
        }

    def save(self, document=None, revision=None):
        """The state of the job when it has ended."""
        if document:
            self.server.change(document, self.case)
        revision = revision or self.server.draft(self.case)["revision"]
        return self.server.job("/api/case/save", case=self.case, revision=revision)

    def saved(self, document=None):
        state = self.save(document)
        self.assertEqual(state["state"], "done", state["error"])
        return state["result"]

    def fault(self, document):
        state = self.save(document)
        self.assertEqual(state["state"], "failed", state["result"])
        return state["error"]

    def written(self):
        return yaml.safe_load((self.place / "case.yaml").read_text())

    def reads(self, *only):
        """Expects that `marrow run` reads the case."""
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        only = [word for name in only or ("seeds", "views", "ct") for word in ("--only", name)]
        pipeline = SOURCE / "pipelines/workbench/case.yaml"
        self.marrow("run", pipeline, "case=%s" % self.place, "--out", self.scratch / "out", *only)

    def test_a_saved_case_is_read_and_a_second_save_copies_nothing(self):
        self.enter()
        result = self.saved(self.document())
        self.assertEqual(result["copied"], ["ct.mha", "frontal.png", "lateral.png", "lateral.camera.yaml"])
        self.assertTrue(result["draft"]["is_saved"])
        self.assertEqual(result["folder"], str(self.place.resolve()))
        self.assertEqual((self.place / "ct.mha").read_bytes(), (self.folder / "scan.mha").read_bytes())
        written = self.written()
        self.assertEqual(written["ct"], "ct.mha")
        self.assertEqual(written["views"][0], {"name": "frontal", "image": "frontal.png", "camera": CAMERA})
        self.assertEqual(written["views"][1]["camera"], "lateral.camera.yaml")
        self.assertEqual(written["fragments"], self.document()["fragments"])
        self.reads()
        self.assertEqual(self.saved()["copied"], [])
        names = ["case.yaml", "ct.mha", "frontal.png", "lateral.camera.yaml", "lateral.png"]
        self.assertEqual(sorted(contents(self.place)), names)
        landmarks = self.place / "landmarks.yaml"
        mark = {"name": "tip", "model_mm": [1, 2, 3], "fragment": "distal"}
        for marks in ([mark], []):
            self.saved(self.document(landmarks=marks))
            self.assertEqual(landmarks.exists(), bool(marks), "landmarks that are removed leave the folder")

    def test_a_saved_case_opens_as_the_same_draft(self):
        self.enter()
        landmarks = [
            {"name": "tip", "fragment": "distal", "model_mm": [1.5, 2, 3], "pixels": {"frontal": [10.25, 20]}},
            {"name": "edge", "fragment": "distal", "model_mm": [4, 5, 6]},
        ]
        document = self.document(landmarks=landmarks)
        document["fragments"]["distal"]["start"] = [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]
        document["ct"] = {"file": "scan.mha", "voxel_size_mm": [1, 1, 1], "value_offset_hu": -1}
        saved = self.saved(document)["draft"]["document"]
        self.reads("landmarks")
        shutil.copytree(self.place, self.folder / "cases" / "8")
        copy = self.server.draft("cases/8")["document"]
        for key in ("ct", "views"):
            self.assertEqual(json.loads(json.dumps(copy[key]).replace("cases/8", "cases/7")), saved[key])
        self.assertEqual(copy["fragments"], saved["fragments"])
        by_name = lambda marks: sorted(marks, key=lambda mark: mark["name"])
        self.assertEqual(by_name(copy["landmarks"]), by_name(landmarks))

    def test_each_fault_is_said_and_nothing_is_written(self):
        values = made_cases.balls(LABELS, (2, LOWER, RADIUS), (5, UPPER, RADIUS))
        for name, origin_mm in (("bones", LABELS["origin_mm"]), ("far", (500.0, 0.0, 0.0))):
            labels = made_cases.seg_nrrd({**LABELS, "origin_mm": origin_mm}, values, (("tibia", 2), ("fibula", 5)))
            (self.folder / (name + ".seg.nrrd")).write_bytes(labels)
        (self.folder / "bone.stl").write_text(octahedron((2000, 0, 0), 10))
        self.enter()
        without_camera = {"views": [{"name": "frontal", "image": "gone.png"}, self.document()["views"][1]]}
        seeds = lambda *seeds: {"fragments": {"distal": {"seeds": [*seeds], "register": True}}}
        both = {name: {**one, "register": True} for name, one in self.document()["fragments"].items()}
        none = {name: {**one, "register": False} for name, one in both.items()}
        tip = {"name": "tip", "model_mm": [1, 2, 3]}
        for change, fault in (
            (
                {"ct": None, "views": [], "fragments": {}},
                "the CT is missing; choose one\n  there is no X-ray view; add at least one\n"
                "  there is no fragment; add one, with its seeds, its label or its surface",
            ),
            (
                {**without_camera, **seeds()},
                "view 'frontal', its image: there is no 'gone.png' any more\n  view 'frontal' has no camera\n"
                "  fragment 'distal' has no seed; click inside its bone, or give it a label or a surface",
            ),
            (seeds([200, 15, 10]), BEFORE + "fragment 'distal': a seed lies outside the CT; move it into the bone"),
            (
                {"labels": "far.seg.nrrd", "fragments": {"a": {"label": "tibia"}}},
                BEFORE + "fragment 'a': its label lies outside the CT; were both made from the same scan?",
            ),
            (
                {"fragments": {"a": {"surface": {"file": "bone.stl"}}}},
                BEFORE + "fragment 'a': its surface lies outside the CT; is it in cm, in another frame (RAS), or of "
                "another scan?",
            ),
            (
                {"fragments": {"a": {"label": "tibia"}, "b": {"surface": {"file": "gone.stl"}}}},
                "fragment 'a' has a label, but there is no label map; choose one\n  "
                "fragment 'b', its surface: there is no 'gone.stl' any more",
            ),
        ):
            self.assertEqual(self.fault(self.document(**change)), fault)
        for change, part in (
            ({"labels": "bones.seg.nrrd", "fragments": {"a": {"label": "femur"}}}, "has no segment 'femur'"),
            ({"fragments": none}, "every fragment has register: false; register at least one"),
            (
                {"landmarks": [tip], "fragments": both},
                "landmark 'tip': several fragments are registered; choose the one that it belongs to",
            ),
            ({"ct": {"file": "../scan.mha"}}, "leads out of the folder"),
        ):
            self.assertIn(part, self.fault(self.document(**change)))
        self.assertFalse(self.place.exists())

    def test_a_case_that_is_there_stays_as_it_is_if_the_new_one_is_no_good(self):
        self.enter()
        self.saved(self.document())
        (self.place / "notes.txt").write_text("mine")
        before = contents(self.place)
        document = self.document()
        document["views"][0]["camera"] = {"width_px": 64, "height_px": 64}
        self.assertIn("the case is not saved", self.fault(document))
        self.assertEqual(contents(self.place), before)
        old = self.server.change(self.document(), self.case)
        self.server.change(self.document(), self.case)
        told = "this case was changed in another tab; look at it and save again"
        self.assertEqual(self.save(revision=old)["error"], told)

    def test_no_file_is_overwritten_and_what_a_crash_left_behind_goes(self):
        """What another program is saving there stays."""
        ended = subprocess.Popen(["true"])
        ended.wait()
        for process in (ended.pid, os.getpid()):
            (self.place / (".saving-%d-1" % process)).mkdir(parents=True)
        (self.place / "ct.mha").write_bytes(b"somebody's")
        (self.place / "frontal.png").write_bytes((self.folder / "front.png").read_bytes())
        self.enter()
        result = self.saved(self.document())
        self.assertEqual((self.place / "ct.mha").read_bytes(), b"somebody's")
        self.assertEqual(result["copied"], ["ct-2.mha", "lateral.png", "lateral.camera.yaml"])
        self.reads()
        self.assertEqual([file.name for file in self.place.glob(".saving*")], [".saving-%d-1" % os.getpid()])

    def test_names_with_markup_and_quotes(self):
        document = self.document()
        document["fragments"] = {NASTY: {"seeds": [list(LOWER)], "register": True}}
        document["views"][0]["name"] = NASTY
        document["landmarks"] = [{"name": NASTY, "model_mm": [1, 2, 3], "pixels": {NASTY: [3, 4]}}]
        self.enter()
        self.saved(document)
        self.assertEqual(list(self.written()["fragments"]), [NASTY])
        marks = yaml.safe_load((self.place / "landmarks.yaml").read_text())["fragments"][NASTY]
        self.assertEqual(marks, {"points": {NASTY: [1, 2, 3]}, "seen": {NASTY: {NASTY: [3, 4]}}})
        self.reads("landmarks", "views")

    def test_when_it_is_killed_the_old_case_or_the_new_one_is_there(self):
        self.enter()
        self.saved(self.document())
        old = self.written()
        for delay_s in (0, 0.01, 0.03, 0.06, 0.1, 0.2, 0.4):
            document = self.document(landmarks=[{"name": "tip", "model_mm": [1, 2, delay_s], "fragment": "distal"}])
            document["fragments"]["distal"]["seeds"] = [[*LOWER[:2], LOWER[2] + delay_s]]
            revision = self.server.change(document, self.case)
            self.server.post("/api/case/save", case=self.case, revision=revision)
            time.sleep(delay_s)
            self.server.process.kill()
            self.server.process.wait()
            now = self.written()
            seeds = now["fragments"]["distal"]["seeds"]
            self.assertTrue(now == old or seeds == document["fragments"]["distal"]["seeds"])
            old = now
            self.reads("seeds", "ct")
            self.enter()
        self.saved(self.document())
        self.assertEqual(list(self.place.glob(".saving*")), [])

    @unittest.skipUnless(os.geteuid() == 0, "only root can mount a small disk")
    def test_a_full_disk_loses_nothing(self):
        small = self.scratch / "small"
        small.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", small]).returncode != 0:
            self.skipTest("no disk can be mounted here")
        self.addCleanup(subprocess.run, ["umount", "-l", small])
        shutil.copytree(self.folder, small, dirs_exist_ok=True)
        (small / "7").mkdir()
        (small / "7" / "case.yaml").write_text("marrow-case: 1\nct: a.mha\nviews: []\nfragments: {}\n")
        before, self.case = contents(small / "7"), "7"
        self.enter(folder=small)
        self.server.change(self.document(), self.case)
        full = small / "full"
        free = os.statvfs(small).f_bavail * os.statvfs(small).f_bsize
        full.write_bytes(b"x" * (free - 40_000))
        self.assertEqual(self.save()["error"], BEFORE + "No space left on device; make room and try again")
        self.assertEqual(contents(small / "7"), before)
        full.unlink()

    def test_comments_stay_where_nothing_changed(self):
        self.enter()
        self.saved(self.document())
        file = self.place / "case.yaml"
        lines = file.read_text().splitlines()
        at = next(i for i, line in enumerate(lines) if "distal" in line)
        lines[at] += "   # the long one"
        mine = "# Patient 7\n" + "\n".join(lines) + "\n# the end\n"
        file.write_text(mine)
        lost = lambda: self.server.get("/api/case/lost-comments?case=cases/7")
        self.assertEqual(lost(), {"lost": []})
        self.saved()
        self.assertEqual(file.read_text(), mine, "nothing changed")
        document = self.server.draft(self.case)["document"]
        document["fragments"]["distal"]["seeds"].append([21, 15, 10])
        self.saved(document)
        for comment in ("# Patient 7\n", "   # the long one\n", "\n# the end\n"):
            self.assertIn(comment, file.read_text())
        self.assertEqual(self.written()["fragments"]["distal"]["seeds"], [list(LOWER), [21, 15, 10]])
        del document["fragments"]["distal"]
        self.server.change(document, self.case)
        self.assertEqual(lost(), {"lost": ["# the long one"]})


if __name__ == "__main__":
    unittest.main(verbosity=2)
