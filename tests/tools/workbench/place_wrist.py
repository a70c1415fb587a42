#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A real bone of the wrist, placed on the page "Place" by drags and keys as a person makes them, from a start that is
20 degrees and 20 mm off, and registered from there. Prints how long it took and where it ended, and keeps pictures.

    MARROW_PICTURES=FOLDER tests/tools/workbench/place_wrist.py WRIST     # the folder with volumes, images, cameras

The script acts as a person who sees where the bone belongs. It aims with the pointer in whole steps of 4 pixels and 2
degrees. Its goal is the placement by hand that is shipped for pipelines/wrist/wrist-intensity.yaml. The result is
compared with a registration from that placement.
"""
import json
import math
import pathlib
import shutil
import sys
import time
import unittest

import numpy
import yaml

from harness.wrist import POSES
from made_cases import angle_deg, at, seen, turned
from placing import PlacePage

WRIST = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path("nowhere")
STEM = "xr_rad_uln_cam0%d_UND.0002.tif"
AIM_PX, AIM_DEG = 4, 2


def placement():
    pose = yaml.safe_load((POSES / "radius-0002.pose.yaml").read_text())
    return [[*row, shift] for row, shift in zip(pose["rotation"], pose["translation_mm"])] + [[0, 0, 0, 1]]


def displaced(pose, middle):
    """The pose rotated by 20 degrees and shifted by 20 mm, in directions that are in no view's plane."""
    turn, far = numpy.eye(4), numpy.array(pose)
    turn[:3, :3] = turned((11, 12, 12))
    far = turn @ far
    far[:3, 3] += numpy.array(at(pose, middle)) - at(far, middle) + 20 / math.sqrt(3)
    return far.tolist()


class Wrist(PlacePage):
    bone = "radius"

    def setUp(self):
        if not WRIST.is_dir():
            self.skipTest("the data of the wrist is not there")
        super().setUp()
        folder = self.folder / "case"
        shutil.rmtree(folder)
        folder.mkdir()
        shutil.copy(WRIST / "volumes" / "rad_dcm_cropped.tif", folder)
        views = []
        for i in (1, 2):
            camera = "xr_calib_wrist_cam0%d.txt" % i
            shutil.copy(WRIST / "images" / (STEM % i), folder)
            shutil.copy(WRIST / "cameras" / camera, folder)
            views.append({"name": "camera%d" % i, "image": STEM % i, "camera": camera})
        seeds = yaml.safe_load((POSES / "radius.seeds.yaml").read_text())
        fragment = next(iter(seeds.get("fragments", seeds).values()))
        start = {"target": "world", "source": "ct", "matrix": placement()}
        voxels = {"voxel_size_mm": [0.39625, 0.39625, 0.625], "value_offset_hu": -1024}
        case = {
            "marrow-case": 1,
            "ct": {"file": "rad_dcm_cropped.tif", **voxels},
            "views": views,
            "fragments": {"radius": {"seeds": fragment["seeds"], "register": True, "start": start}},
        }
        (folder / "case.yaml").write_text(json.dumps(case))

    def angle_in(self, camera, pose):
        """Of the bone's long axis in a view, in degrees."""
        end = [m + 20 * a for m, a in zip(*(self.about["bones"][0][name] for name in ("middle_mm", "long_axis")))]
        (u, v, _), (u2, v2, _) = seen(camera, self.middle(pose)), seen(camera, at(pose, end))
        return math.degrees(math.atan2(v2 - v, u2 - u))

    def aim(self, view, goal):
        """Drags the bone to its place in a view, then turns it there."""
        camera = self.camera(view)
        now, there = (seen(camera, self.middle(pose))[:2] for pose in (self.pose(), goal))
        steps = [AIM_PX * round((b - a) / AIM_PX) for a, b in zip(now, there)]
        if any(steps):
            along = lambda share: [a + share * step for a, step in zip(now, steps)]
            self.drag(view, now, along(0.5), along(1))
            self.kept()
        turn = (self.angle_in(camera, goal) - self.angle_in(camera, self.pose()) + 180) % 360 - 180
        turn = AIM_DEG * round(turn / AIM_DEG)
        if turn:
            u, v, _ = seen(camera, self.middle(self.pose()))
            on_circle = lambda angle: (u + 200 * math.cos(math.radians(angle)), v + 200 * math.sin(math.radians(angle)))
            self.drag(view, on_circle(0), on_circle(turn / 2), on_circle(turn), modifiers=8)
            self.kept()

    def roll(self, goal):
        """Turns the bone about its long axis by keys until it looks as it should."""
        for step in (5, 1):
            self.the('.place-tools [data-value="%d"]' % step, "one.click()")
            best = angle_deg(self.pose(), goal)
            for key, back in ("ad", "da"):
                self.keys(key)
                while (now := angle_deg(self.pose(), goal)) < best:
                    best = now
                    self.keys(key)
                self.keys(back)
            self.kept()

    def off(self, pose, goal):
        distance_mm = math.dist(self.middle(pose), self.middle(goal))
        return "%.2f mm and %.2f degrees" % (distance_mm, angle_deg(pose, goal))

    def registered(self):
        count = self.page("steps.steps.length")
        self.do("register")
        self.wait_page("!page.isRegistering && page.steps.steps.length > %d" % count)
        return self.kept()

    def test_a_bone_is_placed_by_hand_and_registered(self):
        self.place()
        goal = placement()
        reference = self.registered()
        far = displaced(goal, self.about["bones"][0]["middle_mm"])
        self.js("marrow.place().show({radius: arguments[0]})", far)
        self.photograph("wrist-start")
        begin = time.monotonic()
        for _ in range(3):
            for view in ("camera1", "camera2"):
                self.aim(view, goal)
            self.roll(goal)
        placed, took = self.pose(), time.monotonic() - begin
        self.photograph("wrist-placed")
        found = self.registered()
        self.the("[data-value=outline]", "one.click()")
        self.photograph("wrist-registered")
        print("\nstart: %s from the placement" % self.off(far, goal))
        print("placed by hand in %.0f s: %s from the placement" % (took, self.off(placed, goal)))
        print("registered from there: %s from the registration from the placement" % self.off(found, reference))
        print("verdict:", self.text(".place-verdict"))
        self.assertLess(took, 120)
        self.assertLess(math.dist(self.middle(found), self.middle(reference)), 2)


if __name__ == "__main__":
    del sys.argv[1:]
    unittest.main(verbosity=2)
