# SPDX-License-Identifier: Apache-2.0
"""The page "Place" with a case whose bone has a known pose, and what a person does there."""
import shutil

from bench import PageTest
from made_cases import at, femur


class PlacePage(PageTest):
    bone = "distal"

    def setUp(self):
        super().setUp()
        shutil.copytree(femur()[0], self.folder / "case")

    def place(self, **look):
        self.show("place=case", **look)
        self.js("marrow.place().judges = false; marrow.place().stopVerdict()")
        self.about = self.page("about")

    def page(self, what):
        """The value of a part of the page's script."""
        return self.js("return marrow.place()." + what)

    def wait_page(self, condition):
        self.browser.wait("const page = marrow.place(), sequence = page.sequence; return " + condition)

    def pose(self):
        return self.page("placed.%s" % self.bone)

    def settled(self):
        self.wait_page("!page.keyMoves && !page.isKeeping")

    def kept(self):
        """The pose of the draft, after all changes were kept."""
        self.settled()
        return self.page("draft.document.fragments.%s.start" % self.bone)

    def keys(self, *names):
        for name in names:
            self.browser.key(name, ".place-canvas")

    def place_of(self, view, pixel):
        """Where a pixel of the X-ray is in the window."""
        left, top, width, height = self.browser.box('.place-canvas[data-view="%s"]' % view)
        camera = self.camera(view)
        u, v = (pixel[0] + 0.5) / camera["width_px"], (pixel[1] + 0.5) / camera["height_px"]
        return left + u * width, top + v * height

    def drag(self, view, *pixels, button="left", modifiers=0):
        held = {"left": 1, "right": 2}[button]
        places = [self.place_of(view, pixel) for pixel in pixels]
        self.browser.drag_along(places, held, button=button, modifiers=modifiers)

    def touch(self, view, *steps):
        """Fingers touch at the first step, move from step to step and leave. A step has a pixel for each finger."""
        places = [[self.place_of(view, pixel) for pixel in step] for step in steps]
        for fingers in range(1, len(places[0]) + 1):
            self.browser.touch("touchStart", places[0][:fingers])
        for step in places[1:]:
            self.browser.touch("touchMove", step)
        self.browser.touch("touchEnd")

    def camera(self, view):
        return next(one["camera"] for one in self.about["views"] if one["name"] == view)

    def middle(self, pose):
        return at(pose, self.about["bones"][0]["middle_mm"])
