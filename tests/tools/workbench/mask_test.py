#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Masks that are painted on straightened images: a pipeline gets exactly the painted mask from the saved case."""
import subprocess

import numpy

import ct_cases
from bench import MARROW, main
from harness import formats
from xray_bench import HEIGHT, WIDTH, XrayTest, camera_matrices, read_png, write_png

SIZE = (40, 30, 40)
K1, K2 = 2.0, 6.0
PIPELINE = """marrow: 1
inputs: {case: {type: path, help: case}}
nodes: {case: {uses: read.case, with: {path: $case}}}
outputs: {view: case.views.frontal}
"""


def distorted(u, v):
    """The place in the original image of a pixel of the straightened one, by docs/method.md."""
    intrinsics, _, _ = camera_matrices(0, 0)
    x, y = (u - intrinsics[0, 2]) / intrinsics[0, 0], (v - intrinsics[1, 2]) / intrinsics[1, 1]
    square = x * x + y * y
    factor = 1 + K1 * square + K2 * square * square
    return intrinsics[0, 0] * factor * x + intrinsics[0, 2], intrinsics[1, 1] * factor * y + intrinsics[1, 2]


class DistortedMaskTest(XrayTest):
    def setUp(self):
        super().setUp()
        intrinsics, rotation, shift = camera_matrices(0, 0)
        placed = {
            "target": "camera",
            "source": "world",
            "rotation": rotation.tolist(),
            "translation_mm": shift.tolist(),
        }
        camera = {
            "width_px": WIDTH,
            "height_px": HEIGHT,
            "intrinsics": intrinsics.tolist(),
            "radial_distortion": [K1, K2, 0],
            "camera_from_world": placed,
        }
        self.views[0]["camera"] = camera
        values = ct_cases.two_balls(SIZE, (20, 15, 10), (20, 15, 30), 7)
        (self.folder / "scan.mha").write_bytes(formats.mha(formats.straight(SIZE), values))
        self.draft = {
            "ct": {"file": "scan.mha"},
            "views": self.views[:1],
            "fragments": {"distal": {"seeds": [[20, 15, 10]], "register": True}},
        }

    def mask_file(self):
        return self.document()["views"][0].get("mask")

    def painted(self):
        """The pixels over which the page shows the colour of the mask, as an image of truth values."""
        script = """
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
        return numpy.array(self.browser.js(script, WIDTH, HEIGHT)).reshape(HEIGHT, WIDTH) > 0

    def saved_mask(self):
        """Saves the case, and returns the mask of the view that read.case gives."""
        self.click('[data-do="save"]')
        self.wait_text("[data-saved]", "Saved in", 240)
        pipeline = self.scratch / "read.yaml"
        pipeline.write_text(PIPELINE)
        out = self.scratch / "out"
        command = [MARROW, "run", pipeline, "case=" + str(self.folder / "knee"), "--out", out]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=600)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return read_png(out / "outputs" / "view" / "mask.png")

    def test_what_is_painted_is_what_the_case_masks(self):
        v, u = numpy.mgrid[:HEIGHT, :WIDTH].astype(float)
        seen_u, seen_v = distorted(u, v)
        self.assertGreater(numpy.hypot(seen_u - u, seen_v - v).max(), 15, "the distortion is strong")
        self.begin(self.draft)
        self.tool("rectangle")
        self.drag_pixel("frontal", [30, 40], [80, 70])
        self.until(lambda: self.mask_file() is not None, "no mask")
        first = self.mask_file()
        self.tool("brush")
        self.drag_pixel("frontal", [220, 200], [290, 200])
        self.until(lambda: self.mask_file() != first, "the stroke was not kept")
        wanted = (u > 30.5) & (u < 79.5) & (v > 40.5) & (v < 69.5)
        away = numpy.hypot(u - numpy.clip(u, 220, 290), v - 200)
        inside = (seen_u >= 0) & (seen_v >= 0) & (seen_u <= WIDTH - 1) & (seen_v <= HEIGHT - 1)
        masked = self.saved_mask() == 0
        missed = numpy.argwhere((wanted | (away < 9.9)) & ~masked)
        self.assertEqual(missed.tolist(), [], "all that was painted is masked")
        near = (u >= 29) & (u <= 81) & (v >= 39) & (v <= 71) | (away < 11.5)
        self.assertFalse((masked & inside & ~near).any(), "nothing else is masked")
        self.no_faults()

    def test_the_page_shows_the_mask_of_the_case(self):
        """A mask that was drawn elsewhere, on the image as its file has it."""
        stored = numpy.full((HEIGHT, WIDTH), 255)
        stored[20:90, 200:300] = 0
        write_png(self.folder / "drawn.png", stored, 8)
        self.draft["views"][0]["mask"] = "drawn.png"
        self.begin(self.draft)
        self.until(lambda: self.painted().any(), "no mask is shown")
        painted = self.painted()
        v, u = numpy.mgrid[:HEIGHT, :WIDTH].astype(float)
        seen_u, seen_v = distorted(u, v)
        self.assertTrue(painted[(seen_u > 201) & (seen_u < 298) & (seen_v > 21) & (seen_v < 88)].all())
        self.assertFalse(painted[(seen_u > 1) & (seen_u < 198) & (seen_v > 1) & (seen_v < HEIGHT - 2)].any())
        self.assertTrue((painted == (self.saved_mask() == 0)).all(), "it shows what a pipeline gets")

    def test_erasing_all_of_it_takes_the_mask_away(self):
        self.begin(self.draft)
        self.tool("brush")
        self.drag_pixel("frontal", [100, 100], [110, 100])
        self.until(lambda: self.mask_file() is not None, "no mask")
        self.tool("eraser")
        self.browser.js(
            "const size = document.querySelector('[data-do=brush-size]'); size.value = 80;"
            " size.dispatchEvent(new Event('input'))"
        )
        self.drag_pixel("frontal", [95, 100], [115, 100])
        self.until(lambda: self.mask_file() is None, "the mask is still there")


if __name__ == "__main__":
    main()
