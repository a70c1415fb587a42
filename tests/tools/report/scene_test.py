#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The scene of the report's page in headless Chromium: what is drawn, and at which place of the X-ray image.

    tests/tools/report/scene_test.py     exit code 77: skipped, with the reason
"""
import sys

from harness import shapes
from harness.page import PageTest, run_tests

# The result's pixels of the drawn canvas: their bounds in pixels of the canvas, and how many they are.
COVERED = """
const scene = marrow.scene, gl = scene.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight;
scene.drawNow();
const pixels = new Uint8Array(4 * w * h);
gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
let [left, right, top, bottom, count] = [w, -1, h, -1, 0];
for (let y = 0; y < h; ++y) for (let x = 0; x < w; ++x) {
  const i = 4 * (y * w + x);
  if (!(%s)) continue;
  ++count;
  left = Math.min(left, x);
  right = Math.max(right, x);
  top = Math.min(top, h - 1 - y);
  bottom = Math.max(bottom, h - 1 - y);
}
return {left, right, top, bottom, count, w, h};
"""


class SceneTest(PageTest):
    def test_scene_is_drawn(self):
        self.browser.open(self.comparison)
        self.browser.show("scene")
        self.browser.wait("return !!marrow.scene && !!marrow.scene.renderer")
        bluish = COVERED % "pixels[i + 3] === 255 && pixels[i + 2] > pixels[i] + 25"
        self.browser.js("marrow.scene.planes = false")
        covered = self.browser.js(bluish)
        self.assertGreater(covered["count"], 0.02 * covered["w"] * covered["h"])
        self.browser.js("document.querySelector('canvas.scene').focus({preventScroll: true})")
        for _ in range(4):
            self.browser.key("-", "canvas.scene")
        self.assertLess(self.browser.js(bluish)["count"], 0.6 * covered["count"])
        self.browser.js("marrow.scene.shownPoses.result = marrow.scene.shownPoses.truth = false")
        self.assertEqual(self.browser.js(COVERED % "pixels[i + 3] > 0")["count"], 0)

    def test_look_through_is_aligned(self):
        self.browser.open(self.run_page)
        self.browser.show("scene")
        self.browser.wait(
            "return !!marrow.scene && !!marrow.scene.renderer && marrow.scene.views.every((view) =>"
            " view.quad.material.map.image)"
        )
        scene = next(iter(self.run_data["scenes"].values()))
        corners = [
            shapes.apply([scene["poses"][0]["world_from_model"][4 * i : 4 * i + 4] for i in range(4)], vertex)
            for vertex in shapes.cube()[0]
        ]
        for view in scene["views"]:
            self.browser.js(
                (
                    "marrow.scene.lookThrough(arguments[0]); marrow.scene.style.through = 'surface';"
                    " marrow.scene.imageOpacity = 0"
                ),
                view["name"],
            )
            at = [shapes.project(view, corner)[:2] for corner in corners]
            worst = max(
                abs(ours - given)
                for corner, pixel in zip(corners, at)
                for ours, given in zip(self.browser.js("return marrow.scene.pixelOf(arguments[0])", corner), pixel)
            )
            self.assertLess(worst, 0.01, "projection by three.js, px")
            for zoom in (1, 1.4):
                self.browser.js(
                    (
                        "marrow.scene.orbit.flat = {zoom: arguments[0], x: 0.1 * (arguments[0] - 1), y: -0.05 *"
                        " (arguments[0] - 1)}"
                    ),
                    zoom,
                )
                drawn = self.bounds(view, zoom, "pixels[i + 2] > 60")
                wanted = [min(u for u, _ in at), max(u for u, _ in at), min(v for _, v in at), max(v for _, v in at)]
                model = max(abs(a - b) for a, b in zip(drawn, wanted))
                self.assertLess(model, 0.5, "drawn model against its projection, px")
                self.browser.js("marrow.scene.modelOpacity = 0; marrow.scene.imageOpacity = 1")
                marks = self.bounds(view, zoom, "pixels[i] > 100")  # one white pixel a corner, which falls off linearly
                self.browser.js("marrow.scene.modelOpacity = 1; marrow.scene.imageOpacity = 0")
                reach = 1 - 100 / 255
                image = max(abs(a - round(b) - side) for a, b, side in zip(marks, wanted, (-reach, reach) * 2))
                self.assertLess(image, 0.5, "corners in the X-ray against their projection, px")
                self.browser.js("marrow.scene.style.through = 'outline'")
                lines = self.bounds(view, zoom, "pixels[i + 2] > 60")
                self.browser.js("marrow.scene.style.through = 'surface'")
                outline = max(abs(a - b) for a, b in zip(lines, wanted))
                self.assertLess(
                    outline, 1.0, "drawn outline against its projection, px"
                )  # the line is 1.8 canvas pixels thick
                print(
                    "look through %-8s zoom %.1f: projection %.2g px, drawn model %.2f px, outline %.2f px, X-ray"
                    " %.2f px" % (view["name"], zoom, worst, model, outline, image)
                )

    def bounds(self, view, zoom, condition):
        """Left, right, top, bottom of the drawn pixels that fulfil a condition, in pixels of the view's image."""
        found = self.browser.js(COVERED % condition)
        self.assertGreater(found["count"], 0)
        flat = self.browser.js("return marrow.scene.flat(arguments[0])", view)
        u = lambda x: (((2 * x / found["w"] - 1) - flat["x"]) / flat["sx"] + 1) / 2 * view["width_px"] - 0.5
        v = lambda y: (1 - ((1 - 2 * y / found["h"]) - flat["y"]) / flat["sy"]) / 2 * view["height_px"] - 0.5
        return [u(found["left"]), u(found["right"] + 1), v(found["top"]), v(found["bottom"] + 1)]


if __name__ == "__main__":
    sys.exit(run_tests(sys.argv[1:]))
