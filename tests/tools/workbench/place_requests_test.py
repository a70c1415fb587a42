#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The requests of the page "Place": overlays, costs, registrations and verdicts; frames and keyframes of sequences, and
tracking as on the command line."""
import concurrent.futures
import copy
import math
import shlex
import shutil
import urllib.parse

import numpy
import yaml

import made_cases
from bench import BenchTest
from harness import SOURCE, formats
from harness.page import main
from made_cases import FRAMES, NONE, VIEWS, at, femur, line, moving, seen, shifted, truth

BYTES = 2 * 256 * 256  # of a frame: 16 bits for each pixel


class PlaceRequests(BenchTest):
    def opened(self):
        return self.server.done("/api/place/open", case="case")

    def pose_of(self, folder, bone):
        return yaml.safe_load((folder / (bone + ".yaml")).read_text())["matrix"]


class PlaceTest(PlaceRequests):
    def setUp(self):
        super().setUp()
        case, pose = femur()
        self.truth = copy.deepcopy(pose)
        shutil.copytree(case, self.folder / "case")
        self.enter()

    def asked(self, **changes):
        return {"case": "case", "view": "frontal", "what": "radiograph", "step_px": 1, **changes}

    def overlay(self, pose, **changes):
        about, content = self.server.bytes("/api/place/overlay", self.asked(poses={"distal": pose}, **changes))
        return about["layers"][0], content

    def test_a_bone_is_drawn_where_it_is(self):
        about = self.opened()
        self.assertEqual([bone["name"] for bone in about["bones"]], ["distal"])
        self.assertEqual(about["bones"][0]["start_is"], "CT coordinates taken as world coordinates")
        camera = about["views"][0]["camera"]

        def middle(pose, step_px=1, what="radiograph"):
            layer, content = self.overlay(pose, step_px=step_px, what=what)
            weights = numpy.frombuffer(content, "u1").reshape(layer["rows"], layer["columns"]).sum(0, float)
            u = (weights * numpy.arange(layer["columns"])).sum() / weights.sum()
            return layer["u_px"] + layer["step_px"] * u

        pose, moved = self.truth, shifted(self.truth, 10)
        point = at(pose, about["bones"][0]["middle_mm"])
        expected = seen(camera, [point[0] + 10, *point[1:]])[0] - seen(camera, point)[0]
        for step_px in (1, 2, 3):
            self.assertAlmostEqual(middle(moved, step_px) - middle(pose, step_px), expected, delta=2)
        self.assertAlmostEqual(middle(pose, 1), middle(pose, 4), delta=0.5)
        self.assertAlmostEqual(middle(pose, 1, "edges"), middle(pose, 1), delta=20)
        layer, content = self.overlay(shifted(pose, 5000))
        self.assertEqual((content, layer["columns"]), (b"", 0))
        cost = lambda pose: self.server.post("/api/place/costs", case="case", poses={"distal": pose})["distal"]
        best, other = cost(pose), cost(about["bones"][0]["start"])
        for measure in ("contour", "grey_values"):
            self.assertLess(best[measure]["value"], other[measure]["value"], "the true pose costs least")
            self.assertEqual(sorted(best[measure]["views"]), ["frontal", "lateral"])

    def test_a_bone_given_by_a_label(self):
        file = self.folder / "case" / "case.yaml"
        case = yaml.safe_load(file.read_text())
        middle = case["fragments"]["distal"]["seeds"][0]
        grid = formats.straight((20, 20, 40), (2, 2, 2), [value - size for value, size in zip(middle, (19, 19, 39))])
        labels = formats.mha(grid, made_cases.balls(grid, (7, middle, 15)))
        (self.folder / "case" / "labels.mha").write_bytes(labels)
        case.update(labels="labels.mha", fragments={"distal": {"label": 7}})
        file.write_text(yaml.safe_dump(case))
        (bone,) = self.opened()["bones"]
        self.assertEqual(bone["name"], "distal")
        self.assertLess(math.dist(bone["middle_mm"], middle), 1)
        del case["ct"]
        file.write_text(yaml.safe_dump(case))
        self.assertEqual(
            self.server.job("/api/place/open", case="case")["error"],
            "this case has no CT, and this page shows bones by their radiographs; add the CT to the case",
        )

    def test_what_is_wrong_is_said(self):
        fault = self.server.fault("/api/place/overlay", self.asked(poses={}), 409)
        self.assertEqual(fault, "the case 'case' is no longer in memory; open it again")
        self.opened()
        pose = self.truth
        for changes, fault in (
            ({"poses": {"distal": [[1]]}}, "a pose must be 4 rows of 4 numbers"),
            ({"poses": {"tibia": pose}}, "the case has no bone 'tibia' that is registered"),
            ({"poses": {}, "view": "oblique"}, "the case has no view 'oblique'"),
            ({"poses": {}, "step_px": 0}, "'step_px' must be a whole number from 1 to 16"),
            ({"poses": {}, "step_px": 1.5}, "'step_px' must be a whole number from 1 to 16"),
            ({"poses": []}, "the request lacks 'poses', an object"),
            ({"poses": {"distal": pose}, "what": "x"}, "'what' must be radiograph, edges or outline, got 'x'"),
        ):
            self.assertEqual(self.server.fault("/api/place/overlay", self.asked(**changes)), fault)
        skewed = {"distal": [[2, 0, 0, 0], *pose[1:]]}
        self.assertIn("the pose", self.server.fault("/api/place/overlay", self.asked(poses=skewed)))
        for pipeline in ("nowhere.yaml", "/etc/passwd"):
            asked = {"case": "case", "pipeline": pipeline, "poses": {"distal": pose}}
            told = "this pipeline cannot start from a placement; choose one of the list"
            self.assertEqual(self.server.fault("/api/place/register", asked), told)
        outside = self.server.fault("/api/place/open", {"case": "../.."})
        self.assertIn(" leads out of the folder that is open, ", outside)
        state = self.server.job("/api/place/open", case="nothing")
        self.assertEqual(state["state"], "failed")
        self.assertIn("there is no such folder", state["error"])

    def test_from_here_and_the_command_line_find_the_same(self):
        pipeline = self.opened()["pipelines"][0]["file"]
        asked = {"case": "case", "pipeline": pipeline, "poses": {"distal": shifted(self.truth, 1.5)}}
        begun = self.server.post("/api/place/register", **asked)
        state = self.server.finish(begun["job"])
        self.assertEqual((state["state"], state["error"]), ("done", ""))
        found = state["result"]["poses"]["distal"]
        self.assertLess(max(abs(found["matrix"][i][3] - self.truth[i][3]) for i in range(3)), 0.2)
        self.assertLess(found["deviations"]["long"]["rotation_deg"], 1)
        self.assertEqual(state["result"]["verdicts"]["distal"]["judgement"], "trusted")
        again = self.server.post("/api/place/register", **asked)
        self.assertEqual(again["command"], begun["command"], "the same poses are not written twice")
        self.server.finish(again["job"])
        words = shlex.split(begun["command"])
        self.assertEqual(words[:2], ["marrow", "run"])
        self.marrow(*words[1:], "--out", self.scratch / "run", store="another-store")
        self.assertEqual(self.pose_of(self.scratch / "run" / "outputs" / "pose", "distal"), found["matrix"])

    def test_poses_of_requests_at_the_same_time_do_not_mix(self):
        self.opened()

        def written(shift_mm):
            """What the folder holds that is named in the answer."""
            pose = copy.deepcopy(self.truth)
            pose[0][3] = shift_mm
            begun = self.server.post("/api/place/verdict", case="case", poses={"distal": pose})
            self.server.post("/api/job/stop", job=begun["job"])
            self.server.finish(begun["job"])
            folder = shlex.split(begun["command"])[-1].rpartition("=")[2]
            return self.pose_of(self.folder / folder, "distal")[0][3]

        with concurrent.futures.ThreadPoolExecutor(6) as pool:
            for i in range(50):
                shifts_mm = list(range(6 * i, 6 * i + 6))
                self.assertEqual(list(pool.map(written, shifts_mm)), shifts_mm)

    def test_a_registration_can_be_stopped(self):
        asked = {"case": "case", "pipeline": self.opened()["pipelines"][0]["file"]}
        for i in range(5):  # on a busy machine the stop may come too late
            job = self.server.post("/api/place/register", **asked, poses={"distal": shifted(self.truth, i / 2)})["job"]
            self.server.post("/api/job/stop", job=job)
            state = self.server.finish(job)["state"]
            if state == "stopped":
                break
        self.assertEqual(state, "stopped")


class SequenceTest(PlaceRequests):
    def setUp(self):
        super().setUp()
        shutil.copytree(moving()[0] / "case", self.folder / "case")
        shutil.copytree(moving()[0] / "views", self.folder / "film")
        self.enter()
        self.opened()

    def sequence(self, views):
        return self.server.job("/api/place/sequence", case="case", views=views)

    def frames(self, **changes):
        asked = {"case": "case", "view": "frontal", **VIEWS["frontal"], "first": 2, "last": 3, "step_px": 1, **changes}
        return "/api/place/frames?" + urllib.parse.urlencode(asked)

    def test_frames_are_read_where_they_are(self):
        self.assertEqual(self.sequence(VIEWS)["result"], {"frames": FRAMES})
        about, content = self.server.bytes(self.frames())
        self.assertEqual(about, {"bytes": BYTES, "frames": 2})
        self.assertEqual(len(content), 2 * BYTES)
        second = self.server.bytes(self.frames(first=3))[1]
        self.assertEqual(content[BYTES:], second)
        self.assertNotEqual(content[:BYTES], second)
        self.assertEqual(len(self.server.bytes(self.frames(first=3, step_px=2))[1]), BYTES // 4)

    def test_a_file_with_several_frames_and_a_camera_in_case_yaml(self):
        pages = [64 * frame * [60000] + (256 - 64 * frame) * [1000 * frame] for frame in (1, 2, 3)]
        (self.folder / "film.tif").write_bytes(formats.tiff(256, 256, [256 * row for row in pages]))
        file = self.folder / "case" / "case.yaml"
        arm = "source_to_detector_mm: 1000, source_to_isocentre_mm: 600, pixel_mm: 1.1, alpha_deg: 0, beta_deg: 0"
        camera = "{marrow-camera: 1, width_px: 256, height_px: 256, c_arm: {%s}}" % arm
        text = file.read_text()
        self.assertEqual(text.count("frontal.camera.yaml"), 1)
        file.write_text(text.replace("frontal.camera.yaml", camera))
        self.opened()
        film = {"images": "film.tif", "pattern": ""}
        state = self.sequence({"frontal": film, "lateral": film})
        self.assertEqual((state["error"], state["result"]), ("", {"frames": 3}))
        content = self.server.bytes(self.frames(**film))[1]
        for i in (0, 1):
            self.assertEqual(numpy.frombuffer(content[BYTES * i :][:512], "<u2").tolist(), pages[i + 1])
        told = "a pattern chooses files of a folder, but this is not a folder; leave it out"
        self.assertIn(told, self.sequence({"frontal": {**film, "pattern": "*.tif"}, "lateral": film})["error"])

    def test_what_is_wrong_is_said(self):
        asked = {"case": "case", "views": {"frontal": VIEWS["frontal"]}}
        self.assertEqual(
            self.server.fault("/api/place/sequence", asked),
            "view 'lateral': say where its frames are: a folder of images, or a file with several frames",
        )
        (self.folder / "film" / "0006" / "lateral" / "image.png").unlink()
        self.assertEqual(
            self.sequence(VIEWS)["error"],
            "view 'lateral' has 5 frames, but view 'frontal' has 6; all views must show the same moments",
        )
        wrong = {**VIEWS, "frontal": {"images": "film", "pattern": "*.png"}}
        self.assertIn("no file in it fits the pattern '*.png'", self.sequence(wrong)["error"])
        asked["views"] = {**VIEWS, "frontal": {"images": "../..", "pattern": ""}}
        outside = self.server.fault("/api/place/sequence", asked)
        self.assertIn(" leads out of the folder that is open, ", outside)
        too_many = self.server.fault(self.frames(last=99))
        self.assertEqual(too_many, "'last' must be a whole number from 2 to 33, got '99'")
        for change, fault in (
            ({"frame_rate_hz": 0}, "the frame rate must be a number above 0"),
            ({"frames": 0}, "'frames' must be a whole number from 1 to 1000000"),
            (
                {"keyframes": {"bone": {"7": truth(1)}}},
                "a keyframe of 'bone' is in frame '7', but the sequence has frames 1 to 6; remove it",
            ),
            ({"keyframes": {"tibia": {"1": truth(1)}}}, "the case has no bone 'tibia' that is registered"),
            ({"keyframes": {"bone": {"1": [[1]]}}}, "a pose must be 4 rows of 4 numbers"),
            ({"starts": {}}, "the request lacks the pose of 'bone'"),
        ):
            self.assertEqual(self.server.fault("/api/place/track", self.wish(**change)), fault)
        gone = self.server.fault("/api/place/tracked?case=case&folder=nowhere")
        self.assertEqual(gone, "'nowhere': the tracked poses are gone; track the bones again")

    def wish(self, **changes):
        """The request of the page that tracks the bone."""
        asked = {"case": "case", "views": VIEWS, "frame_rate_hz": 60, "frames": FRAMES}
        return {**asked, "starts": {"bone": truth(1)}, "keyframes": {}, **changes}

    def tracked(self, **changes):
        """(the command, the result)"""
        begun = self.server.post("/api/place/track", **self.wish(**changes))
        state = self.server.finish(begun["job"])
        self.assertEqual(state["error"], "")
        return begun["command"], state["result"]

    def far_off(self, result):
        return [
            frame
            for frame, pose in enumerate(result["poses"]["bone"], 1)
            if not pose or math.dist(at(pose, [0, 0, 160]), at(truth(frame), [0, 0, 160])) > 1
        ]

    def is_the_same(self, *words):
        """That the command line tracks what the page tracked."""
        self.marrow(*words, "--out", self.scratch / "run", store="another-store")
        written = (self.scratch / "run" / "outputs" / "tra" / "bone.tra").read_bytes()
        self.assertEqual(written, (self.folder / "placed/case/1/tracked/bone.tra").read_bytes())

    def test_the_command_line_tracks_the_same(self):
        keyframes = {"1": truth(1), "4": shifted(truth(4), 1)}
        command, found = self.tracked(keyframes={"bone": keyframes})
        self.assertEqual(found["tracked"], "placed/case/1/tracked")
        self.assertEqual(self.far_off(found), [])
        lines = (self.folder / "placed/case/1/bone.tra").read_text().splitlines()
        self.assertEqual(lines, [line(keyframes["1"]), NONE, NONE, line(keyframes["4"]), NONE, NONE])
        self.is_the_same(*shlex.split(command)[1:])
        again = self.server.get("/api/place/tracked?case=case&folder=placed/case/1/tracked")
        self.assertEqual(again["bone"], found["poses"]["bone"])

    def test_the_pipeline_for_two_views_takes_the_folder_too(self):
        self.tracked(keyframes={"bone": {"3": shifted(truth(3), 1)}})
        words = ["case=case", "frame_rate_hz=60", "keyframes=placed/case/1"]
        for view, one in VIEWS.items():
            words += ["%s=%s" % (view, one["images"]), "%s_pattern=%s" % (view, one["pattern"])]
            words.append("%s_camera=case/%s.camera.yaml" % (view, view))
        words += ["--set", "case.starts=placed/case/1", "--only", "tra"]
        self.is_the_same("run", SOURCE / "pipelines" / "track" / "track.yaml", *words)

    def test_a_keyframe_finds_a_bone_that_was_lost(self):
        lost = {"starts": {"bone": shifted(truth(1), 20)}}
        self.assertEqual(self.far_off(self.tracked(**lost)[1]), [1, 2, 3, 4, 5, 6])
        keyframes = {"bone": {"3": shifted(truth(3), 2)}}
        self.assertEqual(self.far_off(self.tracked(**lost, keyframes=keyframes)[1]), [1, 2])
        begun = self.server.post("/api/place/track", **self.wish())
        self.assertNotIn("keyframes=", begun["command"], "without keyframes the command names none")
        self.server.post("/api/job/stop", job=begun["job"])
        self.assertEqual(self.server.finish(begun["job"])["state"], "stopped")


if __name__ == "__main__":
    main(part=5, needs_browser=False)
