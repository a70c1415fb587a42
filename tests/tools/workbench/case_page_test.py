#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A case made on the page "Case" from a DICOM series: CT, seeds, landmarks, segmentation and saving, by clicks and by
keys. Its X-ray views are in the draft from the beginning."""
import os
import re
import subprocess

import yaml

import bench
import ct_cases
from bench import MARROW, SOURCE, PageTest
from harness import formats

SIZE = (40, 36, 44)
LOWER, UPPER = (20, 18, 11), (20, 18, 32)
NASTY = "<b>tip</b>"
# Whether an outline in the colour of the first fragment is in the axial slice.
OUTLINED = """
  const canvas = document.querySelector('[data-slice="axial"]'), {width, height} = canvas;
  const {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    count += Math.hypot(data[i] - 0x56, data[i + 1] - 0xb4, data[i + 2] - 0xe9) < 40;
  return count > 300;"""


class CasePageTest(PageTest):
    def setUp(self):
        super().setUp()
        self.values = ct_cases.two_balls(SIZE, LOWER, UPPER, 8)
        formats.dicom_series(self.folder / "scan", SIZE, self.values, patient="DOE^JANE")
        (self.folder / "front.png").write_bytes(formats.png(64, 64, [128] * 4096))

    def begin(self, **document):
        """A server whose draft of the case 'mine' has one view."""
        first = self.open()
        first.enter()
        view = {"name": "frontal", "image": "front.png", "camera": ct_cases.CAMERA}
        document = {"ct": None, "views": [view], "fragments": {}, "landmarks": [], **document}
        first.json("POST", "/api/draft/change", {"case": "mine", "revision": 0, "what": "x", "document": document})
        first.close()
        server = self.open()
        self.show(server, "case=mine")
        return server

    def panel(self, title):
        return 'section[aria-label="%s"] ' % title

    def wait(self, condition):
        self.browser.wait("return " + condition, 240)

    def type_name(self, panel, name):
        self.find_in_sight(self.panel(panel) + 'input[type="text"]').send_keys(name + "\n")
        self.wait("document.querySelector(%r).textContent.includes(%r)" % (self.panel(panel), name))

    def choose_series(self):
        self.click('[data-do="choose-ct"]')
        self.click('#dialog [data-open="scan"]')
        self.click('#dialog [data-choose="scan"]')
        self.wait_for_slices()

    def click_voxel(self, name, right, down, counts):
        """Clicks the middle of a voxel. counts: how many voxels the whole slice has to the right and down."""
        from selenium.webdriver import ActionChains

        canvas = self.find_in_sight('[data-slice="%s"]' % name)
        box = self.browser.js("const r = arguments[0].getBoundingClientRect(); return [r.width, r.height]", canvas)
        scale = min(box[0] / counts[0], box[1] / counts[1])
        x, y = ((at + 0.5 - count / 2) * scale for at, count in zip((right, down), counts))
        ActionChains(self.browser.driver, duration=0).move_to_element_with_offset(
            canvas, round(x), round(y)
        ).click().perform()

    def click_axial(self, index):
        self.go_to_slice("axial", index[2])
        self.click_voxel("axial", index[0], index[1], SIZE[:2])

    def add_seed(self, fragment, index):
        self.click('[data-tool="seed %s"]' % fragment)
        before = len(self.document()["fragments"][fragment]["seeds"])
        self.click_axial(index)
        seeds = self.saved_when(lambda document: len(document["fragments"][fragment]["seeds"]) > before)
        self.click('[data-tool="seed %s"]' % fragment)
        return seeds["fragments"][fragment]["seeds"][-1]

    def test_a_case_by_clicks_that_marrow_reads(self):
        self.begin()
        self.choose_series()
        self.assertNotIn("DOE", self.browser.js("return document.body.textContent"))
        for name in ("distal", "proximal"):
            self.type_name("Fragments", name)
        for name, index in (("distal", LOWER), ("proximal", UPPER)):
            seed = self.add_seed(name, index)
            for k in range(3):
                self.assertAlmostEqual(seed[k], index[k], delta=0.15)
        self.click('[data-fragment="proximal"] input[type="checkbox"]')
        self.saved_when(lambda document: document["fragments"]["proximal"]["register"] is False)
        self.type_name("Landmarks in the CT", NASTY)
        self.click('[data-landmark="%s"] [data-tool]' % NASTY)
        self.click_axial((15, 18, 11))
        self.saved_when(lambda document: "model_mm" in document["landmarks"][0])
        self.find('[data-landmark="%s"] select' % NASTY).send_keys("distal")
        self.saved_when(lambda document: document["landmarks"][0].get("fragment") == "distal")

        self.click('[data-do="segment"]')
        self.wait("!!document.querySelector('[data-segmented=\"full\"]')")
        text = self.find("[data-segmented]").text
        volume_ml = float(re.search(r"distal ([\d.]+) ml", text).group(1))
        self.assertAlmostEqual(volume_ml, 4 / 3 * 3.1416 * 8**3 / 1000, delta=0.35)
        self.wait("Number(document.querySelector('canvas.surface').dataset.triangles) > 100")
        self.browser.wait(OUTLINED)

        self.click('[data-do="save"]')
        self.wait("!!document.querySelector('[data-saved] .command')")
        case = self.folder / "mine"
        written = yaml.safe_load((case / "case.yaml").read_text())
        self.assertEqual((written["ct"], written["fragments"]["proximal"]["register"]), ("ct", False))
        marks = yaml.safe_load((case / "landmarks.yaml").read_text())
        self.assertEqual(list(marks["fragments"]["distal"]["points"]), [NASTY])
        self.assertEqual(self.browser.js("return document.querySelectorAll('main b').length"), 0)
        self.assertEqual(self.find_in_sight("[data-ct]").text, "mine/ct")
        self.assertEqual(self.browser.js(OUTLINED), True, "the copied CT is the same, so what is shown stays")
        commands = self.find_in_sight("[data-saved]").text
        self.assertIn("pipelines/bone/bone.yaml case=%s" % case.resolve(), commands)
        environment = {**os.environ, "MARROW_CACHE": str(self.scratch / "store")}
        arguments = ["run", SOURCE / "pipelines/workbench/segment-bone.yaml", "case=%s" % case]
        ended = subprocess.run(
            [MARROW, *arguments, "--out", self.scratch / "out"], capture_output=True, text=True, env=environment
        )
        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertEqual([], [line for line in self.browser.driver.get_log("browser") if line["level"] == "SEVERE"])

    def with_ct(self, **more):
        fragments = {"distal": {"seeds": [[20, 18, 11]], "register": True}}
        server = self.begin(ct={"file": "scan"}, fragments=fragments, **more)
        self.wait_for_slices()
        return server

    def press(self, name, *keys):
        canvas = self.find('[data-slice="%s"]' % name)
        self.browser.js("arguments[0].focus()", canvas)
        canvas.send_keys(*keys)

    def crosshair(self):
        text = self.browser.js("return document.querySelector('[data-read=\"crosshair\"]').textContent")
        return [float(part) for part in re.search(r": (.*) mm", text).group(1).split(", ")]

    def test_by_keys_alone(self):
        from selenium.webdriver.common.keys import Keys

        self.with_ct()
        x, y, z = self.crosshair()
        self.press("axial", Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_DOWN, Keys.PAGE_UP)
        self.assertEqual(self.crosshair(), [x + 2, y + 1, z + 1])
        self.press("coronal", Keys.ARROW_UP, Keys.PAGE_UP)
        self.assertEqual(self.crosshair(), [x + 2, y + 2, z + 2])
        self.press("sagittal", Keys.ARROW_LEFT, Keys.SHIFT + Keys.PAGE_DOWN)
        self.assertEqual(self.crosshair(), [x - 8, y + 1, z + 2])
        self.find_in_sight('[data-tool="seed distal"]')
        self.browser.js("document.querySelector('[data-tool=\"seed distal\"]').focus()")
        self.find('[data-tool="seed distal"]').send_keys(Keys.ENTER)
        self.press("axial", Keys.ENTER)
        seeds = self.saved_when(lambda document: len(document["fragments"]["distal"]["seeds"]) == 2)
        self.assertEqual(seeds["fragments"]["distal"]["seeds"][1], [x - 8, y + 1, z + 2])
        self.press("axial", Keys.DELETE)
        self.saved_when(lambda document: len(document["fragments"]["distal"]["seeds"]) == 1)
        self.press("axial", Keys.ESCAPE)
        self.wait("document.querySelector('.tool-hint').textContent === ''")
        self.wait("[...document.querySelectorAll('input.short')].some((one) => one.value === '1800')")
        self.press("axial", "w")  # a wider window
        self.wait("[...document.querySelectorAll('input.short')].some((one) => one.value === '1980')")

    def test_seeds_are_moved_and_undone(self):
        from selenium.webdriver import ActionChains

        self.with_ct()
        self.click('[aria-label$="go to seed 1 of distal"]')
        self.wait("document.querySelector('[data-slice=axial]').dataset.shown === '11'")
        canvas = self.find_in_sight('[data-slice="axial"]')
        scale = self.browser.js("return arguments[0].clientWidth", canvas) / 40
        chain = ActionChains(self.browser.driver, duration=0)
        start = [(at + 0.5 - count / 2) * scale for at, count in zip(LOWER, SIZE[:2])]
        chain.move_to_element_with_offset(canvas, round(start[0]), round(start[1])).click_and_hold()
        chain.move_by_offset(round(2 * scale), 0).move_by_offset(round(scale), 0).release().perform()
        moved = self.saved_when(lambda document: document["fragments"]["distal"]["seeds"][0][0] > 21)
        self.assertAlmostEqual(moved["fragments"]["distal"]["seeds"][0][0], 23, delta=0.2)
        self.wait("document.querySelector('[data-do=undo]').title === 'Undo: move a seed of distal'")
        self.click('[data-do="undo"]')
        self.saved_when(lambda document: document["fragments"]["distal"]["seeds"] == [[20, 18, 11]])

    def test_pixels_of_a_landmark_stay_when_its_place_in_the_ct_goes(self):
        pixels = {"frontal": [12.5, 13]}
        self.with_ct(landmarks=[{"name": "tip", "model_mm": [20, 18, 11], "pixels": pixels}])
        self.click('[aria-label="Remove tip in the CT"]')
        document = self.saved_when(lambda document: "model_mm" not in document["landmarks"][0])
        self.assertEqual(document["landmarks"], [{"name": "tip", "pixels": pixels}])

    def test_a_ct_that_cannot_be_read_is_said_on_the_page(self):
        (self.folder / "scan" / "slice7-107.dcm").write_bytes(b"damaged")
        self.begin(ct={"file": "scan"})
        self.wait("!!document.querySelector('.ct-panel div > .fault')")
        self.assertIn("slice7-107.dcm", self.find_in_sight(".ct-panel div > .fault").text)
        self.assertEqual(self.browser.js("return document.querySelector('.ct-options').open"), True)

    def test_of_several_series_one_is_chosen(self):
        formats.dicom_series(self.folder / "scan", (20, 20, 20), 8000 * [-1000], series="8")
        self.begin(ct={"file": "scan"})
        self.wait("document.querySelectorAll('[data-series]').length === 2")
        self.click('[data-series="1.2.826.0.1.3680043.2.1143.8.2"]')
        self.wait_for_slices()
        self.assertIn("20 × 20 × 20 voxels", self.find(".ct-panel").text)
        self.assertEqual(self.document()["ct"]["series_uid"], "1.2.826.0.1.3680043.2.1143.8.2")

    def test_faults_of_saving_are_listed(self):
        self.begin()
        self.click('[data-do="save"]')
        self.wait("document.querySelectorAll('[data-saved] li').length === 2")
        self.assertEqual(
            self.browser.js("return [...document.querySelectorAll('[data-saved] li')].map((one) => one.textContent)"),
            [
                "the CT is missing; choose one",
                "there is no fragment; add one, with its seeds, its label or its surface",
            ],
        )

    def test_comments_that_would_go_are_shown_before(self):
        ct = formats.mha(formats.straight(SIZE), self.values)
        (self.folder / "scan.mha").write_bytes(ct)
        self.begin(ct={"file": "scan.mha"}, fragments={"distal": {"seeds": [list(LOWER)], "register": True}})
        self.click('[data-do="save"]')
        self.wait("document.querySelector('[data-saved]').textContent.includes('Saved in')")
        file = self.folder / "mine" / "case.yaml"
        kept = "# mine\n" + re.sub("(name: .*)", r"\1   # the first", file.read_text())
        file.write_text(kept)
        self.click('[data-do="save"]')
        self.wait("document.querySelector('[data-saved]').textContent.includes('Saved in')")
        self.assertEqual(file.read_text(), kept, "nothing changed, so nothing is asked")
        self.click('[data-view-row="frontal"] [data-do="rename"]')
        self.wait("document.querySelector('dialog[open] input') !== null")
        self.browser.js(
            "const box = document.querySelector('dialog input'); box.value = 'oblique'; box.form.requestSubmit();"
        )
        self.wait("document.querySelector('[data-view-row=oblique]') !== null")
        for answer, is_saved in (("do-not-save", False), ("save-without", True)):
            self.wait("!document.querySelector('[data-do=save]').disabled")
            self.click('[data-do="save"]')
            self.wait("document.querySelector('dialog[open] [data-lost]') !== null")
            self.assertEqual(self.find("[data-lost]").text, "# the first")
            self.click('#dialog [data-do="%s"]' % answer)
            self.wait("!document.getElementById('dialog').open")
            if is_saved:
                self.wait("document.querySelector('[data-do=save]').textContent === 'Save again'")
            self.assertEqual("oblique" in file.read_text(), is_saved)
        self.assertTrue(file.read_text().startswith("# mine\n"))

    def test_nothing_is_cut_off_at_any_width(self):
        server = self.with_ct()
        for width_px in (1440, 1024, 400):
            self.show(server, "case=mine", width_px=width_px)
            self.wait_for_slices()
            self.assertLessEqual(self.browser.js("return document.documentElement.scrollWidth - innerWidth"), 0)
            unnamed = self.browser.js(
                """return [...document.querySelectorAll('main button, main input, main select, main canvas')].filter(
                  (one) => !one.closest('[hidden]') && !one.textContent.trim() && !one.getAttribute('aria-label') &&
                    !(one.labels && one.labels.length)).map((one) => one.outerHTML)"""
            )
            self.assertEqual(unnamed, [])


if __name__ == "__main__":
    bench.main()
