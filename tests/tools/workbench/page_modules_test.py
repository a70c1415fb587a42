#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Functions of the pages "Case" and "Place" by themselves: the greys of X-rays, sizes of pictures, what the costs and
the check of the cameras say. Expected values are written down or computed with numpy."""
import json

import numpy

from bench import PageTest, main
from harness.modules import modules
from xray_bench import ANGLES, ARM, HEIGHT, MODEL, SHIFT, WIDTH, camera_matrices, pixel

RANGES = """
    const image = {numbers: Uint16Array.from(given), width_px: 200, height_px: 200};
    return JSON.stringify(Picture.rangesOf(image));
    """


class ModulesTest(PageTest):
    def js(self, body, argument=None, **paths):
        """The value of a function's body. `paths` gives it modules of the page, and it calls its argument `given`."""
        scripts = modules(**paths)
        self.browser.driver.get("about:blank")
        return json.loads(
            self.browser.js(scripts + "const given = JSON.parse(arguments[0]);\n" + body, json.dumps(argument))
        )

    def test_the_window_is_that_of_the_body(self):
        """The collimator is 0, air is about 60000, and the body has 4000 to 30000."""
        random = numpy.random.default_rng(3)
        image = random.normal(60000, 200, (200, 200))
        image[60:140] = random.uniform(4000, 30000, (80, 200))
        image[:, :40] = image[:, 160:] = 0
        numbers = numpy.clip(numpy.round(image), 0, 65535).astype(int).ravel().tolist()
        ranges = self.js(RANGES, numbers, Picture="workbench/page/xray_picture.js")
        self.assertAlmostEqual(ranges["body"][0], 4000, delta=600)
        self.assertAlmostEqual(ranges["body"][1], 30000, delta=600)
        self.assertEqual(ranges["all"][0], 0)
        self.assertGreater(ranges["all"][1], 59000)

    def test_an_image_that_is_all_body_is_shown_whole(self):
        numbers = numpy.random.default_rng(4).integers(1000, 50000, 40000).tolist()
        ranges = self.js(RANGES, numbers, Picture="workbench/page/xray_picture.js")
        self.assertEqual(ranges["body"], ranges["all"])

    def test_thick_bone_is_no_collimator(self):
        """A dark limb in the middle, which no corner shows."""
        image = numpy.full((200, 200), 60000)
        image[:, 60:140] = numpy.linspace(5000, 30000, 80)
        image[:, 60:90] = 5000
        ranges = self.js(RANGES, image.ravel().tolist(), Picture="workbench/page/xray_picture.js")
        self.assertEqual(ranges["body"][0], 5000)
        self.assertLess(ranges["body"][1], 31000)

    def test_equalised_contrast_is_the_same_in_dark_and_bright_regions(self):
        """Sixteen greys on a dark and on a bright half."""
        random = numpy.random.default_rng(5)
        grey = numpy.where(numpy.arange(128) < 64, 30, 200) + random.integers(0, 16, (128, 128))
        shown = self.js(
            "return JSON.stringify([...Equalise.equalised(Uint8Array.from(given), 128, 128)])",
            grey.ravel().tolist(),
            Equalise="workbench/page/xray_equalise.js",
        )
        shown = numpy.array(shown).reshape(128, 128)
        for columns in (slice(8, 56), slice(72, 120)):
            self.assertGreater(shown[:, columns].std(), 2.5 * grey[:, columns].std())

    def test_a_picture_keeps_its_size_against_its_frame(self):
        got = self.js(
            """
            const port = Viewport.zoomed(Viewport.fitted(200, 100, 400, 400), 3, [200, 200]);
            const wide = Viewport.resized(port, 800, 400), back = Viewport.resized(wide, 400, 400);
            const ct = {size: [40, 30, 20], spacing_mm: [1, 1, 2], origin_mm: [0, 0, 0],
                        direction: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]};
            const plane = Slices.planes(ct).axial, whole = Slices.whole(ct, plane, 400, 400);
            const small = Slices.resized(ct, plane, whole, 200, 300);
            return JSON.stringify([port.zoom, wide.zoom, back.zoom, whole.scale, small.scale]);
            """,
            Viewport="workbench/page/viewport.js",
            Slices="workbench/page/slice_geometry.js",
        )
        self.assertEqual(got, [6, 12, 6, 10, 5], "3 times the whole image stays 3 times the whole image")

    def test_pictures_are_arranged_as_large_as_possible(self):
        for count, aspect, size, columns in ((2, 1, (400, 800), 1), (2, 1, (800, 400), 2), (4, 1, (800, 800), 2)):
            got = self.js(
                "return JSON.stringify(Tiles.columnsFor(...given))",
                [count, aspect, *size],
                Tiles="workbench/page/tiles.js",
            )
            self.assertEqual(got, {"columns": columns, "is_scrolled": False})
        got = self.js("return JSON.stringify(Tiles.columnsFor(20, 1, 430, 600))", Tiles="workbench/page/tiles.js")
        self.assertEqual(got, {"columns": 2, "is_scrolled": True})

    def test_costs_are_in_the_order_of_the_case_and_against_the_best(self):
        views = [str(number) for number in range(1, 12)]
        cost = lambda value: {"value": value, "views": {name: value for name in sorted(views)}}
        costs = lambda value: {"bone": {"contour": cost(value), "grey_values": cost(value)}}
        got = self.js(
            """
            const table = document.createElement('table'), steps = given.steps.map((costs) => ({costs}));
            Costs.fill(table, given.now, 'bone', steps, given.views);
            const fill = table.querySelector('[data-cost=contour] .cost-fill');
            return JSON.stringify([[...table.querySelectorAll('tbody th')].map((one) => one.textContent),
              table.querySelector('[data-cost=contour] small').textContent, fill.style.width]);
            """,
            {"steps": [costs(4), costs(2)], "now": costs(3), "views": views},
            Costs="workbench/page/place_costs.js",
        )
        self.assertEqual(got, [["all views", *views], "1.50 × the best", "75%"])

    def test_a_small_probability_is_not_nothing(self):
        got = self.js(
            "return JSON.stringify(given.map(Verdict.failureText))",
            [0, 0.0004, 0.0523, 0.4, 1],
            Verdict="workbench/page/place_verdict.js",
        )
        self.assertEqual(got, ["less than 0.1 %", "less than 0.1 %", "5.2 %", "40 %", "more than 99.9 %"])

    def advice(self, typed_mm):
        """What the check says if these sizes of a pixel were typed; the true one is 1 mm."""
        views = []
        for name, angles in ANGLES.items():
            intrinsics, rotation, shift = camera_matrices(*angles)
            motion = numpy.eye(4)
            motion[:3, :3], motion[:3, 3] = rotation, shift
            intrinsics[:2, :2] /= typed_mm[name]
            camera = {
                "intrinsics": intrinsics.tolist(),
                "camera_from_world": motion.tolist(),
                "width_px": WIDTH,
                "height_px": HEIGHT,
            }
            view = {"name": name, "camera": {"c_arm": {**ARM, "pixel_mm": typed_mm[name]}}}
            views.append({"view": view, "camera": camera})
        landmarks = [
            {
                "name": name,
                "model_mm": place,
                "pixels": {view: pixel(view, numpy.array(place) + SHIFT).tolist() for view in ANGLES},
            }
            for name, place in MODEL.items()
        ]
        return self.js(
            "return JSON.stringify(Size.advice(...given))", [views, landmarks], Size="workbench/page/xray_pixel_size.js"
        )

    def test_the_pixel_size_that_makes_the_views_agree(self):
        self.assertEqual(self.advice({"frontal": 1.0, "lateral": 1.0}), "")
        both = self.advice({"frontal": 0.5, "lateral": 0.5})
        self.assertIn(
            "With pixels of 1.00 mm instead of 0.5 mm in frontal and 1.00 mm instead of 0.5 mm in lateral", both
        )
        one = self.advice({"frontal": 1.0, "lateral": 0.7})
        self.assertIn("With pixels of 1.00 mm instead of 0.7 mm in lateral it would be 0.0 mm", one)
        self.assertNotIn("frontal", one)

    def test_what_a_case_lacks(self):
        draft = {"is_saved": False, "document": {"fragments": {"distal": {"seeds": []}}, "views": [{"name": "a"}]}}
        got = self.js(
            "return JSON.stringify(Steps.STEPS.map(({lacks}) => lacks(given)))",
            draft,
            Steps="workbench/page/case_steps.js",
        )
        self.assertEqual(got, ["no CT yet", "no seed in distal", "no camera: a", "needs X-rays", "not saved yet"])


if __name__ == "__main__":
    main(part=2)
