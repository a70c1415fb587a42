#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A case made on the page "Case": CT, label map or surfaces, seeds, landmarks, segmentation and saving, by clicks and
keys. Its X-ray views are in the draft from the beginning."""
import math
import re

import yaml
from selenium.webdriver import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

import made_cases
from bench import PageTest
from ct_requests_test import LABELS
from harness import SOURCE, formats
from harness.page import main
from made_cases import LOWER, RADIUS, SIZE, UPPER, point_of, write_scan

NASTY = "<b>tip</b>"
BLUE = (0x56, 0xB4, 0xE9)  # of the first fragment
# How many pixels of the axial slice have about this colour.
COUNTED = """
  const canvas = document.querySelector('[data-slice="axial"]'), {width, height} = canvas;
  const {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    count += Math.hypot(...[0, 1, 2].map((k) => data[i + k] - arguments[0][k])) < arguments[1];
  return count;"""


class CasePage(PageTest):
    def setUp(self):
        super().setUp()
        self.volume = made_cases.two_balls()
        formats.dicom_series(self.folder / "scan", SIZE, self.volume, patient="DOE^JANE")
        (self.folder / "front.png").write_bytes(formats.png(64, 64, [128] * 4096))

    def begin(self, **document):
        """The page of the case 'mine', whose draft has one view."""
        view = {"name": "frontal", "image": "front.png", "camera": made_cases.CAMERA}
        self.enter().change({"ct": None, "views": [view], "fragments": {}, "landmarks": [], **document})
        self.show("case=mine")

    def with_ct(self, **more):
        fragments = {"distal": {"seeds": [list(LOWER)], "register": True}}
        self.begin(ct={"file": "scan"}, fragments=fragments, **more)
        self.wait_for_slices()

    def wait_for_slices(self):
        """Waits until all three slices of a CT are drawn."""
        slices = "[...document.querySelectorAll('[data-slice]')]"
        self.wait("%s.length === 3 && %s.every((one) => one.dataset.shown)" % (slices, slices))

    def go_to_slice(self, name, number):
        self.set('input[aria-label="%s slice"]' % name, number, "input")
        self.wait("document.querySelector('[data-slice=%s]').dataset.shown === '%d'" % (name, number))

    def choose(self, what, name):
        self.click('[data-do="choose-%s"]' % what)
        self.click('#dialog [data-choose="%s"]' % name)

    def segmented(self):
        """What is said when it is done."""
        self.click('[data-do="segment"]')
        text = self.find('[data-segmented="full"]').text
        return text

    def save(self):
        self.click('[data-do="save"]')
        self.wait("/Saved in|Not saved/.test(document.querySelector('[data-saved]').textContent)")
        return self.in_sight("[data-saved]").text

    def written(self):
        return yaml.safe_load((self.folder / "mine" / "case.yaml").read_text())

    def coloured(self, colour, near, most):
        self.until(lambda: self.js(COUNTED, colour, near) > most, "the colour is not there")

    def no_severe_faults(self):
        """Requests that the page gave up do not count."""
        log = self.driver.get_log("browser")
        self.assertEqual([], [line for line in log if line["level"] == "SEVERE" and line["source"] != "network"])

    def click_voxel(self, name, at, counts):
        """Clicks the middle of a voxel of a slice of so many voxels to the right and down."""
        canvas = self.in_sight('[data-slice="%s"]' % name)
        _, _, width, height = self.browser.box('[data-slice="%s"]' % name)
        scale = min(width / counts[0], height / counts[1])
        x, y = ((place + 0.5 - count / 2) * scale for place, count in zip(at, counts))
        chain = ActionChains(self.driver, duration=0)
        chain.move_to_element_with_offset(canvas, round(x), round(y)).click().perform()

    def press_in(self, name, *keys):
        canvas = self.find('[data-slice="%s"]' % name)
        self.js("arguments[0].focus()", canvas)
        canvas.send_keys(*keys)

    def crosshair(self):
        """What the page says of the crosshair: ([mm], HU)."""
        numbers = re.findall(r"-?[\d.]+(?=,| mm| HU)", self.text('[data-read="crosshair"]').split(":")[-1])
        return [float(one) for one in numbers[:3]], [int(one) for one in numbers[3:]]


class SeedsTest(CasePage):
    def type_name(self, panel, name):
        panel = 'section[aria-label="%s"]' % panel
        self.in_sight(panel + ' input[type="text"]').send_keys(name + "\n")
        self.says(panel, name)

    def click_axial(self, index):
        self.go_to_slice("axial", index[2])
        self.click_voxel("axial", index[:2], SIZE[:2])

    def add_seed(self, fragment, index):
        seeds = lambda document: document["fragments"][fragment]["seeds"]
        self.click('[data-tool="seed %s"]' % fragment)
        before = len(seeds(self.server.draft()["document"]))
        self.click_axial(index)
        document = self.saved_when(lambda document: len(seeds(document)) > before)
        self.click('[data-tool="seed %s"]' % fragment)
        return seeds(document)[-1]

    def test_a_case_by_clicks_that_marrow_reads(self):
        self.begin()
        self.click('[data-do="choose-ct"]')
        self.click('#dialog [data-open="scan"]')
        self.click('#dialog [data-choose="scan"]')
        self.wait_for_slices()
        self.assertNotIn("DOE", self.text("body"))
        for name in ("distal", "proximal"):
            self.type_name("Fragments", name)
        for name, index in (("distal", LOWER), ("proximal", UPPER)):
            for found, wanted in zip(self.add_seed(name, index), index):
                self.assertAlmostEqual(found, wanted, delta=0.15)
        self.click('[data-fragment="proximal"] input[type="checkbox"]')
        self.saved_when(lambda document: document["fragments"]["proximal"]["register"] is False)
        self.type_name("Landmarks in the CT", NASTY)
        self.click('[data-landmark="%s"] [data-tool]' % NASTY)
        self.click_axial((15, 18, 11))
        self.saved_when(lambda document: "model_mm" in document["landmarks"][0])
        self.find('[data-landmark="%s"] select' % NASTY).send_keys("distal")
        self.saved_when(lambda document: document["landmarks"][0].get("fragment") == "distal")

        volume_ml = float(re.search(r"distal ([\d.]+) ml", self.segmented()).group(1))
        self.assertAlmostEqual(volume_ml, 4 / 3 * 3.1416 * 8**3 / 1000, delta=0.35)
        self.wait("Number(document.querySelector('canvas.surface').dataset.triangles) > 100")
        self.coloured(BLUE, 40, 300)

        self.save()
        self.find("[data-saved] .command")
        case = self.folder / "mine"
        written = self.written()
        self.assertEqual((written["ct"], written["fragments"]["proximal"]["register"]), ("ct", False))
        marks = yaml.safe_load((case / "landmarks.yaml").read_text())
        self.assertEqual(list(marks["fragments"]["distal"]["points"]), [NASTY])
        self.assertEqual(self.count("main b"), 0)
        self.assertEqual(self.in_sight("[data-ct]").text, "mine/ct")
        self.assertGreater(self.js(COUNTED, BLUE, 40), 300, "the copied CT is the same, so what is shown stays")
        self.assertIn("pipelines/bone/bone.yaml case=%s" % case.resolve(), self.in_sight("[data-saved]").text)
        pipeline = SOURCE / "pipelines/workbench/segment-bone.yaml"
        self.marrow("run", pipeline, "case=%s" % case, "--out", self.scratch / "out")
        self.assertEqual([], [line for line in self.driver.get_log("browser") if line["level"] == "SEVERE"])

    def test_by_keys_alone(self):
        self.with_ct()
        place = lambda: self.crosshair()[0]
        x, y, z = place()
        self.press_in("axial", Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_DOWN, Keys.PAGE_UP)
        self.assertEqual(place(), [x + 2, y + 1, z + 1])
        self.press_in("coronal", Keys.ARROW_UP, Keys.PAGE_UP)
        self.assertEqual(place(), [x + 2, y + 2, z + 2])
        self.press_in("sagittal", Keys.ARROW_LEFT, Keys.SHIFT + Keys.PAGE_DOWN)
        self.assertEqual(place(), [x - 8, y + 1, z + 2])
        tool = self.in_sight('[data-tool="seed distal"]')
        self.js("arguments[0].focus()", tool)
        tool.send_keys(Keys.ENTER)
        self.press_in("axial", Keys.ENTER)
        seeds = lambda document: document["fragments"]["distal"]["seeds"]
        document = self.saved_when(lambda document: len(seeds(document)) == 2)
        self.assertEqual(seeds(document)[1], [x - 8, y + 1, z + 2])
        self.press_in("axial", Keys.DELETE)
        self.saved_when(lambda document: len(seeds(document)) == 1)
        self.press_in("axial", Keys.ESCAPE)
        self.wait("document.querySelector('.tool-hint').textContent === ''")
        self.until(lambda: "1800" in self.all("input.short", "one.value"))
        self.press_in("axial", "w")  # a wider window
        self.until(lambda: "1980" in self.all("input.short", "one.value"))

    def test_seeds_are_moved_and_undone(self):
        self.with_ct()
        self.click('[aria-label$="go to seed 1 of distal"]')
        self.wait("document.querySelector('[data-slice=axial]').dataset.shown === '11'")
        canvas = self.in_sight('[data-slice="axial"]')
        scale = self.the('[data-slice="axial"]', "one.clientWidth") / 40
        chain = ActionChains(self.driver, duration=0)
        start = [(at + 0.5 - count / 2) * scale for at, count in zip(LOWER, SIZE[:2])]
        chain.move_to_element_with_offset(canvas, round(start[0]), round(start[1])).click_and_hold()
        chain.move_by_offset(round(2 * scale), 0).move_by_offset(round(scale), 0).release().perform()
        seeds = lambda document: document["fragments"]["distal"]["seeds"]
        moved = self.saved_when(lambda document: seeds(document)[0][0] > 21)
        self.assertAlmostEqual(seeds(moved)[0][0], 23, delta=0.2)
        self.wait("document.querySelector('[data-do=undo]').title === 'Undo: move a seed of distal'")
        self.click('[data-do="undo"]')
        self.saved_when(lambda document: seeds(document) == [[20, 18, 11]])

    def test_pixels_of_a_landmark_stay_when_its_place_in_the_ct_goes(self):
        pixels = {"frontal": [12.5, 13]}
        self.with_ct(landmarks=[{"name": "tip", "model_mm": [20, 18, 11], "pixels": pixels}])
        self.click('[aria-label="Remove tip in the CT"]')
        document = self.saved_when(lambda document: "model_mm" not in document["landmarks"][0])
        self.assertEqual(document["landmarks"], [{"name": "tip", "pixels": pixels}])

    def test_a_ct_that_cannot_be_read_is_said_on_the_page(self):
        (self.folder / "scan" / "slice7-107.dcm").write_bytes(b"damaged")
        self.begin(ct={"file": "scan"})
        self.says(".ct-panel div > .fault", "slice7-107.dcm")
        self.assertTrue(self.the(".ct-options", "one.open"))

    def test_of_several_series_one_is_chosen(self):
        formats.dicom_series(self.folder / "scan", (20, 20, 20), 8000 * [-1000], series="8")
        self.begin(ct={"file": "scan"})
        self.wait("document.querySelectorAll('[data-series]').length === 2")
        self.click('[data-series="1.2.826.0.1.3680043.2.1143.8.2"]')
        self.wait_for_slices()
        self.assertIn("20 × 20 × 20 voxels", self.text(".ct-panel"))
        self.assertEqual(self.server.draft()["document"]["ct"]["series_uid"], "1.2.826.0.1.3680043.2.1143.8.2")

    def test_faults_of_saving_are_listed(self):
        self.begin()
        self.click('[data-do="save"]')
        faults = ["the CT is missing; choose one"]
        faults.append("there is no fragment; add one, with its seeds, its label or its surface")
        self.eventually(lambda: self.texts("[data-saved] li"), faults)

    def test_comments_that_would_go_are_shown_before(self):
        write_scan(self.folder)
        self.begin(ct={"file": "scan.mha"}, fragments={"distal": {"seeds": [list(LOWER)], "register": True}})
        self.save()
        file = self.folder / "mine" / "case.yaml"
        kept = "# mine\n" + re.sub("(name: .*)", r"\1   # the first", file.read_text())
        file.write_text(kept)
        self.save()
        self.assertEqual(file.read_text(), kept, "nothing changed, so nothing is asked")
        self.click('[data-view-row="frontal"] [data-do="rename"]')
        self.find("dialog[open] input")
        self.the("dialog input", "(one.value = 'oblique', one.form.requestSubmit())")
        self.find("[data-view-row=oblique]")
        for answer, is_saved in (("do-not-save", False), ("save-without", True)):
            self.click('[data-do="save"]:not(:disabled)')
            self.assertEqual(self.find("dialog[open] [data-lost]").text, "# the first")
            self.click('#dialog [data-do="%s"]' % answer)
            self.wait("!document.getElementById('dialog').open")
            if is_saved:
                self.wait("document.querySelector('[data-do=save]').textContent === 'Save again'")
            self.assertEqual("oblique" in file.read_text(), is_saved)
        self.assertTrue(file.read_text().startswith("# mine\n"))


class SlicesTest(CasePage):
    def open_case(self, grid, values):
        write_scan(self.folder, "ct.mha", grid, values)
        self.show("case=mine")
        self.choose("ct", "ct.mha")
        self.wait_for_slices()

    def test_the_pixels_lie_where_the_page_says(self):
        """One bright voxel in a flipped grid of long voxels: the middle of what is bright is its place."""
        grid = {"size": [33, 25, 20], "spacing_mm": [1.0, 1.5, 2.0], "origin_mm": [10.0, -20.0, 30.0]}
        grid["direction"] = [[-1, 0, 0], [0, 0, 1], [0, 1, 0]]
        values = [-1000] * (33 * 25 * 20)
        values[(13 * 25 + 6) * 33 + 20] = 2000
        self.open_case(grid, values)
        for name, slice_number in (("axial", 6), ("coronal", 13), ("sagittal", 20)):
            self.go_to_slice(name, slice_number)
        self.click('[data-window="all"]')
        wanted = point_of(grid, [20, 6, 13])
        for name in ("axial", "coronal", "sagittal"):
            self.click_bright(name)
            point_mm, value_hu = self.crosshair()
            scale = self.the('[data-slice="%s"]' % name, "one.clientWidth") / 50
            self.assertLess(math.dist(point_mm, wanted), 1.2 / scale + 0.1, name)
            self.assertEqual(value_hu, [2000])
        for keys in ("+++", "-", "++"):  # closer, with another part of the slice in the middle
            for name in ("axial", "coronal", "sagittal"):
                self.press_in(name, keys, Keys.SHIFT + Keys.ARROW_LEFT, Keys.SHIFT + Keys.ARROW_DOWN)
                self.click_bright(name)
                self.assertLess(math.dist(self.crosshair()[0], wanted), 0.25, name)

    def click_bright(self, name):
        """Clicks the middle of the white pixels of a slice."""
        self.js("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        x, y = self.js(
            """const canvas = document.querySelector('[data-slice="' + arguments[0] + '"]'), {width, height} = canvas;
            const {data} = canvas.getContext('2d').getImageData(0, 0, width, height), sums = [0, 0, 0];
            for (let i = 0; i < width * height; ++i)
              if (Math.min(data[4 * i], data[4 * i + 1], data[4 * i + 2]) > 150)
                [i % width + 0.5, Math.floor(i / width) + 0.5, 1].forEach((x, k) => (sums[k] += x));
            return [sums[0] / sums[2], sums[1] / sums[2]];""",
            name,
        )
        canvas = self.in_sight('[data-slice="%s"]' % name)
        off = round(x - canvas.size["width"] / 2), round(y - canvas.size["height"] / 2)
        ActionChains(self.driver, duration=0).move_to_element_with_offset(canvas, *off).click().perform()

    def test_dragging_with_the_right_button_changes_the_window(self):
        self.open_case(formats.straight((20, 20, 20)), 8000 * [-1000])
        canvas = self.in_sight('[data-slice="axial"]')
        for dx, dy, changed in ((60, 0, ["400", "2580"]), (0, 40, ["480", "2580"])):
            builder = ActionBuilder(self.driver, duration=0)
            builder.pointer_action.move_to(canvas).pointer_down(2).move_by(dx, dy).pointer_up(2)
            builder.perform()
            self.eventually(lambda: self.all(".ct-slices input.short", "one.value")[-2:], changed)


def octahedron(centre, radius):
    """A closed surface as text STL, in cm."""
    tips = [[centre[k] + sign * radius * (k == axis) for k in range(3)] for axis in range(3) for sign in (1, -1)]
    lines = ["solid bone"]
    for x, y, z in ((x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)):
        corners = [tips[x], tips[y], tips[z]]
        lines += ["facet normal 0 0 0", "outer loop"]
        corners = corners[::-1] if (x + y + z) % 2 else corners
        lines += ["vertex %g %g %g" % tuple(value / 10 for value in corner) for corner in corners]
        lines += ["endloop", "endfacet"]
    return "\n".join(lines + ["endsolid bone", ""])


class LabelsTest(CasePage):
    """Label maps and surfaces: shown over the slices, picked by number or name, and saved."""

    def setUp(self):
        super().setUp()
        write_scan(self.folder)
        self.write_labels("bones.seg.nrrd", LABELS)

    def write_labels(self, name, grid):
        values = made_cases.balls(LABELS, (2, LOWER, RADIUS), (5, UPPER, RADIUS))
        (self.folder / name).write_bytes(made_cases.seg_nrrd(grid, values, (("tibia", 2), ("fibula", 5))))

    def begin(self, **document):
        super().begin(**{"ct": {"file": "scan.mha"}, **document})

    def pick(self, fragment, option):
        """Chooses what gives a fragment."""
        Select(self.in_sight('[data-way="%s"]' % fragment)).select_by_visible_text(option)

    def segments(self, count):
        self.wait("document.querySelectorAll('[data-segment]').length === %d" % count)

    def fragment_is(self, name, wanted):
        self.saved_when(lambda document: document["fragments"].get(name) == {**wanted, "register": True})

    def reads(self, *outputs):
        only = [word for output in outputs for word in ("--only", output)]
        case = "case=%s" % (self.folder / "mine")
        self.marrow("run", SOURCE / "pipelines/workbench/case.yaml", case, "--out", self.scratch / "out", *only)

    def test_labels_are_picked_from_the_list_and_saved(self):
        self.begin()
        self.wait_for_slices()
        self.choose("labels", "bones.seg.nrrd")
        self.segments(2)
        self.click('[aria-label="Go to 2 tibia"]')
        self.wait("document.querySelector('[data-read=\"label\"]').textContent === 'At the crosshair: 2 tibia'")
        self.click('[data-do="add-label"]')
        self.fragment_is("tibia", {"label": "tibia"})
        # Bone of 900 HU, grey 198 in the window of bone, with 55 % of the fragment's colour over it.
        self.coloured([198 + 0.55 * (value - 198) for value in BLUE], 24, 800)
        self.click('[data-add="5"]')
        self.saved_when(lambda document: "fibula" in document["fragments"])
        self.assertRegex(self.segmented(), r"As the pipelines take them: fibula [12]\.\d+ ml, tibia [12]\.\d+ ml")
        self.wait("Number(document.querySelector('canvas.surface').dataset.triangles) > 100")
        text = self.save()
        self.assertIn("copied into it: ct.mha, labels.seg.nrrd, frontal.png", text)
        self.assertNotIn("femur", text)
        written = self.written()
        self.assertEqual((written["ct"], written["labels"]), ("ct.mha", "labels.seg.nrrd"))
        expected = {name: {"label": name, "register": True} for name in ("fibula", "tibia")}
        self.assertEqual(written["fragments"], expected)
        self.reads("ct", "label", "views")
        self.no_severe_faults()

    def test_a_fragment_takes_another_label_and_seeds_again(self):
        self.begin(labels="bones.seg.nrrd", fragments={"bone": {"seeds": [list(LOWER)], "register": True}})
        self.segments(2)
        self.pick("bone", "5 fibula")
        self.fragment_is("bone", {"label": "fibula"})
        self.says('[data-segment="5"]', "is the fragment bone")
        self.pick("bone", "seeds")
        self.fragment_is("bone", {"seeds": []})
        self.click('[data-add="2"]')
        self.says(".fragments-panel .fault", "Some fragments are given by seeds, some by label")
        self.find('.labels-panel input[type="search"]').send_keys("fib")
        self.segments(1)

    def test_a_surface_without_a_ct(self):
        (self.folder / "bone.stl").write_text(octahedron(LOWER, 10))
        self.begin(ct=None, fragments={"bone": {"seeds": [], "register": True}})
        self.pick("bone", "a surface …")
        self.click('#dialog [data-choose="bone.stl"]')
        self.saved_when(lambda document: document["fragments"]["bone"].get("surface") == {"file": "bone.stl"})
        self.set('[aria-label="mm of one unit of the surface of bone"]', 10)
        self.saved_when(lambda document: document["fragments"]["bone"]["surface"] == {"file": "bone.stl", "scale": 10})
        self.assertRegex(self.segmented(), r"bone 1\.3\d ml", "4/3 r^3 of an octahedron")
        self.assertIn("Saved in", self.save())
        self.assertNotIn("ct", self.written())
        self.assertEqual(self.written()["fragments"]["bone"]["surface"], {"file": "bone.stl", "scale": 10})
        self.reads("surface")

    def test_labels_without_a_ct_are_shown_over_air(self):
        self.begin(ct=None, labels="bones.seg.nrrd", fragments={"tibia": {"label": 2, "register": True}})
        self.wait_for_slices()
        self.says(".ct-panel", "The slices have the grid of the labels.")
        self.click('[aria-label="Go to 2 tibia"]')
        self.coloured([0.55 * value for value in BLUE], 24, 800)
        self.assertIn("Saved in", self.save())
        written = self.written()
        self.assertEqual((written["labels"], written["fragments"]["tibia"]["label"]), ("labels.seg.nrrd", 2))


if __name__ == "__main__":
    main(part=5)
