#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A real bone of the wrist, placed on the page "Place" by drags and keys as a person makes them, from a start that is
20 degrees and 20 mm off, and registered from there. Prints how long it took and where it ended, and keeps pictures.

    tests/tools/workbench/place_wrist.py WRIST [PICTURES]      # WRIST: the folder with volumes, images, cameras

The script acts as a person who sees where the bone belongs. It aims with the pointer in whole steps of 4 pixels and 2
degrees. Its goal is the placement by hand that is shipped for pipelines/wrist/wrist-intensity.yaml. The result is
compared with a registration from that placement.
"""
import json
import math
import pathlib
import random
import shutil
import sys
import time
import unittest

import yaml

import bench
import placing
from placing import at, seen, times

WRIST = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path("nowhere")
PICTURES = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None
STEM = "xr_rad_uln_cam0%d_UND.0002.tif"
AIM_PX, AIM_DEG = 4, 2


def placement():
    pose = yaml.safe_load((bench.SOURCE / "pipelines" / "wrist" / "radius-0002.pose.yaml").read_text())
    return [[*row, shift] for row, shift in zip(pose["rotation"], pose["translation_mm"])] + [[0, 0, 0, 1]]


def turned_about(axis, angle_deg):
    """A rotation about the origin."""
    x, y, z = (value / math.hypot(*axis) for value in axis)
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    k = 1 - c
    return [
        [c + k * x * x, k * x * y - s * z, k * x * z + s * y, 0],
        [k * y * x + s * z, c + k * y * y, k * y * z - s * x, 0],
        [k * z * x - s * y, k * z * y + s * x, c + k * z * z, 0],
        [0, 0, 0, 1],
    ]


def displaced(pose, middle):
    """The pose rotated by 20 degrees and shifted by 20 mm, in directions that are in no view's plane."""
    generator = random.Random(1)
    direction = lambda: [generator.gauss(0, 1) for _ in range(3)]
    far = times(turned_about(direction(), 20), pose)
    shift = direction()
    for i in range(3):
        far[i][3] += at(pose, middle)[i] - at(far, middle)[i] + 20 * shift[i] / math.hypot(*shift)
    return far


def make_case(folder):
    folder.mkdir()
    shutil.copy(WRIST / "volumes" / "rad_dcm_cropped.tif", folder)
    seeds = yaml.safe_load((bench.SOURCE / "pipelines" / "wrist" / "radius.seeds.yaml").read_text())
    views = []
    for i in (1, 2):
        camera = "xr_calib_wrist_cam0%d.txt" % i
        shutil.copy(WRIST / "images" / (STEM % i), folder)
        shutil.copy(WRIST / "cameras" / camera, folder)
        views.append({"name": "camera%d" % i, "image": STEM % i, "camera": camera})
    fragment = next(iter(seeds.get("fragments", seeds).values()))
    start = {"target": "world", "source": "ct", "matrix": placement()}
    case = {
        "marrow-case": 1,
        "ct": {"file": "rad_dcm_cropped.tif", "voxel_size_mm": [0.39625, 0.39625, 0.625], "value_offset_hu": -1024},
        "views": views,
        "fragments": {"radius": {"seeds": fragment["seeds"], "register": True, "start": start}},
    }
    (folder / "case.yaml").write_text(json.dumps(case))


class Wrist(placing.PageOfCase, bench.PageTest):
    bone = "radius"

    def setUp(self):
        if not WRIST.is_dir():
            self.skipTest("the data of the wrist is not there")
        super().setUp()
        make_case(self.folder / "case")

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
            half = [a + step / 2 for a, step in zip(now, steps)]
            self.drag(view, now, half, [a + step for a, step in zip(now, steps)])
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
        for step, key, other in ((5, "a", "d"), (1, "a", "d")):
            self.js("document.querySelector('.place-tools [data-value=\"%d\"]').click()" % step)
            best = placing.angle_deg(self.pose(), goal)
            for name in (key, other):
                while True:
                    self.browser.key(name, "[data-view=camera1]")
                    now = placing.angle_deg(self.pose(), goal)
                    if now >= best:
                        self.browser.key(other if name == key else key, "[data-view=camera1]")
                        break
                    best = now
            self.kept()

    def off(self, pose, goal):
        return "%.2f mm and %.2f degrees" % (
            math.dist(self.middle(pose), self.middle(goal)),
            placing.angle_deg(pose, goal),
        )

    def picture(self, name):
        if PICTURES:
            PICTURES.mkdir(parents=True, exist_ok=True)
            time.sleep(0.5)
            self.browser.picture(PICTURES / (name + ".png"))

    def registered(self):
        count = len(self.js("return marrow.place().steps.steps"))
        self.js("document.querySelector('[data-do=register]').click()")
        self.browser.wait(
            "const page = marrow.place(); return !page.isRegistering && page.steps.steps.length > %d" % count, 600
        )
        return self.kept()

    def test_a_bone_is_placed_by_hand_and_registered(self):
        self.place()
        goal = placement()
        reference = self.registered()
        far = displaced(goal, self.about["bones"][0]["middle_mm"])
        self.js("marrow.place().show({radius: arguments[0]})", far)
        self.picture("start")
        begin = time.monotonic()
        for _ in range(3):
            for view in ("camera1", "camera2"):
                self.aim(view, goal)
            self.roll(goal)
        placed = self.pose()
        took = time.monotonic() - begin
        self.picture("placed")
        found = self.registered()
        self.js("document.querySelector('[data-value=outline]').click()")
        self.picture("registered")
        print("\nstart: %s from the placement" % self.off(far, goal))
        print("placed by hand in %.0f s: %s from the placement" % (took, self.off(placed, goal)))
        print(
            "registered from there: %s from the registration that began at the placement" % self.off(found, reference)
        )
        print("verdict:", self.js("return document.querySelector('.place-verdict').textContent"))
        self.assertLess(took, 120)
        self.assertLess(math.dist(self.middle(found), self.middle(reference)), 2)


if __name__ == "__main__":
    del sys.argv[1:]
    unittest.main(verbosity=2)
