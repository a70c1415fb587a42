#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""X-rays in the page "Case" by clicks and keys: views are added and checked, landmarks marked and fitted, and seeds,
landmarks and starts read from files."""
import json
import struct

import numpy
from selenium.webdriver.common.keys import Keys

from bench import BenchTest
from harness import formats
from harness.page import main
from made_cases import ARM, BETA_DEG, HEIGHT, MODEL, SHIFT, WIDTH, camera, pixel, ray, shadow, write_png
from xray_bench import XrayPage

MATRIX = [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]


class ViewsTest(XrayPage):
    def test_views_are_added_by_clicks(self):
        self.begin(views=[])
        self.click('[data-do="add-view"]')
        self.click('[data-choose="frontal.png"]')
        self.click('[data-camera="file"]')
        self.click('[data-choose="frontal.camera.yaml"]')
        self.find('[data-view-row="frontal"]')
        self.click('[data-do="add-view"]')
        self.click('[data-choose="lateral.png"]')
        for key, value in {"alpha_deg": 0, "beta_deg": 90, **ARM}.items():
            self.fill('[data-arm="%s"]' % key, str(value))
        self.click('[data-camera="c_arm"]')
        self.find('[data-view-row="lateral"]')
        frontal = {"name": "frontal", "image": "frontal.png", "camera": {"file": "frontal.camera.yaml"}}
        self.assertEqual(self.document()["views"], [frontal, self.views[1]])
        self.says("[data-figures]", "90.0°")
        self.says("[data-figures]", "(0.0, 0.0, 0.0) mm in the world; they pass each other at 0.000 mm")
        self.says("[data-figures]", "600 mm")
        self.says("[data-good]", "No fault was found in these cameras.")
        self.says("[data-check] code", "check-cameras.yaml")
        self.no_faults()

    def test_nothing_is_filled_in_that_nobody_gave(self):
        self.begin(views=[])
        self.click('[data-do="add-view"]')
        self.click('[data-choose="frontal.png"]')
        self.find('[data-arm="pixel_mm"]')
        self.assertEqual(self.all("[data-arm]", "one.value"), [""] * 5)
        self.assertEqual(self.the(".add-view .fault", "getComputedStyle(one).display"), "none")
        self.find('[data-arm="pixel_mm"]').send_keys("12")
        self.says("#arm-pixel_mm.odd", "12 is unusual; usual are 0.1 to 0.6")

    def test_views_are_renamed_moved_and_removed(self):
        self.begin(landmarks=[{"name": "tip", "pixels": {"frontal": [1, 2], "lateral": [3, 4]}}])
        self.click('[data-view-row="frontal"] [data-do="down"]')
        names = lambda document: [one["name"] for one in document["views"]]
        self.saved_when(lambda document: names(document) == ["lateral", "frontal"])
        self.click('[data-view-row="frontal"] [data-do="rename"]')
        self.fill("dialog input", "lateral" + Keys.ENTER)
        self.assertEqual(self.text("dialog .fault"), "The name “lateral” is taken.")
        self.fill("dialog input", "oblique" + Keys.ENTER)
        self.find('[data-view-row="oblique"]')
        self.assertEqual(self.pixels("tip"), {"oblique": [1, 2], "lateral": [3, 4]})
        self.click('[data-view-row="lateral"] [data-do="remove"]')
        self.saved_when(lambda document: len(document["views"]) == 1)
        self.assertEqual(self.pixels("tip"), {"oblique": [1, 2]})

    def test_what_is_wrong_is_said(self):
        write_png(self.folder / "small.png", shadow("frontal")[::2, ::2])
        write_png(self.folder / "inverted.png", 20000 - shadow("lateral"))
        (self.folder / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n?")
        frontal, lateral = (view["camera"] for view in self.views)
        images = {"small": "small", "inverted": "inverted", "broken": "broken", "twice": "frontal", "twin": "frontal"}
        self.begin(
            views=[
                {"name": name, "image": image + ".png", "camera": lateral if name == "inverted" else frontal}
                for name, image in images.items()
            ]
        )
        self.says('[data-fault-of="small"]', "160 x 120")
        self.says('[data-fault-of="small"]', "320 x 240")
        self.says('[data-fault-of="inverted"]', "is bone bright here?")
        self.says('[data-fault-of="broken"]', "broken.png")
        self.says("[data-warning]", "views 'twice' and 'twin' look along nearly the same line")
        self.assertEqual(self.count('[data-fault-of="twice"]'), 0)

    def test_values_and_keys(self):
        """Values and places under the pointer, and keys that zoom, mirror, change the window and move the image."""
        self.begin()
        image, read = shadow("frontal"), '[data-value-of="frontal"]'
        for at in ([0, 0], [160, 120], [319, 239], [100, 200]):
            self.browser.mouse("mouseMoved", self.place("frontal", at))
            self.says(read, "(%.1f, %.1f) px: %d" % (*at, image[at[1], at[0]]))
        self.no_faults()
        left, top, width, height = self.box("frontal")
        centre = [left + width / 2, top + height / 2]
        self.keys("frontal", "+", "+", "m")
        self.browser.mouse("mouseMoved", centre)
        self.says(read, "(159.5, 119.5) px")
        zoom = min(width / WIDTH, height / HEIGHT) * 1.25**2
        self.browser.mouse("mouseMoved", [centre[0] + 10 * zoom, centre[1]])
        self.says(read, "(149.5, 119.5) px")  # to the right is to the left: it is mirrored
        grey = lambda: self.the(
            "[data-view=frontal] canvas",
            "one.getContext('2d').getImageData(one.width / 2, one.height / 2, 1, 1).data[0]",
        )
        before = grey()
        self.keys("frontal", *["L"] * 5)
        self.until(lambda: grey() > before + 20, "the image did not become brighter")
        self.keys("frontal", Keys.ARROW_RIGHT)
        self.browser.mouse("mouseMoved", centre)
        self.until(lambda: "(159.5" not in self.text(read), "the image did not move")


class LandmarksTest(XrayPage):
    def test_two_clicks_give_a_place(self):
        self.begin()
        self.tool("landmark")
        world = numpy.array(MODEL["a"]) + SHIFT
        self.click_pixel("frontal", pixel("frontal", world))
        self.find('[data-view="lateral"] [data-from="frontal"]')  # the epipolar line
        self.click_pixel("lateral", pixel("lateral", world))
        self.until(lambda: len(self.pixels("point 1")) == 2, "not marked")
        cell = '[data-landmark-row="point 1"] [data-cell="%s"]'
        self.says(cell % "seen", "lateral")
        found = numpy.array([float(one) for one in self.text(cell % "world").split(", ")])
        self.assertLess(numpy.abs(found - world).max(), 0.02)
        for view in BETA_DEG:
            self.assertLess(numpy.abs(self.pixels("point 1")[view] - pixel(view, world)).max(), 0.01)
        # A tenth of a pixel by the keyboard, then a whole one and ten.
        before = self.pixels("point 1")["lateral"]
        self.keys("lateral", (Keys.ALT, Keys.ARROW_UP), (Keys.SHIFT, Keys.ARROW_LEFT), Keys.ARROW_DOWN)
        expected = [before[0] - 10, before[1] + 0.9]
        self.until(lambda: numpy.allclose(self.pixels("point 1")["lateral"], expected), "not moved by keys")
        moved = {"frontal": self.pixels("point 1")["frontal"], "lateral": expected}
        (a, along_a), (b, along_b) = (ray(camera(view), at) for view, at in moved.items())
        normal = numpy.cross(along_a, along_b)
        distance_mm = abs((b - a) @ normal) / numpy.linalg.norm(normal)
        self.assertGreater(distance_mm, 0.2)
        self.says(cell % "rays", "%.3f" % distance_mm)
        self.click('[data-do="undo"]')
        self.until(lambda: self.pixels("point 1")["lateral"] == before, "not undone in one step")
        self.no_faults()

    def test_errors_are_live_while_a_mark_is_dragged(self):
        marks = {view: list(pixel(view, numpy.zeros(3))) for view in BETA_DEG}
        self.begin(landmarks=[{"name": "tip", "pixels": marks, "note": "kept"}])
        self.tool("landmark")
        u, v = marks["lateral"]
        a, b = (self.place("lateral", at) for at in ([u, v], [u, v + 8]))
        rays = '[data-landmark-row="tip"] [data-cell="rays"]'
        self.says(rays, "0.000")
        self.browser.mouse("mouseMoved", a)
        self.browser.mouse("mousePressed", a, 1)
        self.browser.mouse("mouseMoved", b, 1)
        self.says(rays, "4.8")  # 8 px, each 600/1000 mm at the isocentre
        self.assertEqual(self.pixels("tip"), marks)
        self.browser.mouse("mouseReleased", b)
        self.until(lambda: abs(self.pixels("tip")["lateral"][1] - v - 8) < 0.05, "not kept")
        self.assertEqual(self.landmark("tip")["note"], "kept")

    def test_by_the_keyboard_alone(self):
        self.begin()
        self.tool("landmark")
        self.keys("frontal", Keys.ENTER, Keys.ARROW_RIGHT, (Keys.SHIFT, Keys.ARROW_DOWN), Keys.ENTER)
        self.until(lambda: self.landmark("point 1"), "not placed")
        self.assertEqual(self.pixels("point 1"), {"frontal": [161, 130]})
        self.keys("frontal", Keys.DELETE)
        self.until(lambda: self.pixels("point 1") == {}, "not taken out")

    def landmarks(self, mirrored=None):
        def seen(view, place):
            u, v = pixel(view, place + SHIFT)
            return [WIDTH - 1 - u if view == mirrored else u, v]

        return [
            {"name": name, "model_mm": place, "pixels": {view: seen(view, place) for view in BETA_DEG}}
            for name, place in MODEL.items()
        ]

    def test_the_pose_of_landmarks_becomes_the_start(self):
        self.begin(landmarks=self.landmarks(), fragments={"distal": {"seeds": [[0, 0, 0]], "register": True}})
        self.says("[data-fit]", "Fitted pose: 0.000 px")
        self.click('[data-do="use-as-start"]')
        distal = self.saved_when(lambda document: "start" in document["fragments"]["distal"])["fragments"]["distal"]
        expected = numpy.eye(4)
        expected[:3, 3] = SHIFT
        self.assertLess(numpy.abs(numpy.array(distal["start"]) - expected).max(), 0.01)
        self.assertEqual(distal["seeds"], [[0, 0, 0]])
        self.no_faults()

    def test_a_mirrored_image_and_too_few_landmarks_are_noticed(self):
        self.begin(landmarks=self.landmarks(mirrored="lateral"))
        self.says("[data-fit]", "the image of 'lateral' seems to be mirrored")
        self.begin(landmarks=self.landmarks()[:2])
        self.says("[data-fit]", "if two views show three")
        self.assertFalse(self.find('[data-do="use-as-start"]').is_enabled())


class ExchangeTest(XrayPage):
    def test_landmarks_come_back_from_a_file(self):
        marked = [{"name": "tip", "model_mm": [1, 2, 3], "pixels": {"frontal": [10.5, 20]}}]
        self.begin(landmarks=marked, fragments={"distal": {"seeds": [[1, 1, 1]]}})
        self.click('[data-export="landmarks"]')
        self.find("dialog input").send_keys(Keys.ENTER)
        self.says(".notice", "Written: mine.landmarks.yaml")
        self.click('[data-landmark-row="tip"] [aria-label="Remove tip"]')
        self.saved_when(lambda document: document["landmarks"] == [])
        self.click('[data-import="landmarks"]')
        self.click('[data-choose="mine.landmarks.yaml"]')
        document = self.saved_when(lambda document: document["landmarks"])
        self.assertEqual(document["landmarks"], [{**marked[0], "fragment": "distal"}])

    def test_seeds_and_starts_come_from_files(self):
        seeds = "marrow-seeds: 1\nfragments:\n  proximal: {seeds: [[1, 2, 3]], register: false}\n"
        (self.folder / "s.yaml").write_text(seeds)
        (self.folder / "p.yaml").write_text("marrow-pose: 1\ntarget: world\nsource: ct\nmatrix: %s\n" % MATRIX)
        self.begin()
        for what, name in (("seeds", "s.yaml"), ("pose", "p.yaml")):
            self.click('[data-import="%s"]' % what)
            self.click('[data-choose="%s"]' % name)
            self.says(".notice", "read from " + name)
        wanted = {"proximal": {"seeds": [[1, 2, 3]], "register": False, "start": MATRIX}}
        self.assertEqual(self.document()["fragments"], wanted)


def dicom(orientation=None, flip=None, angles=None):
    """An X-ray image of 6 x 4 pixels."""
    elements = {(8, 0x16): ("UI", "1.2.840.10008.5.1.4.1.1.12.1"), (8, 0x60): ("CS", "XA")}
    if angles:
        elements.update({(0x18, 0x1510): ("DS", str(angles[0])), (0x18, 0x1511): ("DS", str(angles[1]))})
    if flip:
        elements[0x18, 0x7034] = ("CS", flip)
    if orientation:
        elements[0x20, 0x20] = ("CS", orientation)
    return formats.dicom(6, 4, struct.pack("<24H", *range(1000, 1024)), elements)


class RequestTest(BenchTest):
    def warnings(self, camera=None, **header):
        """About an X-ray that may be mirrored."""
        (self.folder / "a.dcm").write_bytes(dicom(**header))
        arm = {"alpha_deg": 0, "beta_deg": 0, **ARM}
        camera = camera or {"width_px": 6, "height_px": 4, "c_arm": arm}
        about, _ = self.server.bytes("/api/xray/view", {"image": "a.dcm", "camera": camera})
        self.assertNotIn("fault", about)
        return about["warnings"]

    def test_whether_it_is_mirrored_is_what_the_header_says(self):
        self.enter()
        self.assertEqual(self.warnings(), [])
        self.assertEqual(self.warnings(flip="NO"), [])
        self.assertEqual(self.warnings(orientation="R\\F"), [])
        self.assertEqual(self.warnings(orientation="L\\F", angles=(0, 0)), [], "it is mirrored back")
        (flipped,) = self.warnings(flip="YES")
        self.assertIn("was flipped left to right after it was taken", flipped)
        (mirrored,) = self.warnings(orientation="L\\F")
        by = "is mirrored: by its header (PatientOrientation (0020,0020)) the patient's left is on the right"
        self.assertIn(by, mirrored)
        arm = {"alpha_deg": 0, "beta_deg": 0, **ARM}
        text = {"marrow-camera": 1, "width_px": 6, "height_px": 4, "c_arm": arm}
        (self.folder / "c.yaml").write_text(json.dumps(text))
        (unknown,) = self.warnings(camera={"file": "c.yaml"}, orientation="L\\F")
        self.assertIn("whether it is mirrored is not known", unknown)

    def test_faults_of_files_and_masks_are_told(self):
        server = self.enter()
        (self.folder / "s.yaml").write_text("marrow-seeds: 2\n")
        for path, fault in (
            ("s.yaml", "this program reads version 1, the file is of version 2"),
            ("../s.yaml", "leads out of the folder that is open"),
        ):
            self.assertIn(fault, server.fault("/api/xray/import?what=seeds&path=" + path))
        for path, fault in (
            ("a.txt", "'a.txt': the name must end in one of .yaml, .mrk.json, .fcsv"),
            ("no/s.yaml", "'no/s.yaml': there is no such folder; make it first"),
        ):
            content = {"fragments": {"distal": {"seeds": [[1, 2, 3]]}}}
            asked = {"what": "seeds", "path": path, "content": content}
            self.assertEqual(server.fault("/api/xray/export", asked), fault)
        fault = server.fault("/api/xray/mask", {"width_px": 10, "height_px": 4, "runs": [10, 20]})
        self.assertEqual(fault, "the mask does not fill its image of 10 x 4 pixels")


if __name__ == "__main__":
    main(part=5)
