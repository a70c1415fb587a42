#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Functions of the pages "Case" and "Place" by themselves: the greys of X-rays, sizes of pictures, what the costs and
the check of the cameras say. Expected values are written down or computed with numpy."""
import unittest

import numpy

from harness.modules import value
from made_cases import ARM, BETA_DEG, MODEL, SHIFT, camera, pixel


class ModulesTest(unittest.TestCase):
    def ranges(self, image):
        """The windows for an image of 200 x 200 pixels."""
        numbers = numpy.clip(numpy.round(image), 0, 65535).astype(int).ravel().tolist()
        return value(
            "Picture.rangesOf({numbers: Uint16Array.from(given), width_px: 200, height_px: 200})",
            numbers,
            Picture="workbench/page/xray_picture.js",
        )

    def test_the_window_is_that_of_the_body(self):
        """The collimator is 0, air is about 60000, and the body has 4000 to 30000."""
        random = numpy.random.default_rng(3)
        image = random.normal(60000, 200, (200, 200))
        image[60:140] = random.uniform(4000, 30000, (80, 200))
        image[:, :40] = image[:, 160:] = 0
        ranges = self.ranges(image)
        self.assertAlmostEqual(ranges["body"][0], 4000, delta=600)
        self.assertAlmostEqual(ranges["body"][1], 30000, delta=600)
        self.assertEqual(ranges["all"][0], 0)
        self.assertGreater(ranges["all"][1], 59000)
        ranges = self.ranges(numpy.random.default_rng(4).integers(1000, 50000, 40000))
        self.assertEqual(ranges["body"], ranges["all"], "an image that is all body is shown whole")
        limb = numpy.full((200, 200), 60000)  # dark, in the middle, which no corner shows: thick bone is no collimator
        limb[:, 60:140] = numpy.linspace(5000, 30000, 80)
        limb[:, 60:90] = 5000
        low, high = self.ranges(limb)["body"]
        self.assertEqual(low, 5000)
        self.assertLess(high, 31000)

    def test_equalised_contrast_is_the_same_in_dark_and_bright_regions(self):
        """Sixteen greys on a dark and on a bright half."""
        random = numpy.random.default_rng(5)
        grey = numpy.where(numpy.arange(128) < 64, 30, 200) + random.integers(0, 16, (128, 128))
        equalised = "[...Equalise.equalised(Uint8Array.from(given), 128, 128)]"
        shown = value(equalised, grey.ravel().tolist(), Equalise="workbench/page/xray_equalise.js")
        shown = numpy.array(shown).reshape(128, 128)
        for columns in (slice(8, 56), slice(72, 120)):
            self.assertGreater(shown[:, columns].std(), 2.5 * grey[:, columns].std())

    def test_a_picture_keeps_its_size_against_its_frame(self):
        got = value(
            """(() => {
              const port = Viewport.zoomed(Viewport.fitted(200, 100, 400, 400), 3, [200, 200]);
              const wide = Viewport.resized(port, 800, 400), back = Viewport.resized(wide, 400, 400);
              const ct = {size: [40, 30, 20], spacing_mm: [1, 1, 2], origin_mm: [0, 0, 0],
                          direction: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]};
              const plane = Slices.planes(ct).axial, whole = Slices.whole(ct, plane, 400, 400);
              const small = Slices.resized(ct, plane, whole, 200, 300);
              return [port.zoom, wide.zoom, back.zoom, whole.scale, small.scale];
            })()""",
            Viewport="workbench/page/viewport.js",
            Slices="workbench/page/slice_geometry.js",
        )
        self.assertEqual(got, [6, 12, 6, 10, 5], "3 times the whole image stays 3 times the whole image")

    def test_pictures_are_arranged_as_large_as_possible(self):
        sizes = [(2, 1, 400, 800), (2, 1, 800, 400), (4, 1, 800, 800), (20, 1, 430, 600)]
        got = value("given.map((one) => Tiles.columnsFor(...one))", sizes, Tiles="workbench/page/tiles.js")
        found = [(one["columns"], one["is_scrolled"]) for one in got]
        self.assertEqual(found, [(1, False), (2, False), (2, False), (2, True)])

    def test_a_small_probability_is_not_nothing(self):
        got = value(
            "given.map(Verdict.failureText)", [0, 0.0004, 0.0523, 0.4, 1], Verdict="workbench/page/place_verdict.js"
        )
        self.assertEqual(got, ["less than 0.1 %", "less than 0.1 %", "5.2 %", "40 %", "more than 99.9 %"])

    def advice(self, **typed_mm):
        """What the check says if these sizes of a pixel were typed; the true one is 1 mm."""
        views = [
            {"view": {"name": name, "camera": {"c_arm": {**ARM, "pixel_mm": size_mm}}}, "camera": camera(name, size_mm)}
            for name, size_mm in typed_mm.items()
        ]
        landmarks = [
            {
                "name": name,
                "model_mm": place,
                "pixels": {view: pixel(view, place + SHIFT).tolist() for view in BETA_DEG},
            }
            for name, place in MODEL.items()
        ]
        return value("Size.advice(...given)", [views, landmarks], Size="workbench/page/xray_pixel_size.js")

    def test_the_pixel_size_that_makes_the_views_agree(self):
        self.assertEqual(self.advice(frontal=1.0, lateral=1.0), "")
        both = "With pixels of 1.00 mm instead of 0.5 mm in frontal and 1.00 mm instead of 0.5 mm in lateral"
        self.assertIn(both, self.advice(frontal=0.5, lateral=0.5))
        one = self.advice(frontal=1.0, lateral=0.7)
        self.assertIn("With pixels of 1.00 mm instead of 0.7 mm in lateral it would be 0.0 mm", one)
        self.assertNotIn("frontal", one)

    def test_what_a_case_lacks(self):
        draft = {"is_saved": False, "document": {"fragments": {"distal": {"seeds": []}}, "views": [{"name": "a"}]}}
        lacks = "Steps.STEPS.map(({lacks}) => lacks(given))"
        got = value(lacks, draft, Steps="workbench/page/case_steps.js")
        self.assertEqual(got, ["no CT yet", "no seed in distal", "no camera: a", "needs X-rays", "not saved yet"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
