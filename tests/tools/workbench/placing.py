# SPDX-License-Identifier: Apache-2.0
"""What the tests of the page "Place" share: a femur with a known pose, its projection, and the actions of a person on
the page."""
import math
import pathlib
import shutil
import tempfile
import unittest

from bench import SMALL, simulate

CASE = {}


def case_folder():
    """A simulated femur, made once. Its true pose is known."""
    if not CASE:
        scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-place-"))
        unittest.addModuleCleanup(shutil.rmtree, scratch, ignore_errors=True)
        CASE["folder"] = simulate(scratch / "sim", *SMALL) / "case"
    return CASE["folder"]


def truth():
    import yaml

    return yaml.safe_load((case_folder() / "case.yaml").read_text())["fragments"]["distal"]["truth"]["matrix"]


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def at(pose, point):
    return [sum(pose[i][k] * point[k] for k in range(3)) + pose[i][3] for i in range(3)]


def seen(camera, point):
    """Pixel and depth of a world point."""
    x, y, z = at(camera["camera_from_world"], point)
    (fx, skew, u0), (_, fy, v0), _ = camera["intrinsics"]
    return [(fx * x + skew * y) / z + u0, fy * y / z + v0, z]


def angle_deg(a, b):
    """Of the rotation from one pose to the other."""
    trace = sum(a[i][j] * b[i][j] for i in range(3) for j in range(3))
    return math.degrees(math.acos(max(-1, min(1, (trace - 1) / 2))))


class Placing:
    def setUp(self):
        super().setUp()
        shutil.copytree(case_folder(), self.folder / "case")

    def opened(self, server):
        if server.cookie is None:
            server.enter()
        state = server.finish(server.json("POST", "/api/place/open", {"case": "case"})["job"])
        self.assertEqual((state["state"], state["error"]), ("done", ""))
        return state["result"]

    def overlay(self, server, **changes):
        asked = {"case": "case", "view": "frontal", "what": "radiograph", "step_px": 1, **changes}
        return server.ask("POST", "/api/place/overlay", asked)


class PageOfCase:
    """The page with a case, and what a person does there."""

    bone = "distal"

    def place(self, **options):
        server = self.open()
        self.browser.logs()  # those of the page before
        self.show(server, "place=case", **options)
        self.js("marrow.place().judges = false; marrow.place().stopVerdict()")
        self.about = self.js("return marrow.place().about")
        return server

    def js(self, text, *arguments):
        return self.browser.js(text, *arguments)

    def pose(self):
        return self.js("return marrow.place().placed[arguments[0]]", self.bone)

    def kept(self):
        """The pose of the draft, after all changes were kept."""
        self.browser.wait("return !marrow.place().keyMoves && !marrow.place().isKeeping")
        return self.js("return marrow.place().draft.document.fragments[arguments[0]].start", self.bone)

    def place_of(self, view, pixel):
        """Where a pixel of the X-ray is in the window."""
        return self.js(
            "const view = marrow.place().views.find((one) => one.name === arguments[0]);"
            "const r = view.canvas.getBoundingClientRect(), camera = view.camera;"
            "return [r.left + (arguments[1][0] + 0.5) / camera.width_px * r.width,"
            " r.top + (arguments[1][1] + 0.5) / camera.height_px * r.height]",
            view,
            pixel,
        )

    def touch(self, view, *steps):
        """Fingers touch at the first step, move from step to step and leave. A step has a pixel for each finger."""
        send = lambda kind, pixels: self.browser.driver.execute_cdp_cmd(
            "Input.dispatchTouchEvent",
            {
                "type": kind,
                "touchPoints": [
                    dict(zip("xy", self.place_of(view, pixel)), id=finger) for finger, pixel in enumerate(pixels)
                ],
            },
        )
        for fingers in range(1, len(steps[0]) + 1):
            send("touchStart", steps[0][:fingers])
        for pixels in steps[1:]:
            send("touchMove", pixels)
        send("touchEnd", [])

    def pointer(self, kind, view, pixel, button="left", modifiers=0):
        place = self.place_of(view, pixel)
        self.browser.driver.execute_cdp_cmd(
            "Input.dispatchMouseEvent",
            {
                "type": kind,
                "x": place[0],
                "y": place[1],
                "button": button,
                "buttons": {"left": 1, "right": 2}[button] * (kind != "mouseReleased"),
                "clickCount": 1,
                "modifiers": modifiers,
            },
        )

    def drag(self, view, *pixels, **options):
        self.pointer("mousePressed", view, pixels[0], **options)
        for pixel in pixels[1:]:
            self.pointer("mouseMoved", view, pixel, **options)
        self.pointer("mouseReleased", view, pixels[-1], **options)

    def camera(self, view):
        return next(one["camera"] for one in self.about["views"] if one["name"] == view)

    def middle(self, pose):
        return at(pose, self.about["bones"][0]["middle_mm"])
