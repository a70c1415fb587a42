#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Masks that are painted on X-rays by mouse and keys. Also on straightened images, a pipeline gets exactly the painted
mask from the saved case."""
import numpy
from selenium.webdriver.common.keys import Keys

from harness.page import main
from made_cases import HEIGHT, LOWER, WIDTH, camera, read_png, write_png, write_scan
from xray_bench import XrayPage

K1, K2 = 2.0, 6.0
PIPELINE = """marrow: 1
inputs: {case: {type: path, help: case}}
nodes: {case: {uses: read.case, with: {path: $case}}}
outputs: {view: case.views.frontal}
"""
PAINTED = """
    const canvas = document.querySelector('[data-view=frontal] canvas'), found = [];
    const [width, height] = arguments, zoom = Math.min(canvas.width / width, canvas.height / height);
    const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    for (let v = 0; v < height; ++v)
      for (let u = 0; u < width; ++u) {
        const x = Math.floor(canvas.width / 2 + zoom * (u - (width - 1) / 2));
        const y = Math.floor(canvas.height / 2 + zoom * (v - (height - 1) / 2));
        const at = 4 * (y * canvas.width + x);
        found.push(Math.abs(data[at] - data[at + 2]) > 40 ? 1 : 0);
      }
    return found;
"""
V, U = numpy.mgrid[:HEIGHT, :WIDTH].astype(float)


class MaskPage(XrayPage):
    def mask_file(self):
        return self.document()["views"][0].get("mask")

    def mask(self):
        return self.mask_file() and read_png(self.folder / self.mask_file())

    def masked(self):
        return self.until(self.mask_file, "no mask")

    def unmasked(self):
        self.until(lambda: self.mask_file() is None, "the mask is still there")


class MaskTest(MaskPage):
    def test_a_stroke_is_one_step_of_undo(self):
        self.begin()
        self.tool("brush")
        self.drag_pixel("frontal", [100, 100], [200, 100])
        self.masked()
        away = numpy.hypot(U - numpy.clip(U, 100, 200), V - 100)
        mask = self.mask()
        self.assertEqual(mask.shape, (HEIGHT, WIDTH))
        self.assertTrue((mask[away < 9.9] == 0).all())
        self.assertTrue((mask[away > 10.1] == 255).all())
        self.tool("eraser")
        self.drag_pixel("frontal", [150, 90], [150, 110])
        self.until(lambda: self.mask()[100, 150] == 255, "not erased")
        self.assertEqual(self.mask()[100, 110], 0)
        self.click('[data-do="undo"]')
        self.until(lambda: self.mask()[100, 150] == 0, "not undone")
        self.click('[data-do="undo"]')
        self.unmasked()
        self.tool("brush")
        self.drag_pixel("frontal", [100, 100], [110, 100])
        self.masked()
        self.tool("eraser")
        self.set("[data-do=brush-size]", 80, "input")
        self.drag_pixel("frontal", [95, 100], [115, 100])
        self.unmasked()
        self.no_faults()

    def test_a_box_and_a_brush_by_the_keyboard(self):
        self.begin()
        self.tool("rectangle")
        far, down = (Keys.SHIFT, Keys.ARROW_RIGHT), (Keys.SHIFT, Keys.ARROW_DOWN)
        self.keys("frontal", Keys.ENTER, far, far, far, down, Keys.ENTER)
        self.masked()
        expected = numpy.full((HEIGHT, WIDTH), 255)
        expected[120:131, 160:191] = 0
        self.assertTrue((self.mask() == expected).all())
        self.begin()
        self.tool("brush")
        self.keys("frontal", Keys.ENTER, far, far, far, far, Keys.ENTER)
        self.masked()
        self.assertEqual([int(self.mask()[120, u]) for u in (151, 180, 209, 214)], [0, 0, 0, 255])


class DistortedMaskTest(MaskPage):
    def setUp(self):
        """A view with a strong distortion; where the pixels of its straightened image are, by docs/method.md."""
        super().setUp()
        known = camera("frontal")
        placed = {"target": "camera", "source": "world", "matrix": known["camera_from_world"]}
        self.views = self.views[:1]
        self.views[0]["camera"] = {**known, "radial_distortion": [K1, K2, 0], "camera_from_world": placed}
        write_scan(self.folder)
        self.draft = {"ct": {"file": "scan.mha"}, "fragments": {"distal": {"seeds": [list(LOWER)], "register": True}}}
        (focal, _, u0), (_, _, v0), _ = known["intrinsics"]
        square = ((U - u0) ** 2 + (V - v0) ** 2) / focal**2
        factor = 1 + K1 * square + K2 * square * square
        self.seen_u, self.seen_v = factor * (U - u0) + u0, factor * (V - v0) + v0
        self.assertGreater(numpy.hypot(self.seen_u - U, self.seen_v - V).max(), 15, "the distortion is strong")

    def painted(self):
        """The pixels over which the page shows the colour of the mask, as an image of truth values."""
        return numpy.array(self.js(PAINTED, WIDTH, HEIGHT)).reshape(HEIGHT, WIDTH) > 0

    def saved_mask(self):
        """Saves the case, and returns the mask of the view that read.case gives."""
        self.click('[data-do="save"]')
        self.says("[data-saved]", "Saved in")
        pipeline, out = self.scratch / "read.yaml", self.scratch / "out"
        pipeline.write_text(PIPELINE)
        self.marrow("run", pipeline, "case=%s" % (self.folder / "mine"), "--out", out)
        return read_png(out / "outputs" / "view" / "mask.png")

    def test_what_is_painted_is_what_the_case_masks(self):
        self.begin(**self.draft)
        self.tool("rectangle")
        self.drag_pixel("frontal", [30, 40], [80, 70])
        first = self.masked()
        self.tool("brush")
        self.drag_pixel("frontal", [220, 200], [290, 200])
        self.until(lambda: self.mask_file() != first, "the stroke was not kept")
        wanted = (U > 30.5) & (U < 79.5) & (V > 40.5) & (V < 69.5)
        away = numpy.hypot(U - numpy.clip(U, 220, 290), V - 200)
        u, v = self.seen_u, self.seen_v
        inside = (u >= 0) & (v >= 0) & (u <= WIDTH - 1) & (v <= HEIGHT - 1)
        masked = self.saved_mask() == 0
        missed = numpy.argwhere((wanted | (away < 9.9)) & ~masked)
        self.assertEqual(missed.tolist(), [], "all that was painted is masked")
        near = (U >= 29) & (U <= 81) & (V >= 39) & (V <= 71) | (away < 11.5)
        self.assertFalse((masked & inside & ~near).any(), "nothing else is masked")
        self.no_faults()

    def test_the_page_shows_the_mask_of_the_case(self):
        """A mask that was drawn elsewhere, on the image as its file has it."""
        stored = numpy.full((HEIGHT, WIDTH), 255)
        stored[20:90, 200:300] = 0
        write_png(self.folder / "drawn.png", stored, 8)
        self.views[0]["mask"] = "drawn.png"
        self.begin(**self.draft)
        self.until(lambda: self.painted().any(), "no mask is shown")
        painted, u, v = self.painted(), self.seen_u, self.seen_v
        self.assertTrue(painted[(u > 201) & (u < 298) & (v > 21) & (v < 88)].all())
        self.assertFalse(painted[(u > 1) & (u < 198) & (v > 1) & (v < HEIGHT - 2)].any())
        self.assertTrue((painted == (self.saved_mask() == 0)).all(), "it shows what a pipeline gets")


if __name__ == "__main__":
    main(part=2)
