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

import ct_cases
from bench import MARROW, SOURCE, BenchTest
from harness import formats

SIZE = (40, 30, 40)
NASTY = "<img src=x onerror=alert(1)> & 'one': {2}"


class SaveTest(BenchTest):
    def setUp(self):
        super().setUp()
        values = ct_cases.two_balls(SIZE, (20, 15, 10), (20, 15, 30), 7)
        (self.folder / "scan.mha").write_bytes(formats.mha(formats.straight(SIZE), values))
        (self.folder / "front.png").write_bytes(formats.png(64, 64, [128] * 4096))
        (self.folder / "side.png").write_bytes(formats.png(64, 64, [90] * 4096))
        side = {**ct_cases.CAMERA, "c_arm": {**ct_cases.CAMERA["c_arm"], "beta_deg": 90}, "marrow-camera": 1}
        (self.folder / "side.yaml").write_text(yaml.safe_dump(side))

    def document(self, **changes):
        return {
            "ct": {"file": "scan.mha"},
            "views": [
                {"name": "frontal", "image": "front.png", "camera": ct_cases.CAMERA},
                {"name": "lateral", "image": "side.png", "camera": {"file": "side.yaml"}},
            ],
            "fragments": {
                "distal": {"seeds": [[20, 15, 10]], "register": True},
                "proximal": {"seeds": [[20, 15, 30]], "register": False},
            },
            "landmarks": [],
            **changes,
        }

    def enter(self, folder=None):
        server = self.open(folder=folder)
        server.enter()
        return server

    def change(self, server, document, case="cases/7"):
        revision = server.json("GET", "/api/draft?case=" + case)["revision"]
        asked = {"case": case, "revision": revision, "what": "test", "document": document}
        return server.json("POST", "/api/draft/change", asked)["revision"]

    def save(self, server, document=None, case="cases/7"):
        """The state of the job when it has ended."""
        if document:
            self.change(server, document, case)
        revision = server.json("GET", "/api/draft?case=" + case)["revision"]
        return server.finish(server.json("POST", "/api/case/save", {"case": case, "revision": revision})["job"])

    def assert_refused(self, state, fault):
        self.assertEqual(state["state"], "failed", state["result"])
        self.assertIn(fault, state["error"])

    def reads(self, case, *only):
        """Expects that `marrow run` reads the case."""
        arguments = ["run", SOURCE / "pipelines/workbench/case.yaml", "case=%s" % case, "--out", self.scratch / "out"]
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        for name in only or ("seeds", "views", "ct"):
            arguments += ["--only", name]
        environment = {**os.environ, "MARROW_CACHE": str(self.scratch / "store")}
        ended = subprocess.run([MARROW, *arguments], capture_output=True, text=True, env=environment, timeout=600)
        self.assertEqual(ended.returncode, 0, ended.stderr)

    def test_a_saved_case_is_read_and_a_second_save_copies_nothing(self):
        server = self.enter()
        state = self.save(server, self.document())
        self.assertEqual(state["state"], "done", state["error"])
        result = state["result"]
        self.assertEqual(result["copied"], ["ct.mha", "frontal.png", "lateral.png", "lateral.camera.yaml"])
        self.assertTrue(result["draft"]["is_saved"])
        case = self.folder / "cases" / "7"
        self.assertEqual(result["folder"], str(case.resolve()))
        self.assertEqual((case / "ct.mha").read_bytes(), (self.folder / "scan.mha").read_bytes())
        written = yaml.safe_load((case / "case.yaml").read_text())
        self.assertEqual(written["ct"], "ct.mha")
        self.assertEqual(written["views"][0], {"name": "frontal", "image": "frontal.png", "camera": ct_cases.CAMERA})
        self.assertEqual(written["views"][1]["camera"], "lateral.camera.yaml")
        self.assertEqual(written["fragments"], self.document()["fragments"])
        self.reads(case)
        again = self.save(server)
        self.assertEqual((again["state"], again["result"]["copied"]), ("done", []))
        names = sorted(file.name for file in case.iterdir())
        self.assertEqual(names, ["case.yaml", "ct.mha", "frontal.png", "lateral.camera.yaml", "lateral.png"])

    def test_a_saved_case_opens_as_the_same_draft(self):
        server = self.enter()
        landmarks = [
            {"name": "tip", "fragment": "distal", "model_mm": [1.5, 2, 3], "pixels": {"frontal": [10.25, 20]}},
            {"name": "edge", "fragment": "distal", "model_mm": [4, 5, 6]},
        ]
        start = [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]
        document = self.document(landmarks=landmarks)
        document["fragments"]["distal"]["start"] = start
        document["ct"] = {"file": "scan.mha", "voxel_size_mm": [1, 1, 1], "value_offset_hu": -1}
        state = self.save(server, document)
        self.assertEqual(state["state"], "done", state["error"])
        saved = state["result"]["draft"]["document"]
        self.reads(self.folder / "cases" / "7", "landmarks")
        (self.folder / "cases" / "8").mkdir()
        for file in (self.folder / "cases" / "7").iterdir():
            (self.folder / "cases" / "8" / file.name).write_bytes(file.read_bytes())
        copy = server.json("GET", "/api/draft?case=cases/8")["document"]
        for key in ("ct", "views"):
            self.assertEqual(json.loads(json.dumps(copy[key]).replace("cases/8", "cases/7")), saved[key])
        self.assertEqual(copy["fragments"], saved["fragments"])
        by_name = lambda marks: sorted(marks, key=lambda mark: mark["name"])
        self.assertEqual(by_name(copy["landmarks"]), by_name(landmarks))

    def test_each_fault_is_said_and_nothing_is_written(self):
        server = self.enter()
        state = self.save(server, {"ct": None, "views": [], "fragments": {}, "landmarks": []})
        self.assertEqual(
            state["error"],
            "the CT is missing; choose one\n  there is no X-ray view; add at least one\n"
            "  there is no fragment; add one, with its seeds, its label or its surface",
        )
        document = self.document()
        document["views"][0] = {"name": "frontal", "image": "gone.png"}
        document["fragments"]["distal"]["seeds"] = []
        self.assertEqual(
            self.save(server, document)["error"],
            "view 'frontal', its image: there is no 'gone.png' any more\n  view 'frontal' has no camera\n"
            "  fragment 'distal' has no seed; click inside its bone, or give it a label or a surface",
        )
        document = self.document()
        document["fragments"]["distal"]["seeds"] = [[200, 15, 10]]
        before = "the case is not saved, and what was in its folder is as before: "
        outside = "fragment 'distal': a seed lies outside the CT; move it into the bone"
        self.assertEqual(self.save(server, document)["error"], before + outside)
        document = self.document()
        document["fragments"]["distal"]["register"] = False
        self.assert_refused(self.save(server, document), "every fragment has register: false; register at least one")
        document = self.document(landmarks=[{"name": "tip", "model_mm": [1, 2, 3]}])
        document["fragments"]["proximal"]["register"] = True
        self.assert_refused(
            self.save(server, document),
            "landmark 'tip': several fragments are registered; choose the one that it belongs to",
        )
        self.assert_refused(self.save(server, self.document(ct={"file": "../scan.mha"})), "leads out of the folder")
        self.assertFalse((self.folder / "cases" / "7").exists())

    def test_a_case_that_is_there_stays_as_it_is_if_the_new_one_is_no_good(self):
        server = self.enter()
        self.assertEqual(self.save(server, self.document())["state"], "done")
        case = self.folder / "cases" / "7"
        (case / "notes.txt").write_text("mine")
        before = {file.name: file.read_bytes() for file in case.iterdir()}
        document = self.document()
        document["views"][0]["camera"] = {"width_px": 64, "height_px": 64}
        self.assert_refused(self.save(server, document), "the case is not saved")
        self.assertEqual({file.name: file.read_bytes() for file in case.iterdir()}, before)

    def test_no_file_is_overwritten_by_a_copy(self):
        case = self.folder / "cases" / "7"
        case.mkdir(parents=True)
        (case / "ct.mha").write_bytes(b"somebody's")
        (case / "frontal.png").write_bytes((self.folder / "front.png").read_bytes())
        result = self.save(self.enter(), self.document())["result"]
        self.assertEqual((case / "ct.mha").read_bytes(), b"somebody's")
        self.assertEqual(result["copied"], ["ct-2.mha", "lateral.png", "lateral.camera.yaml"])
        self.reads(case)

    def test_names_with_markup_and_quotes(self):
        document = self.document()
        document["fragments"] = {NASTY: {"seeds": [[20, 15, 10]], "register": True}}
        document["views"][0]["name"] = NASTY
        document["landmarks"] = [{"name": NASTY, "model_mm": [1, 2, 3], "pixels": {NASTY: [3, 4]}}]
        state = self.save(self.enter(), document)
        self.assertEqual(state["state"], "done", state["error"])
        case = self.folder / "cases" / "7"
        self.assertEqual(list(yaml.safe_load((case / "case.yaml").read_text())["fragments"]), [NASTY])
        marks = yaml.safe_load((case / "landmarks.yaml").read_text())["fragments"][NASTY]
        self.assertEqual(marks, {"points": {NASTY: [1, 2, 3]}, "seen": {NASTY: {NASTY: [3, 4]}}})
        self.reads(case, "landmarks", "views")

    def test_landmarks_that_are_removed_leave_the_folder(self):
        server = self.enter()
        marks = [{"name": "tip", "model_mm": [1, 2, 3], "fragment": "distal"}]
        self.assertEqual(self.save(server, self.document(landmarks=marks))["state"], "done")
        file = self.folder / "cases" / "7" / "landmarks.yaml"
        self.assertTrue(file.exists())
        self.assertEqual(self.save(server, self.document())["state"], "done")
        self.assertFalse(file.exists())

    def test_what_a_crash_left_behind_goes_and_another_programs_folder_stays(self):
        ended = subprocess.Popen(["true"])
        ended.wait()
        case = self.folder / "cases" / "7"
        for process in (ended.pid, os.getpid()):
            (case / (".saving-%d-1" % process)).mkdir(parents=True)
        self.assertEqual(self.save(self.enter(), self.document())["state"], "done")
        self.assertEqual([file.name for file in case.glob(".saving*")], [".saving-%d-1" % os.getpid()])

    def test_a_case_that_was_changed_in_another_tab_is_not_saved(self):
        server = self.enter()
        old = self.change(server, self.document())
        self.change(server, self.document())
        state = server.finish(server.json("POST", "/api/case/save", {"case": "cases/7", "revision": old})["job"])
        self.assertEqual(state["error"], "this case was changed in another tab; look at it and save again")

    def test_when_it_is_killed_the_old_case_or_the_new_one_is_there(self):
        server = self.enter()
        self.assertEqual(self.save(server, self.document())["state"], "done")
        case = self.folder / "cases" / "7"
        old = (case / "case.yaml").read_bytes()
        for delay_s in (0, 0.01, 0.03, 0.06, 0.1, 0.2, 0.4):
            document = self.document(landmarks=[{"name": "tip", "model_mm": [1, 2, delay_s], "fragment": "distal"}])
            document["fragments"]["distal"]["seeds"] = [[20, 15, 10 + delay_s]]
            revision = self.change(server, document)
            server.json("POST", "/api/case/save", {"case": "cases/7", "revision": revision})
            time.sleep(delay_s)
            server.process.kill()
            server.process.wait()
            now = (case / "case.yaml").read_bytes()
            seeds = yaml.safe_load(now)["fragments"]["distal"]["seeds"]
            self.assertTrue(now == old or seeds == [[20, 15, 10 + delay_s]])
            old = now
            self.reads(case, "seeds", "ct")
            server = self.enter()
        self.assertEqual(self.save(server, self.document())["state"], "done")
        self.assertEqual(list(case.glob(".saving*")), [])

    @unittest.skipUnless(os.geteuid() == 0, "only root can mount a small disk")
    def test_a_full_disk_loses_nothing(self):
        small = self.scratch / "small"
        small.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", small]).returncode != 0:
            self.skipTest("no disk can be mounted here")
        self.addCleanup(subprocess.run, ["umount", "-l", small])
        for file in self.folder.iterdir():
            (small / file.name).write_bytes(file.read_bytes())
        server = self.enter(folder=small)
        (small / "7").mkdir()
        (small / "7" / "case.yaml").write_text("marrow-case: 1\nct: a.mha\nviews: []\nfragments: {}\n")
        before = (small / "7" / "case.yaml").read_bytes()
        full = small / "full"
        self.change(server, self.document(), "7")
        free = os.statvfs(small).f_bavail * os.statvfs(small).f_bsize
        full.write_bytes(b"x" * (free - 40_000))
        state = self.save(server, case="7")
        self.assertEqual(
            state["error"],
            "the case is not saved, and what was in its folder is as before: No space left on device; make room and "
            "try again",
        )
        self.assertEqual([file.name for file in (small / "7").iterdir()], ["case.yaml"])
        self.assertEqual((small / "7" / "case.yaml").read_bytes(), before)
        full.unlink()

    def test_comments_stay_where_nothing_changed(self):
        server = self.enter()
        self.assertEqual(self.save(server, self.document())["state"], "done")
        file = self.folder / "cases" / "7" / "case.yaml"
        lines = file.read_text().splitlines()
        at = next(i for i, line in enumerate(lines) if "distal" in line)
        lines[at] += "   # the long one"
        mine = "# Patient 7\n" + "\n".join(lines) + "\n# the end\n"
        file.write_text(mine)
        self.assertEqual(server.json("GET", "/api/case/lost-comments?case=cases/7"), {"lost": []})
        self.assertEqual(self.save(server)["state"], "done")
        self.assertEqual(file.read_text(), mine, "nothing changed")
        document = server.json("GET", "/api/draft?case=cases/7")["document"]
        document["fragments"]["distal"]["seeds"].append([21, 15, 10])
        self.assertEqual(self.save(server, document)["state"], "done")
        text = file.read_text()
        for comment in ("# Patient 7\n", "   # the long one\n", "\n# the end\n"):
            self.assertIn(comment, text)
        self.assertEqual(yaml.safe_load(text)["fragments"]["distal"]["seeds"], [[20, 15, 10], [21, 15, 10]])
        del document["fragments"]["distal"]
        self.change(server, document)
        self.assertEqual(server.json("GET", "/api/case/lost-comments?case=cases/7"), {"lost": ["# the long one"]})


if __name__ == "__main__":
    unittest.main(verbosity=2)
