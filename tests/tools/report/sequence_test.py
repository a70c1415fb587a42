#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page of a sequence, in headless Chromium: the slider, the player, the curves and the 3D view.

    tests/tools/report/sequence_test.py     exit code 77: skipped, with the reason
"""
import sys
import time

from harness import shapes
from harness import synthetic
from harness.page import PageTest, run_tests


def sequence(frames=6, lost=3):
    """A run of a sequence: two films, and the way of the bone 'cube', which is lost in one frame."""
    data = synthetic.run()
    cell = data["cells"][0]
    names = ["%04d" % (i + 1) for i in range(frames)]
    for i, name in enumerate(names):
        for view in ("frontal", "lateral"):
            if view == "lateral" and i == lost:
                continue
            key = "film %s %s" % (view, name)
            data["pictures"][key] = shapes.picture(8, 8, bytes([20 * i + 9 * (view == "lateral")] * 64), 1)
            cell["pictures"].append({"name": "overlay/%s/cube/%s" % (name, view), "picture": key})
    cell["trajectories"] = [
        {
            "name": "way/cube",
            "frames": names,
            "time_s": [i / 10 for i in range(frames)],
            "found": [i != lost for i in range(frames)],
            "world_from_model": [shapes.flat(shapes.pose([0, 0, 5 * i], [i, 0, 0])) for i in range(frames)],
            "motion": [[0, 0, 5 * i, i, 0, 0] for i in range(frames)],
            "deviation": [[1, 1, 1 + 9 * (i == lost), 1, 1, 1] for i in range(frames)],
        }
    ]
    return data


class SequenceTest(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.data = sequence()
        cls.page = cls.write("sequence", cls.data)

    def setUp(self):
        self.browser.open(self.page)
        self.browser.show("sequence")

    def shown(self):
        """The frame's name, and of each film the picture that is shown, or None."""
        label, sources = self.browser.js(
            "return [document.querySelector('.frame-name').textContent,"
            " [...document.querySelectorAll('.films img')].map("
            "(image) => (image.style.visibility === 'hidden' ? null : image.getAttribute('src')))]"
        )
        by_source = {url: name for name, url in self.data["pictures"].items()}
        return label, [source and by_source[source] for source in sources]

    def test_slider_shows_the_frame(self):
        self.assertEqual(self.shown(), ("0001, 0.000\u00a0s", ["film frontal 0001", "film lateral 0001"]))
        self.choose("Frame", 4, "#sequence")
        self.assertEqual(self.shown(), ("0005, 0.400\u00a0s", ["film frontal 0005", "film lateral 0005"]))
        self.choose("Frame", 3, "#sequence")
        self.assertEqual(self.shown()[1], ["film frontal 0004", None])
        self.assertIn("none in this frame", self.texts(".films figcaption")[1])

    def test_it_plays_and_pauses(self):
        self.choose("Frames a second", 30, "#sequence")
        self.press("Play", "#sequence")
        seen, end = set(), time.monotonic() + 60
        while len(seen) < 6 and time.monotonic() < end:
            seen.add(self.shown()[0])
        self.assertEqual(len(seen), 6, "it goes through all frames and begins again")
        self.press("Pause", "#sequence")
        before = self.shown()
        time.sleep(0.3)
        self.assertEqual(self.shown(), before)

    def test_curves_have_bands_and_say_where_the_bone_is_lost(self):
        self.assertIn("Lost in 1 of 6 frames", " ".join(self.texts("#sequence .note")))
        self.eventually(lambda: self.browser.js("return document.querySelectorAll('#sequence svg.plot').length"), 6)
        self.assertEqual(self.browser.js("return document.querySelectorAll('#sequence .lost').length"), 6)
        heights = self.browser.js(
            "const plot = document.querySelectorAll('#sequence svg.plot')[2];"
            " return [...plot.querySelector('.band').getAttribute('d').matchAll(/,([\\d.]+)/g)].map((m) => +m[1])"
        )
        spread = [low - high for high, low in zip(heights[:6], heights[:5:-1])]
        self.assertAlmostEqual(spread[3] / spread[0], 10, 1)
        cursor = lambda: self.browser.js("return +document.querySelector('#sequence .cursor').getAttribute('x1')")
        first = cursor()
        self.choose("Frame", 5, "#sequence")
        self.assertGreater(cursor(), first + 50)

    def test_pictures_of_the_sequence_are_not_among_the_others(self):
        names = self.texts(".gallery span")
        self.assertGreater(len(names), 0)
        self.assertEqual([name for name in names if "/00" in name], [])

    def test_the_3d_view_moves_with_it(self):
        self.choose("Frame", 2, "#sequence")
        self.browser.show("scene")
        self.browser.wait("return !!marrow.scene")
        if self.browser.js("return !!marrow.scene.failure"):
            self.skipTest("no WebGL")
        place = "const m = marrow.scene.models[0].group.matrix.elements; return [m[12], m[13], m[14]]"
        at = lambda i: [self.data["cells"][0]["trajectories"][0]["world_from_model"][i][k] for k in (3, 7, 11)]
        self.assertEqual(self.browser.js(place), at(2))
        self.choose("Frame", 5, "#sequence")
        self.assertEqual(self.browser.js(place), at(5))


if __name__ == "__main__":
    sys.exit(run_tests(sys.argv[1:]))
