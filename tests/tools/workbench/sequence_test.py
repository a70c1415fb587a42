#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Sequences on the page "Place" of `marrow open`: frames, keyframes, the poses between them, and the tracking."""
import math
import shlex
import shutil
import time
import urllib.parse

import numpy
import yaml

from accessible_test import LOW_CONTRAST, UNNAMED
from harness.page import main
from made_cases import NONE, VIEWS, angle_deg, line, moving, shifted, truth, write_png
from placing import PlacePage

TRACKED = "!!sequence.kept.tracked && !page.isRegistering"


class SequenceTest(PlacePage):
    """The open folder holds the case `case` and the images of its sequence in `film`."""

    bone = "bone"

    def setUp(self):
        super().setUp()
        shutil.rmtree(self.folder / "case")
        shutil.copytree(moving()[0] / "case", self.folder / "case")
        shutil.copytree(moving()[0] / "views", self.folder / "film")

    def place(self, **look):
        """Shows the page, types in where the frames are, and opens the sequence."""
        super().place(**look)
        self.do("open-sequence")
        for view, one in VIEWS.items():
            for key, value in one.items():
                self.js("document.querySelector('[data-%s=%s]').value = arguments[0]" % (key, view), value)
        self.the("[name=rate]", "one.value = 60")
        self.do("sequence")
        hidden = "document.querySelector('.place-%s').hidden"
        self.wait_page("sequence.isOn && !%s && %s" % (hidden % "sequence", hidden % "setup"))
        self.arrived(1)

    def arrived(self, frame):
        self.wait_page("sequence.frame === %d && sequence.wanted === %d && !sequence.isArriving" % (frame, frame))

    def go(self, *frames):
        for frame in frames:
            self.js("marrow.place().sequence.go(%d)" % frame)
            self.arrived(frame)

    def keyframe(self, frame, is_there=True):
        self.wait_page("!!sequence.keyframes('bone')[%d] === %s" % (frame, "true" if is_there else "false"))

    def keyframes(self):
        self.settled()
        frames = self.page("draft.document.sequence")["keyframes"].get("bone") or {}
        return {int(frame): one["pose"] for frame, one in frames.items()}

    def put(self, frame, pose):
        """Places the bone in a frame and sets the keyframe, as a person does."""
        self.go(frame)
        self.js("marrow.place().show({bone: arguments[0]})", pose)
        self.keys("k")
        self.keyframe(frame)
        self.settled()

    def status(self):
        return self.text(".place-frame")

    def marks(self, kind, count):
        self.wait("document.querySelectorAll('.place-marks rect%s').length === %d" % (kind, count))

    def test_frames_and_keyframes_by_keys(self):
        self.place()
        picture = lambda: self.page("views[0].paint.grey.join()")
        first = picture()
        self.keys("]", "]")
        self.arrived(3)
        self.assertNotEqual(picture(), first)
        self.assertEqual(self.status(), "Frame 3 of 6 · 0.033 s · bone: the start")
        self.keys("ARROW_RIGHT")
        self.keyframe(3)
        self.assertEqual(sorted(self.keyframes()), [3])
        self.assertEqual(self.page("draft.state_undo"), "frame 3: move bone")
        self.assertEqual(self.status(), "Frame 3 of 6 · 0.033 s · bone: keyframe")
        self.keys("[")
        self.arrived(2)
        self.assertEqual(self.pose(), self.keyframes()[3], "before the first keyframe, the pose is that of the first")
        self.assertEqual(self.status(), "Frame 2 of 6 · 0.017 s · bone: as in frame 3")
        self.keys("]", "]", "]", "k")
        self.keyframe(5)
        self.keys("{")
        self.arrived(3)
        self.keys("}")
        self.arrived(5)
        marks = lambda: self.all("[data-keyframe]", "one.dataset.keyframe")
        self.assertEqual(marks(), ["3", "5"])
        self.keys("K")
        self.keyframe(5, False)
        self.assertEqual(marks(), ["3"])
        self.assertEqual(self.page("draft.state_undo"), "remove the keyframe of bone in frame 5")
        self.the("[data-remove]", "one.click()")
        self.eventually(marks, [])
        self.no_faults()

    def test_undo_and_steps_lead_to_the_frames_that_they_change(self):
        self.place()
        self.put(2, truth(2))
        self.put(5, truth(5))
        step = "one.textContent.includes('frame 2') && one.click()"
        self.all(".place-steps button", step)
        self.arrived(2)
        self.wait_page("page.draft.state_undo === 'frame 2: back to: keyframe of bone'")
        self.assertEqual(self.keyframes(), {2: truth(2), 5: truth(5)})
        self.do("undo")
        self.wait_page("page.draft.state_undo === 'frame 5: keyframe of bone'")
        self.do("undo")
        self.keyframe(5, False)
        self.go(6)
        self.do("undo")
        self.arrived(2)
        self.assertEqual(self.keyframes(), {})
        self.do("redo")
        self.keyframe(2)
        self.assertEqual(self.pose(), truth(2))
        self.do("save-tra")
        self.says("#notices", "The keyframes are in")
        lines = (self.folder / "placed" / "case" / "1" / "bone.tra").read_text().splitlines()
        self.assertEqual(lines, [NONE, line(truth(2))] + 4 * [NONE], "as Autoscoper reads them")

    def test_between_keyframes_the_middle_goes_straight_and_the_rotation_evenly(self):
        self.place()
        self.put(1, truth(1))
        self.put(5, truth(5))
        poses = {}
        for frame in (2, 6, 3):
            self.go(frame)
            poses[frame] = self.pose()
        begin, end = (self.middle(truth(frame)) for frame in (1, 5))
        for frame, share in ((2, 0.25), (3, 0.5)):
            expected = [a + share * (b - a) for a, b in zip(begin, end)]
            self.assertLess(math.dist(self.middle(poses[frame]), expected), 1e-9)
            self.assertAlmostEqual(angle_deg(truth(1), poses[frame]), share * angle_deg(truth(1), truth(5)), delta=1e-4)
        self.assertEqual(poses[6], truth(5))
        self.assertIn("between frames 1 and 5", self.status())

    def test_it_tracks_from_the_keyframes(self):
        self.place()
        self.put(1, truth(1))
        self.put(4, shifted(truth(4), 1))
        self.keys("ENTER")
        self.wait_page(TRACKED)
        self.assertIn("keyframes=placed/case/1", shlex.split(self.text(".command code")))
        self.assertIn("bone was found in all 6 frames", self.text("#notices"))
        from_keyframe = {4: "tracked from the keyframe, trusted"}
        for frame in (2, 4, 6):
            self.go(frame)
            self.assertLess(math.dist(self.middle(self.pose()), self.middle(truth(frame))), 1)
            said = "bone: " + from_keyframe.get(frame, "tracked, trusted")
            self.assertTrue(self.status().endswith(said), self.status())
        self.marks(".tracked", 1)
        tracked = self.pose()
        self.keys("ARROW_RIGHT")
        self.keyframe(6)
        self.settled()
        self.assertTrue(self.status().endswith("bone: keyframe"), self.status())
        self.assertAlmostEqual(math.dist(self.middle(self.pose()), self.middle(tracked)), 1, places=6)
        self.do("undo")
        self.keyframe(6, False)
        self.assertEqual(self.pose(), tracked)
        self.do("undo")
        self.wait_page("!sequence.kept.tracked")
        self.marks("", 0)
        self.do("redo")
        self.marks(".tracked", 1)
        self.show("home")
        self.show("place=case")
        self.go(6)
        self.assertEqual(self.pose(), tracked, "the tracked poses outlive the page")
        self.no_faults()
        self.do("open-sequence")
        for view in VIEWS:
            self.js("document.querySelector('[data-pattern=%s]').value = '000[1-3]/%s/image.png'" % (view, view))
        self.do("sequence")
        self.wait_page("sequence.frames === 3 && sequence.isOn")
        self.go(1)
        self.assertEqual(self.status(), "Frame 1 of 3 · 0.000 s · bone: keyframe")
        self.assertEqual(self.count(".place-marks rect"), 0, "other images have no tracked poses")
        self.do("undo")
        self.wait_page("sequence.frames === 6 && sequence.isOn")
        self.marks(".tracked", 1)

    def test_a_lost_bone_is_shown_as_lost(self):
        for view in VIEWS:
            write_png(self.folder / "film" / "0004" / view / "image.png", numpy.full((256, 256), 30000))
        self.place()
        self.put(1, truth(1))
        self.do("register")
        self.wait_page(TRACKED)
        said = "bone is lost in 1 of 6 frames, first in 4: place it there, and track again"
        self.assertIn(said, self.text("#notices"))
        self.go(4)
        self.assertTrue(self.status().endswith("bone: lost; between frames 3 and 5"), self.status())
        self.marks(".lost", 1)

    def test_images_in_memory_and_on_their_way(self):
        """Few are kept, and a dragged slider asks for the newest frame."""
        self.place()
        small = "const images = marrow.place().sequence.images; images.blocks.clear(); images.constructor.BLOCK = 1;"
        self.js(small)
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
        self.js(small + "images.constructor.MOST_BYTES = 5 * 131072")
        self.go(1, 2, 3, 4, 5, 6, 1)
        time.sleep(0.5)
        blocks = self.page("sequence.images.blocks.values().map((one) => one.bytes || 0).toArray()")
        self.assertTrue(131072 < sum(blocks) <= 5 * 131072, blocks)

    def test_without_the_sequence_the_case_is_shown_again(self):
        self.place()
        costs_are_hidden = lambda: self.the("[aria-label=Costs]", "one.hidden")
        self.assertTrue(costs_are_hidden())
        self.do("open-sequence")
        self.do("remove-sequence")
        self.wait_page("!sequence.isOn")
        self.assertTrue(self.the(".place-sequence", "one.hidden"))
        self.assertFalse(costs_are_hidden())
        self.assertTrue(self.page("views.every((view) => view.shown.numbers === view.image)"))
        self.do("undo")
        self.wait_page("sequence.isOn")

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
        self.keyframe(1)
        self.settled()
        self.assertEqual(self.page("sequence.keyframes('other')"), {})
        self.assertEqual(self.status(), "Frame 1 of 6 · 0.000 s · bone: keyframe · other: the start")
        self.assertEqual(self.text("[data-frame]"), "Frame 1: bone")

    def test_contrast_names_and_widths(self):
        for theme, widths_px in (("light", (1440, 1024, 400)), ("dark", ())):
            self.place(theme=theme)
            self.put(2, truth(2))
            self.do("open-sequence")
            self.assertEqual(self.js(LOW_CONTRAST), [])
            self.assertEqual(self.js(UNNAMED), [])
            for width_px in widths_px:
                self.browser.look(width_px)
                self.fits()


if __name__ == "__main__":
    main(part=5)
