#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""X-rays in the page "Case" by clicks and keys: views are added and checked, landmarks marked and fitted, masks
painted, files exchanged."""
import json

import numpy
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from bench import main
from xray_bench import ANGLES, ARM, HEIGHT, MODEL, SHIFT, WIDTH, XrayTest, pixel, ray, read_png, shadow, write_png


class ViewsTest(XrayTest):
    def test_views_are_added_by_clicks(self):
        self.begin()
        self.click('[data-do="add-view"]')
        self.click('[data-choose="frontal.png"]')
        self.click('[data-camera="file"]')
        self.click('[data-choose="frontal.camera.yaml"]')
        self.find('[data-view-row="frontal"]')
        self.click('[data-do="add-view"]')
        self.click('[data-choose="lateral.png"]')
        for key, value in {"alpha_deg": 0, "beta_deg": 90, **ARM}.items():
            box = self.find('[data-arm="%s"]' % key)
            box.clear()
            box.send_keys(str(value))
        self.click('[data-camera="c_arm"]')
        self.find('[data-view-row="lateral"]')
        self.assertEqual(
            self.document()["views"],
            [
                {"name": "frontal", "image": "frontal.png", "camera": {"file": "frontal.camera.yaml"}},
                {
                    **self.views[1],
                    "camera": {**self.views[1]["camera"], "c_arm": {"alpha_deg": 0, "beta_deg": 90, **ARM}},
                },
            ],
        )
        self.wait_text("[data-figures]", "90.0°")
        self.wait_text("[data-figures]", "(0.0, 0.0, 0.0) mm in the world; they pass each other at 0.000 mm")
        self.wait_text("[data-figures]", "600 mm")
        self.wait_text("[data-good]", "No fault was found in these cameras.")
        self.wait_text("[data-check] code", "check-cameras.yaml")
        self.no_faults()

    def test_views_are_renamed_moved_and_removed(self):
        self.begin(
            {"views": self.views, "landmarks": [{"name": "tip", "pixels": {"frontal": [1, 2], "lateral": [3, 4]}}]}
        )
        self.click('[data-view-row="frontal"] [data-do="down"]')
        self.until(lambda: [one["name"] for one in self.document()["views"]] == ["lateral", "frontal"], "not moved")
        self.click('[data-view-row="frontal"] [data-do="rename"]')
        box = self.find("dialog input")
        box.clear()
        box.send_keys("lateral", Keys.ENTER)
        self.assertEqual(self.text("dialog .fault"), "The name “lateral” is taken.")
        box.clear()
        box.send_keys("oblique", Keys.ENTER)
        self.find('[data-view-row="oblique"]')
        self.assertEqual(self.landmark("tip")["pixels"], {"oblique": [1, 2], "lateral": [3, 4]})
        self.click('[data-view-row="lateral"] [data-do="remove"]')
        self.until(lambda: len(self.document()["views"]) == 1, "not removed")
        self.assertEqual(self.landmark("tip")["pixels"], {"oblique": [1, 2]})

    def test_what_is_wrong_is_said(self):
        write_png(self.folder / "small.png", shadow("frontal")[::2, ::2])
        write_png(self.folder / "inverted.png", 20000 - shadow("lateral"))
        (self.folder / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n?")
        camera = self.views[0]["camera"]
        views = [
            {"name": "small", "image": "small.png", "camera": camera},
            {"name": "inverted", "image": "inverted.png", "camera": self.views[1]["camera"]},
            {"name": "broken", "image": "broken.png", "camera": camera},
            {"name": "twice", "image": "frontal.png", "camera": camera},
            {"name": "twin", "image": "frontal.png", "camera": camera},
        ]
        self.begin({"views": views})
        self.wait_text('[data-fault-of="small"]', "160 x 120")
        self.wait_text('[data-fault-of="small"]', "320 x 240")
        self.wait_text('[data-fault-of="inverted"]', "is bone bright here?")
        self.wait_text('[data-fault-of="broken"]', "broken.png")
        self.wait_text("[data-warning]", "views 'twice' and 'twin' look along nearly the same line")
        self.assertEqual(self.driver.find_elements(By.CSS_SELECTOR, '[data-fault-of="twice"]'), [])


class FrameTest(XrayTest):
    def test_values_and_places_under_the_pointer(self):
        self.begin({"views": self.views})
        image = shadow("frontal")
        for at in ([0, 0], [160, 120], [319, 239], [100, 200]):
            self.mouse("mouseMoved", self.place("frontal", at))
            self.wait_text('[data-value-of="frontal"]', "(%.1f, %.1f) px: %d" % (*at, image[at[1], at[0]]))
        self.no_faults()

    def test_keys_zoom_window_and_mirror(self):
        self.begin({"views": self.views})
        self.place("frontal", [0, 0])
        centre = self.browser.js(
            "const r = document.querySelector('[data-view=frontal]').getBoundingClientRect();"
            " return [r.left + r.width / 2, r.top + r.height / 2]"
        )
        self.keys("frontal", "+", "+", "m")
        self.mouse("mouseMoved", centre)
        self.wait_text('[data-value-of="frontal"]', "(159.5, 119.5) px")
        _, (_, _, width, height) = self.box("frontal")
        zoom = min(width / WIDTH, height / HEIGHT) * 1.25**2
        self.mouse("mouseMoved", [centre[0] + 10 * zoom, centre[1]])
        self.wait_text('[data-value-of="frontal"]', "(149.5, 119.5) px")  # to the right is to the left: it is mirrored
        grey = lambda: self.browser.js(
            "const c = document.querySelector('[data-view=frontal] canvas');"
            " return c.getContext('2d').getImageData(c.width / 2, c.height / 2, 1, 1).data[0]"
        )
        before = grey()
        self.keys("frontal", *["L"] * 5)
        self.until(lambda: grey() > before + 20, "the image did not become brighter")
        self.keys("frontal", Keys.ARROW_RIGHT)
        self.mouse("mouseMoved", centre)
        self.until(lambda: "(159.5" not in self.text('[data-value-of="frontal"]'), "the image did not move")


class LandmarksTest(XrayTest):
    def test_two_clicks_give_a_place(self):
        self.begin({"views": self.views})
        self.tool("landmark")
        world = numpy.array(MODEL["a"]) + SHIFT
        self.click_pixel("frontal", pixel("frontal", world))
        self.find('[data-view="lateral"] [data-from="frontal"]')  # the epipolar line
        self.click_pixel("lateral", pixel("lateral", world))
        self.until(lambda: len((self.landmark("point 1") or {}).get("pixels", {})) == 2, "not marked")
        row = '[data-landmark-row="point 1"] '
        self.wait_text(row + '[data-cell="seen"]', "lateral")
        found = numpy.array([float(one) for one in self.text(row + '[data-cell="world"]').split(", ")])
        self.assertLess(numpy.abs(found - world).max(), 0.02)
        for view in ANGLES:
            self.assertLess(numpy.abs(self.landmark("point 1")["pixels"][view] - pixel(view, world)).max(), 0.01)
        # A tenth of a pixel by the keyboard, then a whole one and ten.
        before = self.landmark("point 1")["pixels"]["lateral"]
        self.keys("lateral", (Keys.ALT, Keys.ARROW_UP), (Keys.SHIFT, Keys.ARROW_LEFT), Keys.ARROW_DOWN)
        expected = [before[0] - 10, before[1] + 0.9]
        self.until(lambda: numpy.allclose(self.landmark("point 1")["pixels"]["lateral"], expected), "not moved by keys")
        moved = {"frontal": self.landmark("point 1")["pixels"]["frontal"], "lateral": expected}
        (a, along_a), (b, along_b) = (ray(view, at) for view, at in moved.items())
        normal = numpy.cross(along_a, along_b)
        distance_mm = abs((b - a) @ normal) / numpy.linalg.norm(normal)
        self.assertGreater(distance_mm, 0.2)
        self.wait_text(row + '[data-cell="rays"]', "%.3f" % distance_mm)
        self.click('[data-do="undo"]')
        self.until(lambda: self.landmark("point 1")["pixels"]["lateral"] == before, "not undone in one step")
        self.no_faults()

    def test_errors_are_live_while_a_mark_is_dragged(self):
        marks = {view: list(pixel(view, numpy.zeros(3))) for view in ANGLES}
        other = {"name": "tip", "pixels": marks, "note": "kept"}
        self.begin({"views": self.views, "landmarks": [other]})
        self.tool("landmark")
        a, b = (self.place("lateral", at) for at in (marks["lateral"], [marks["lateral"][0], marks["lateral"][1] + 8]))
        rays = '[data-landmark-row="tip"] [data-cell="rays"]'
        self.wait_text(rays, "0.000")
        self.mouse("mouseMoved", a)
        self.mouse("mousePressed", a, 1)
        self.mouse("mouseMoved", b, 1)
        self.wait_text(rays, "4.8")  # 8 px, each 600/1000 mm at the isocentre
        self.assertEqual(self.landmark("tip")["pixels"], marks)
        self.mouse("mouseReleased", b)
        self.until(
            lambda: abs(self.landmark("tip")["pixels"]["lateral"][1] - marks["lateral"][1] - 8) < 0.05, "not kept"
        )
        self.assertEqual(self.landmark("tip")["note"], "kept")

    def test_by_the_keyboard_alone(self):
        self.begin({"views": self.views})
        self.tool("landmark")
        self.keys("frontal", Keys.ENTER, Keys.ARROW_RIGHT, (Keys.SHIFT, Keys.ARROW_DOWN), Keys.ENTER)
        self.until(lambda: self.landmark("point 1"), "not placed")
        self.assertEqual(self.landmark("point 1")["pixels"], {"frontal": [161, 130]})
        self.keys("frontal", Keys.DELETE)
        self.until(lambda: self.landmark("point 1")["pixels"] == {}, "not taken out")

    def landmarks(self, mirrored=None):
        def seen(view, place):
            at = pixel(view, numpy.array(place) + SHIFT)
            return [WIDTH - 1 - at[0] if view == mirrored else at[0], at[1]]

        return [
            {"name": name, "model_mm": place, "pixels": {view: seen(view, place) for view in ANGLES}}
            for name, place in MODEL.items()
        ]

    def test_the_pose_of_landmarks_becomes_the_start(self):
        fragments = {"distal": {"seeds": [[0, 0, 0]], "register": True}}
        self.begin({"views": self.views, "landmarks": self.landmarks(), "fragments": fragments})
        self.wait_text("[data-fit]", "Fitted pose: 0.000 px")
        self.click('[data-do="use-as-start"]')
        self.until(lambda: "start" in self.document()["fragments"]["distal"], "there is no start")
        start = numpy.array(self.document()["fragments"]["distal"]["start"])
        expected = numpy.eye(4)
        expected[:3, 3] = SHIFT
        self.assertLess(numpy.abs(start - expected).max(), 0.01)
        self.assertEqual(self.document()["fragments"]["distal"]["seeds"], [[0, 0, 0]])
        self.no_faults()

    def test_a_mirrored_image_is_noticed(self):
        self.begin({"views": self.views, "landmarks": self.landmarks(mirrored="lateral")})
        self.wait_text("[data-fit]", "the image of 'lateral' seems to be mirrored")

    def test_too_few_landmarks(self):
        self.begin({"views": self.views, "landmarks": self.landmarks()[:2]})
        self.wait_text("[data-fit]", "if two views show three")
        self.assertFalse(self.find('[data-do="use-as-start"]').is_enabled())


class MasksTest(XrayTest):
    def mask(self, view="frontal"):
        path = next(one for one in self.document()["views"] if one["name"] == view).get("mask")
        return path and read_png(self.folder / path)

    def test_a_stroke_is_one_step_of_undo(self):
        self.begin({"views": self.views})
        self.tool("brush")
        self.drag_pixel("frontal", [100, 100], [200, 100])
        self.until(lambda: self.mask() is not None, "no mask")
        v, u = numpy.mgrid[:HEIGHT, :WIDTH]
        away = numpy.hypot(u - numpy.clip(u, 100, 200), v - 100)
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
        self.until(lambda: self.mask() is None, "the first stroke was not undone")
        self.no_faults()

    def test_a_box_by_the_keyboard(self):
        self.begin({"views": self.views})
        self.tool("rectangle")
        self.keys(
            "frontal", Keys.ENTER, *[(Keys.SHIFT, Keys.ARROW_RIGHT)] * 3, (Keys.SHIFT, Keys.ARROW_DOWN), Keys.ENTER
        )
        self.until(lambda: self.mask() is not None, "no mask")
        expected = numpy.full((HEIGHT, WIDTH), 255)
        expected[120:131, 160:191] = 0
        self.assertTrue((self.mask() == expected).all())

    def test_a_brush_by_the_keyboard(self):
        self.begin({"views": self.views})
        self.tool("brush")
        self.keys("frontal", Keys.ENTER, *[(Keys.SHIFT, Keys.ARROW_RIGHT)] * 4, Keys.ENTER)
        self.until(lambda: self.mask() is not None, "no mask")
        self.assertEqual([int(self.mask()[120, u]) for u in (151, 180, 209, 214)], [0, 0, 0, 255])

    def test_what_does_not_fill_the_image_is_refused(self):
        server = self.open()
        server.enter()
        body = {"width_px": 10, "height_px": 4, "runs": [10, 20]}
        status, _, text = server.ask("POST", "/api/xray/mask", body)
        self.assertEqual(status, 400)
        self.assertEqual(json.loads(text)["error"], "the mask does not fill its image of 10 x 4 pixels")


class ExchangeTest(XrayTest):
    def test_landmarks_come_back_from_a_file(self):
        marked = [{"name": "tip", "model_mm": [1, 2, 3], "pixels": {"frontal": [10.5, 20]}}]
        self.begin({"views": self.views, "landmarks": marked, "fragments": {"distal": {"seeds": [[1, 1, 1]]}}})
        self.click('[data-export="landmarks"]')
        self.find("dialog input").send_keys(Keys.ENTER)
        self.wait_text(".notice", "Written: knee.landmarks.yaml")
        self.click('[data-landmark-row="tip"] [aria-label="Remove tip"]')
        self.until(lambda: self.document()["landmarks"] == [], "not removed")
        self.click('[data-import="landmarks"]')
        self.click('[data-choose="knee.landmarks.yaml"]')
        self.until(lambda: self.document()["landmarks"], "not imported")
        self.assertEqual(self.document()["landmarks"], [{**marked[0], "fragment": "distal"}])

    def test_seeds_and_starts_come_from_files(self):
        (self.folder / "s.yaml").write_text(
            "marrow-seeds: 1\nfragments:\n  proximal: {seeds: [[1, 2, 3]], register: false}\n"
        )
        matrix = [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]
        (self.folder / "p.yaml").write_text("marrow-pose: 1\ntarget: world\nsource: ct\nmatrix: %s\n" % matrix)
        self.begin({"views": self.views})
        for what, name in (("seeds", "s.yaml"), ("pose", "p.yaml")):
            self.click('[data-import="%s"]' % what)
            self.click('[data-choose="%s"]' % name)
            self.wait_text(".notice", "read from " + name)
        self.assertEqual(
            self.document()["fragments"], {"proximal": {"seeds": [[1, 2, 3]], "register": False, "start": matrix}}
        )

    def test_faults_of_files_are_told(self):
        server = self.open()
        server.enter()
        (self.folder / "s.yaml").write_text("marrow-seeds: 2\n")
        status, _, text = server.ask("GET", "/api/xray/import?what=seeds&path=s.yaml")
        self.assertEqual(status, 400)
        self.assertIn("this program reads version 1, the file is of version 2", json.loads(text)["error"])
        for path, fault in {
            "a.txt": "'a.txt': the name must end in one of .yaml, .mrk.json, .fcsv",
            "no/s.yaml": "'no/s.yaml': there is no such folder; make it first",
        }.items():
            content = {"fragments": {"distal": {"seeds": [[1, 2, 3]]}}}
            status, _, text = server.ask(
                "POST", "/api/xray/export", {"what": "seeds", "path": path, "content": content}
            )
            self.assertEqual((status, json.loads(text)["error"]), (400, fault))
        status, _, text = server.ask("GET", "/api/xray/import?what=seeds&path=../s.yaml")
        self.assertIn("leads out of the folder that is open", json.loads(text)["error"])


if __name__ == "__main__":
    main()
