#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The requests of the page "Place" about sequences: frames, keyframes, and tracking as on the command line."""
import json
import math
import shlex
import subprocess
import urllib.parse

import numpy

import bench
from bench import MARROW, SOURCE, BenchTest
from moving import FRAMES, NONE, VIEWS, Moving, line, shifted, truth, write_tiff
from placing import at


def wish(**changes):
    """The request of the page that tracks the bone."""
    asked = {"case": "case", "views": VIEWS, "frame_rate_hz": 60, "frames": FRAMES}
    return {**asked, "starts": {"bone": truth(1)}, "keyframes": {}, **changes}


BYTES = 2 * 256 * 256  # of a frame: 16 bits for each pixel


class RequestsTest(Moving, BenchTest):
    def setUp(self):
        super().setUp()
        self.server = self.open()
        self.server.enter()
        state = self.server.finish(self.server.json("POST", "/api/place/open", {"case": "case"})["job"])
        self.assertEqual(state["error"], "")

    def marrow(self, *words):
        """Runs the command line in the opened folder, with its own store."""
        environment = {**bench.os.environ, "MARROW_CACHE": str(self.scratch / "another-store")}
        subprocess.run([MARROW, *words, "--quiet"], cwd=self.folder, check=True, env=environment)

    def opened(self, views):
        return self.server.finish(
            self.server.json("POST", "/api/place/sequence", {"case": "case", "views": views})["job"]
        )

    def fault(self, path, body=None):
        status, _, content = self.server.ask("POST" if body else "GET", path, body)
        self.assertEqual(status, 400, content)
        return json.loads(content)["error"]

    def frames(self, **changes):
        asked = {"case": "case", "view": "frontal", **VIEWS["frontal"], "first": 2, "last": 3, "step_px": 1, **changes}
        return "/api/place/frames?" + urllib.parse.urlencode(asked)

    def test_frames_are_read_where_they_are(self):
        self.assertEqual(self.opened(VIEWS)["result"], {"frames": FRAMES})
        status, headers, content = self.server.ask("GET", self.frames())
        self.assertEqual((status, json.loads(headers["X-Marrow-About"])), (200, {"bytes": BYTES, "frames": 2}))
        self.assertEqual(len(content), 2 * BYTES)
        second = self.server.ask("GET", self.frames(first=3))[2]
        self.assertEqual(content[BYTES:], second)
        self.assertNotEqual(content[:BYTES], second)
        self.assertEqual(len(self.server.ask("GET", self.frames(first=3, step_px=2))[2]), BYTES // 4)

    def test_a_file_with_several_frames_and_a_camera_in_case_yaml(self):
        images = [numpy.full((256, 256), 1000 * (frame + 1)) for frame in range(3)]
        for frame, image in enumerate(images):
            image[:, : 64 * (frame + 1)] = 60000
        write_tiff(self.folder / "film.tif", images)
        file = self.folder / "case" / "case.yaml"
        arm = "source_to_detector_mm: 1000, source_to_isocentre_mm: 600, pixel_mm: 1.1, alpha_deg: 0, beta_deg: 0"
        camera = "{marrow-camera: 1, width_px: 256, height_px: 256, c_arm: {%s}}" % arm
        text = file.read_text()
        self.assertEqual(text.count("frontal.camera.yaml"), 1)
        file.write_text(text.replace("frontal.camera.yaml", camera))
        self.server.finish(self.server.json("POST", "/api/place/open", {"case": "case"})["job"])
        film = {"images": "film.tif", "pattern": ""}
        state = self.opened({"frontal": film, "lateral": film})
        self.assertEqual((state["error"], state["result"]), ("", {"frames": 3}))
        content = self.server.ask("GET", self.frames(**film))[2]
        for at, frame in ((0, 2), (1, 3)):
            row = numpy.frombuffer(content[BYTES * at :][:512], "<u2")
            self.assertEqual(row.tolist(), [60000] * (64 * frame) + [1000 * frame] * (256 - 64 * frame))
        self.assertIn(
            "a pattern chooses files of a folder, but this is not a folder; leave it out",
            self.opened({"frontal": {**film, "pattern": "*.tif"}, "lateral": film})["error"],
        )

    def test_what_is_wrong_with_a_sequence_is_said(self):
        asked = {"case": "case", "views": {"frontal": VIEWS["frontal"]}}
        self.assertEqual(
            self.fault("/api/place/sequence", asked),
            "view 'lateral': say where its frames are: a folder of images, or a file with several frames",
        )
        (self.folder / "film" / "0006" / "lateral" / "image.png").unlink()
        self.assertEqual(
            self.opened(VIEWS)["error"],
            "view 'lateral' has 5 frames, but view 'frontal' has 6; all views must show the same moments",
        )
        wrong = {**VIEWS, "frontal": {"images": "film", "pattern": "*.png"}}
        self.assertIn("no file in it fits the pattern '*.png'", self.opened(wrong)["error"])
        outside = {**VIEWS, "frontal": {"images": "../..", "pattern": ""}}
        self.assertIn(
            " leads out of the folder that is open, ", self.fault("/api/place/sequence", {**asked, "views": outside})
        )
        self.assertEqual(self.fault(self.frames(last=99)), "'last' must be a whole number from 2 to 33, got '99'")

    def test_what_is_wrong_with_keyframes_is_said(self):
        good = wish()
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
            self.assertEqual(self.fault("/api/place/track", {**good, **change}), fault)
        self.assertEqual(
            self.fault("/api/place/tracked?case=case&folder=nowhere"),
            "'nowhere': the tracked poses are gone; track the bones again",
        )

    def test_the_command_line_tracks_the_same(self):
        keyframes = {"1": truth(1), "4": shifted(truth(4), 1)}
        asked = wish(keyframes={"bone": keyframes})
        begun = self.server.json("POST", "/api/place/track", asked)
        state = self.server.finish(begun["job"])
        self.assertEqual(state["error"], "")
        found = state["result"]
        self.assertEqual(found["tracked"], "placed/case/1/tracked")
        for i, pose in enumerate(found["poses"]["bone"]):
            self.assertLess(math.dist(at(pose, [0, 0, 160]), at(truth(i + 1), [0, 0, 160])), 1)
        lines = (self.folder / "placed/case/1/bone.tra").read_text().splitlines()
        self.assertEqual(lines, [line(keyframes["1"]), NONE, NONE, line(keyframes["4"]), NONE, NONE])
        self.marrow(*shlex.split(begun["command"])[1:], "--out", self.scratch / "run")
        written = (self.scratch / "run" / "outputs" / "tra" / "bone.tra").read_bytes()
        self.assertEqual(written, (self.folder / "placed/case/1/tracked/bone.tra").read_bytes())
        again = self.server.json("GET", "/api/place/tracked?case=case&folder=placed/case/1/tracked")
        self.assertEqual(again["bone"], found["poses"]["bone"])

    def test_the_pipeline_for_two_views_takes_the_folder_too(self):
        asked = wish(keyframes={"bone": {"3": shifted(truth(3), 1)}})
        self.server.finish(self.server.json("POST", "/api/place/track", asked)["job"])
        words = ["case=case", "frame_rate_hz=60", "keyframes=placed/case/1"]
        for view, one in VIEWS.items():
            words += ["%s=%s" % (view, one["images"]), "%s_pattern=%s" % (view, one["pattern"])]
            words.append("%s_camera=case/%s.camera.yaml" % (view, view))
        words += ["--set", "case.starts=placed/case/1", "--only", "tra", "--out", self.scratch / "run"]
        self.marrow("run", SOURCE / "pipelines" / "track" / "track.yaml", *words)
        written = (self.scratch / "run" / "outputs" / "tra" / "bone.tra").read_bytes()
        self.assertEqual(written, (self.folder / "placed/case/1/tracked/bone.tra").read_bytes())

    def test_a_keyframe_finds_a_bone_that_was_lost(self):
        asked = wish(starts={"bone": shifted(truth(1), 20)})
        far_off = lambda result: [
            frame
            for frame, pose in enumerate(result["poses"]["bone"], 1)
            if not pose or math.dist(at(pose, [0, 0, 160]), at(truth(frame), [0, 0, 160])) > 1
        ]
        begun = self.server.json("POST", "/api/place/track", asked)
        self.assertEqual(far_off(self.server.finish(begun["job"])["result"]), [1, 2, 3, 4, 5, 6])
        asked["keyframes"] = {"bone": {"3": shifted(truth(3), 2)}}
        begun = self.server.json("POST", "/api/place/track", asked)
        self.assertEqual(far_off(self.server.finish(begun["job"])["result"]), [1, 2])

    def test_without_keyframes_the_command_names_none(self):
        begun = self.server.json("POST", "/api/place/track", wish())
        self.assertNotIn("keyframes=", begun["command"])
        self.server.json("POST", "/api/job/stop", {"job": begun["job"]})
        self.assertEqual(self.server.finish(begun["job"])["state"], "stopped")


if __name__ == "__main__":
    bench.main()
