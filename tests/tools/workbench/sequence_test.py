#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Sequences on the page "Place" of `marrow open`: frames, keyframes, the poses between them, and the tracking."""
import math
import shlex
import time
import urllib.parse

import numpy
import yaml

import bench
from accessible_test import LOW_CONTRAST, UNNAMED
from bench import PageTest
from harness.modules import modules
from moving import NONE, VIEWS, Moving, line, shifted, truth
from placing import PageOfCase, angle_deg, at
from xray_bench import write_png


class PageOfSequenceTest(PageOfCase, Moving, PageTest):
    bone = "bone"

    def place(self, **options):
        """Shows the page, types in where the frames are, and opens the sequence."""
        server = super().place(**options)
        self.press("open-sequence")
        for view, one in VIEWS.items():
            for key, value in one.items():
                self.js("document.querySelector('[data-%s=%s]').value = arguments[0]" % (key, view), value)
        self.js("document.querySelector('[name=rate]').value = 60")
        self.press("sequence")
        self.browser.wait(
            "return marrow.place().sequence.isOn && !document.querySelector('.place-sequence').hidden"
            " && document.querySelector('.place-setup').hidden"
        )
        self.arrived(1)
        return server

    def press(self, name):
        self.js("document.querySelector('[data-do=%s]').click()" % name)

    def arrived(self, frame):
        script = "const s = marrow.place().sequence; return s.frame === %d && s.wanted === %d && !s.isArriving"
        self.browser.wait(script % (frame, frame))

    def keys(self, *names):
        for name in names:
            self.browser.key(name, "[data-view=frontal]")

    def settled(self):
        self.browser.wait("return !marrow.place().keyMoves && !marrow.place().isKeeping")

    def keyframes(self):
        self.settled()
        sequence = self.js("return marrow.place().draft.document.sequence")
        return {int(frame): one["pose"] for frame, one in (sequence["keyframes"].get("bone") or {}).items()}

    def put(self, frame, pose):
        """Places the bone in a frame and sets the keyframe, as a person does."""
        self.js("marrow.place().sequence.go(%d)" % frame)
        self.arrived(frame)
        self.js("marrow.place().show({bone: arguments[0]})", pose)
        self.keys("k")
        self.browser.wait("return !!marrow.place().sequence.keyframes('bone')[%d]" % frame)
        self.settled()

    def status(self):
        return self.js("return document.querySelector('.place-frame').textContent")

    def picture(self):
        return self.js("return marrow.place().views[0].paint.grey.join()")

    def test_frames_and_keyframes_by_keys(self):
        self.place()
        first = self.picture()
        self.keys("]", "]")
        self.arrived(3)
        self.assertNotEqual(self.picture(), first)
        self.assertEqual(self.status(), "Frame 3 of 6 · 0.033 s · bone: the start")
        self.keys("ARROW_RIGHT")
        self.browser.wait("return !!marrow.place().sequence.keyframes('bone')[3]")
        self.assertEqual(sorted(self.keyframes()), [3])
        self.assertEqual(self.js("return marrow.place().draft.state_undo"), "frame 3: move bone")
        self.assertEqual(self.status(), "Frame 3 of 6 · 0.033 s · bone: keyframe")
        self.keys("[")
        self.arrived(2)
        self.assertEqual(self.pose(), self.keyframes()[3], "before the first keyframe, the pose is that of the first")
        self.assertEqual(self.status(), "Frame 2 of 6 · 0.017 s · bone: as in frame 3")
        self.keys("]", "]", "]", "k")
        self.browser.wait("return !!marrow.place().sequence.keyframes('bone')[5]")
        self.keys("{")
        self.arrived(3)
        self.keys("}")
        self.arrived(5)
        marks = "return [...document.querySelectorAll('[data-keyframe]')].map((one) => one.dataset.keyframe)"
        self.assertEqual(self.js(marks), ["3", "5"])
        self.keys("K")
        self.browser.wait("return !marrow.place().sequence.keyframes('bone')[5]")
        self.assertEqual(self.js(marks), ["3"])
        self.assertEqual(self.js("return marrow.place().draft.state_undo"), "remove the keyframe of bone in frame 5")
        self.js("document.querySelector('[data-remove]').click()")
        self.browser.wait("return document.querySelectorAll('[data-keyframe]').length === 0")
        self.assertEqual(self.browser.logs()[0], [])

    def test_undo_shows_the_frame_that_it_changes(self):
        self.place()
        self.put(2, truth(2))
        self.put(5, truth(5))
        self.press("undo")
        self.browser.wait("return !marrow.place().sequence.keyframes('bone')[5]")
        self.js("return marrow.place().sequence.go(6)")
        self.arrived(6)
        self.press("undo")
        self.arrived(2)
        self.assertEqual(self.keyframes(), {})
        self.press("redo")
        self.browser.wait("return !!marrow.place().sequence.keyframes('bone')[2]")
        self.assertEqual(self.pose(), truth(2))

    def test_a_step_leads_to_its_frame(self):
        self.place()
        self.put(2, truth(2))
        self.put(5, truth(5))
        self.js(
            "const steps = [...document.querySelectorAll('.place-steps button')];"
            "steps.find((step) => step.textContent.includes('frame 2')).click()"
        )
        self.arrived(2)
        self.browser.wait("return marrow.place().draft.state_undo === 'frame 2: back to: keyframe of bone'")
        self.assertEqual(self.keyframes(), {2: truth(2), 5: truth(5)})

    def test_between_keyframes_the_middle_goes_straight_and_the_rotation_evenly(self):
        self.place()
        self.put(1, truth(1))
        self.put(5, truth(5))
        poses = {}
        for frame in (2, 3, 6):
            self.js("marrow.place().sequence.go(%d)" % frame)
            self.arrived(frame)
            poses[frame] = self.pose()
        begin, end = (self.middle(truth(frame)) for frame in (1, 5))
        for frame, share in ((2, 0.25), (3, 0.5)):
            expected = [a + share * (b - a) for a, b in zip(begin, end)]
            self.assertLess(math.dist(self.middle(poses[frame]), expected), 1e-9)
            self.assertAlmostEqual(angle_deg(truth(1), poses[frame]), share * angle_deg(truth(1), truth(5)), delta=1e-4)
        self.assertEqual(poses[6], truth(5))
        self.assertIn(
            "between frames 1 and 5",
            self.js("marrow.place().sequence.go(3); return document.querySelector('.place-frame').textContent"),
        )

    def test_large_turns_take_the_shorter_way(self):
        self.place()
        script = modules(Geometry="workbench/page/geometry.js", PlaceBetween="workbench/page/place_between.js") + (
            "const turn = (deg) => Geometry.rotation([1, 2, 3], deg * Math.PI / 180, [5, 6, 7]);"
            "return PlaceBetween.between(turn(arguments[0]), turn(arguments[1]), arguments[2], [5, 6, 7])"
        )
        turn = lambda begin, end, share: self.js(script, begin, end, share)
        for begin, end, share, expected in (
            (0, 178, 0.5, 89),
            (100, 260, 0.25, 140),
            (170, -170, 0.5, 180),
            (3, 3, 0.5, 3),
        ):
            self.assertLess(angle_deg(turn(begin, end, share), turn(expected, expected, 0)), 1e-4)
            self.assertLess(math.dist(at(turn(begin, end, share), [5, 6, 7]), [5, 6, 7]), 1e-9)

    def test_it_tracks_from_the_keyframes(self):
        server = self.place()
        self.put(1, truth(1))
        self.put(4, shifted(truth(4), 1))
        self.keys("ENTER")
        self.browser.wait("return !!marrow.place().sequence.kept.tracked && !marrow.place().isRegistering")
        command = shlex.split(self.js("return document.querySelector('.command code').textContent"))
        self.assertIn("keyframes=placed/case/1", command)
        self.assertIn(
            "bone was found in all 6 frames", self.js("return document.querySelector('#notices').textContent")
        )
        for frame, what in (
            (2, "tracked, trusted"),
            (4, "tracked from the keyframe, trusted"),
            (6, "tracked, trusted"),
        ):
            self.js("marrow.place().sequence.go(%d)" % frame)
            self.arrived(frame)
            self.assertLess(math.dist(self.middle(self.pose()), self.middle(truth(frame))), 1)
            self.assertTrue(self.status().endswith("bone: " + what), self.status())
        self.assertEqual(self.js("return document.querySelectorAll('.place-marks rect.tracked').length"), 1)
        tracked = self.pose()
        self.keys("ARROW_RIGHT")
        self.browser.wait("return !!marrow.place().sequence.keyframes('bone')[6]")
        self.settled()
        self.assertTrue(self.status().endswith("bone: keyframe"), self.status())
        self.assertAlmostEqual(math.dist(self.middle(self.pose()), self.middle(tracked)), 1, places=6)
        self.press("undo")
        self.browser.wait("return !marrow.place().sequence.keyframes('bone')[6]")
        self.assertEqual(self.pose(), tracked)
        self.press("undo")
        self.browser.wait("return !marrow.place().sequence.kept.tracked")
        self.browser.wait("return document.querySelectorAll('.place-marks rect').length === 0")
        self.press("redo")
        self.browser.wait("return document.querySelectorAll('.place-marks rect.tracked').length === 1")
        self.show(server, "home")
        self.show(server, "place=case")
        self.js("marrow.place().sequence.go(6)")
        self.arrived(6)
        self.assertEqual(self.pose(), tracked, "the tracked poses outlive the page")
        self.assertEqual(self.browser.logs()[0], [])

    def test_a_lost_bone_is_shown_as_lost(self):
        for view in ("frontal", "lateral"):
            blank = self.folder / "film" / "0004" / view / "image.png"
            write_png(blank, numpy.full((256, 256), 30000))
        self.place()
        self.put(1, truth(1))
        self.press("register")
        self.browser.wait("return !!marrow.place().sequence.kept.tracked && !marrow.place().isRegistering")
        self.assertIn(
            "bone is lost in 1 of 6 frames, first in 4: place it there, and track again",
            self.js("return document.querySelector('#notices').textContent"),
        )
        self.js("marrow.place().sequence.go(4)")
        self.arrived(4)
        self.assertTrue(self.status().endswith("bone: lost; between frames 3 and 5"), self.status())
        self.assertEqual(self.js("return document.querySelectorAll('.place-marks rect.lost').length"), 1)

    def test_keyframes_are_saved_as_files_of_autoscoper(self):
        self.place()
        self.put(2, truth(2))
        self.press("save-tra")
        self.browser.wait("return document.querySelector('#notices').textContent.includes('The keyframes are in')")
        lines = (self.folder / "placed" / "case" / "1" / "bone.tra").read_text().splitlines()
        self.assertEqual(lines, [NONE, line(truth(2))] + 4 * [NONE])

    def test_few_images_are_kept_in_memory(self):
        self.place()
        self.js(
            "const images = marrow.place().sequence.images; images.constructor.MOST_BYTES = 5 * 131072;"
            "images.blocks.clear(); images.constructor.BLOCK = 1"
        )
        for frame in (1, 2, 3, 4, 5, 6, 1):
            self.js("marrow.place().sequence.go(%d)" % frame)
            self.arrived(frame)
        held = (
            "const blocks = [...marrow.place().sequence.images.blocks.values()];"
            "return blocks.reduce((sum, one) => sum + (one.bytes || 0), 0)"
        )
        time.sleep(0.5)
        self.assertLessEqual(self.js(held), 5 * 131072)
        self.assertGreater(self.js(held), 131072)

    def test_without_the_sequence_the_case_is_shown_again(self):
        self.place()
        self.assertTrue(self.js("return document.querySelector('[aria-label=Costs]').hidden"))
        self.press("open-sequence")
        self.press("remove-sequence")
        self.browser.wait("return !marrow.place().sequence.isOn")
        self.assertTrue(self.js("return document.querySelector('.place-sequence').hidden"))
        self.assertFalse(self.js("return document.querySelector('[aria-label=Costs]').hidden"))
        self.assertTrue(self.js("return marrow.place().views.every((view) => view.shown.numbers === view.image)"))
        self.press("undo")
        self.browser.wait("return marrow.place().sequence.isOn")

    def test_other_images_have_no_tracked_poses(self):
        self.place()
        self.put(1, truth(1))
        self.press("register")
        self.browser.wait("return !!marrow.place().sequence.kept.tracked && !marrow.place().isRegistering")
        self.press("open-sequence")
        self.js("document.querySelector('[data-pattern=frontal]').value = '000[1-3]/frontal/image.png'")
        self.js("document.querySelector('[data-pattern=lateral]').value = '000[1-3]/lateral/image.png'")
        self.press("sequence")
        self.browser.wait("return marrow.place().sequence.frames === 3 && marrow.place().sequence.isOn")
        self.arrived(1)
        self.assertEqual(self.status(), "Frame 1 of 3 · 0.000 s · bone: keyframe")
        self.assertEqual(self.js("return document.querySelectorAll('.place-marks rect').length"), 0)
        self.press("undo")
        self.browser.wait("return marrow.place().sequence.frames === 6 && marrow.place().sequence.isOn")
        self.browser.wait("return document.querySelectorAll('.place-marks rect.tracked').length === 1")

    def test_a_dragged_slider_asks_for_the_newest_frame(self):
        self.place()
        self.js("const images = marrow.place().sequence.images; images.constructor.BLOCK = 1; images.blocks.clear()")
        self.browser.logs()
        self.js(
            "const slider = document.querySelector('[aria-label=Frame]');"
            "for (let frame = 2; frame <= 6; ++frame) {"
            "  slider.value = frame;"
            "  slider.dispatchEvent(new Event('input'));"
            "}"
        )
        self.arrived(6)
        asked = [url for url in self.browser.logs()[1] if "api/place/frames" in url and "view=frontal" in url]
        first = [int(urllib.parse.parse_qs(url)["first"][0]) for url in asked]
        self.assertEqual(first[:2], [2, 6], "the first wish, and then the newest")

    def test_a_bone_that_is_locked_gets_no_keyframe(self):
        file = self.folder / "case" / "case.yaml"
        case = yaml.safe_load(file.read_text())
        seeds = case["fragments"]["bone"]["seeds"]
        halves = {"bone": seeds[: len(seeds) // 2], "other": seeds[len(seeds) // 2 :]}
        case["fragments"] = {name: {"seeds": half} for name, half in halves.items()}
        file.write_text(yaml.safe_dump(case, sort_keys=False))
        self.place()
        self.assertEqual([bone["name"] for bone in self.about["bones"]], ["bone", "other"])
        self.js("document.querySelectorAll('.place-bones input')[1].click()")
        self.keys("k")
        self.browser.wait("return !!marrow.place().sequence.keyframes('bone')[1]")
        self.settled()
        self.assertEqual(self.js("return marrow.place().sequence.keyframes('other')"), {})
        self.assertEqual(self.status(), "Frame 1 of 6 · 0.000 s · bone: keyframe · other: the start")
        self.assertEqual(self.js("return document.querySelector('[data-frame]').textContent"), "Frame 1: bone")

    def test_contrast_and_names(self):
        for theme in ("light", "dark"):
            self.place(theme=theme)
            self.put(2, truth(2))
            self.press("open-sequence")
            self.assertEqual(self.js(LOW_CONTRAST), [])
            self.assertEqual(self.js(UNNAMED), [])

    def test_nothing_is_cut_off_on_a_narrow_page(self):
        for width_px in (1440, 1024, 400):
            self.place(width_px=width_px)
            self.press("open-sequence")
            self.assertLessEqual(self.js("return document.documentElement.scrollWidth"), width_px)


if __name__ == "__main__":
    bench.main()
