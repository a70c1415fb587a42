#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The whole way in the browser: from a DICOM CT, two X-rays and the C-arm's angles to a registered pose, once by mouse
and once by keys alone, as a person would; to another node in a pipeline by keys; and in Firefox to a report, too. Mouse
clicks are counted, and the command line finds the same pose from the saved case."""
import shlex
import shutil
import zlib

import numpy
import yaml
from selenium.webdriver import ActionChains
from selenium.webdriver.common.keys import Keys

from case_page_test import CasePage
from harness import SOURCE, formats
from harness.cases import SMALL, simulate
from harness.page import main

MOST_CLICKS, MOST_TABS = 20, 400
STEPS = ["ct", "bones", "xrays", "check", "save"]
LESS = {Keys.PAGE_UP: Keys.PAGE_DOWN, Keys.ARROW_RIGHT: Keys.ARROW_LEFT, Keys.ARROW_DOWN: Keys.ARROW_UP}
NO_BUTTON = "one.matches('input:not([type=checkbox]):not([type=radio]), canvas')"
BOX = "one.matches('input[type=checkbox], input[type=radio]')"
ADD_FRAGMENT = 'section[aria-label="Fragments"] input[type="text"]'


def read_mha(path):
    """(grid, values) of a MetaImage that marrow wrote."""
    data = path.read_bytes()
    end = data.index(b"ElementDataFile = LOCAL\n") + len(b"ElementDataFile = LOCAL\n")
    header = dict(line.split(" = ", 1) for line in data[:end].decode().strip().splitlines())
    numbers = lambda key: [float(part) for part in header[key].split()]
    grid = {"size": [int(n) for n in numbers("DimSize")], "spacing_mm": numbers("ElementSpacing")}
    kind = {"MET_SHORT": "<i2", "MET_FLOAT": "<f4"}[header["ElementType"]]
    return {**grid, "origin_mm": numbers("Offset")}, numpy.frombuffer(zlib.decompress(data[end:]), kind)


class WholeWay(CasePage):
    def setUp(self):
        super().setUp()
        shutil.rmtree(self.folder / "scan")
        case = simulate(self.scratch / "simulated", *SMALL)
        self.given = yaml.safe_load((case / "case.yaml").read_text())
        self.grid, values = read_mha(case / self.given["ct"])
        values = numpy.clip(numpy.round(values), -1024, 32767).astype("<i2")
        size, spacing_mm, origin_mm = (self.grid[key] for key in ("size", "spacing_mm", "origin_mm"))
        formats.dicom_series(self.folder / "scan", size, values, spacing_mm=spacing_mm, origin_mm=origin_mm)
        for view in self.given["views"]:
            shutil.copy(case / view["image"], self.folder)

    def add_fragment(self, name, seed_mm):
        self.type(ADD_FRAGMENT, name + Keys.ENTER)
        self.find('[data-tool="seed %s"][aria-pressed="true"]' % name)
        places = zip(seed_mm, self.grid["origin_mm"], self.grid["spacing_mm"])
        self.add_seed([round((mm - origin) / spacing) for mm, origin, spacing in places])
        self.saved_when(lambda document: document["fragments"][name]["seeds"])

    def add_view(self, view, beta_deg):
        self.click('[data-do="add-view"]')
        self.click('#dialog [data-choose="%s"]' % view["image"])
        given = {"alpha_deg": 0, "beta_deg": beta_deg}
        if not beta_deg:  # the second view has the distances of the first
            given.update(source_to_detector_mm=1000, source_to_isocentre_mm=600, pixel_mm=0.586)
        for key, value in given.items():
            box = '#dialog [data-arm="%s"]' % key
            self.find(box)
            self.assertEqual(self.the(box, "one.value"), "", key)
            self.into(box).send_keys(str(value))
        self.into(box).send_keys(Keys.ENTER)
        self.saved_when(lambda document: any(one["name"] == view["name"] for one in document["views"]))

    def make_case(self):
        """The case from the CT to the saved folder."""
        self.show("case=mine")
        self.click('[data-do="choose-ct"]')
        self.click('#dialog [data-open="scan"]')
        self.click('#dialog [data-choose="scan"]')
        self.wait_for_slices()
        for name, fragment in self.given["fragments"].items():
            self.add_fragment(name, fragment["seeds"][0])
        for name, fragment in self.given["fragments"].items():
            if not fragment.get("register", True):
                self.click('[data-fragment="%s"] input[type="checkbox"]' % name)
        for view, beta_deg in zip(self.given["views"], (0, 90)):
            self.add_view(view, beta_deg)
        self.click('[data-do="save"]')
        self.says("[data-saved]", "Saved in")
        self.click('[data-do="place"]')


class ByMouseTest(WholeWay):
    clicks = 0

    def click(self, selector):
        super().click(selector)
        self.clicks += 1

    def go_to_step(self, name):
        super().go_to_step(name)
        self.clicks += 1

    def into(self, selector):
        return self.find(selector)

    def type(self, selector, text):
        self.click(selector)
        self.find(selector).send_keys(text)

    def add_seed(self, index):
        self.go_to_slice("axial", index[2])
        extent = [n * s for n, s in zip(self.grid["size"], self.grid["spacing_mm"])]
        spacing_mm = self.grid["spacing_mm"][0]  # of both axes of the slice
        self.click_voxel("axial", index[:2], [side / spacing_mm for side in extent[:2]])
        self.clicks += 1

    def test_from_dicom_to_a_pose(self):
        self.make_case()
        self.click('[data-do="register"]:not(:disabled)')
        self.saved_when(lambda document: "start" in document["fragments"]["distal"])
        self.find("[data-judgement]")
        print("clicks: %d" % self.clicks)
        self.assertLessEqual(self.clicks, MOST_CLICKS)
        found = numpy.array(self.server.draft()["document"]["fragments"]["distal"]["start"])
        off = numpy.linalg.inv(numpy.array(self.given["fragments"]["distal"]["truth"]["matrix"])) @ found
        angle_deg = numpy.degrees(numpy.arccos(numpy.clip((numpy.trace(off[:3, :3]) - 1) / 2, -1, 1)))
        print("off by %.3f degrees" % angle_deg)
        self.assertLess(angle_deg, 1)
        words = shlex.split(self.text(".place-command code"))
        self.assertEqual(words[:2], ["marrow", "run"])
        self.marrow(*words[1:], "--out", self.scratch / "again", store="other-store")
        pose = yaml.safe_load((self.scratch / "again" / "outputs" / "pose" / "distal.yaml").read_text())
        self.assertEqual(pose["matrix"], found.tolist())


class ByKeysTest(WholeWay):
    """Tab reaches everything, and keys use it."""

    def keys(self, *keys):
        """Sends keys to the element with the focus."""
        ActionChains(self.driver, duration=0).send_keys(*keys).perform()

    def go_to_step(self, name):
        """By its number; a field with the focus would take the digit."""
        self.js("document.activeElement.blur()")
        self.keys(str(STEPS.index(name) + 1))

    def into(self, selector):
        """Presses Tab until the element has the focus."""
        self.in_sight(selector)
        for _ in range(MOST_TABS):
            if self.js("return document.activeElement.matches(arguments[0])", selector):
                return self.driver.switch_to.active_element
            self.keys(Keys.TAB)
        self.fail("Tab never reaches " + selector)

    def type(self, selector, text):
        self.into(selector).send_keys(text)

    def click(self, selector):
        """Presses Enter or the space bar in place of a click."""
        element = self.into(selector)
        if not self.the(":focus", NO_BUTTON):
            element.send_keys(Keys.SPACE if self.the(":focus", BOX) else Keys.ENTER)

    def add_seed(self, index):
        self.into('[data-slice="axial"]')
        self.go("axial", index[2], Keys.PAGE_UP)
        self.go("sagittal", index[0], Keys.ARROW_RIGHT)
        self.go("coronal", index[1], Keys.ARROW_DOWN)
        self.keys(Keys.ENTER)

    def go(self, slices, wanted, more):
        """Moves the crosshair until these slices show the wanted one. `more` raises or lowers the number."""
        # -1 while a slice is being fetched.
        shown = lambda: int(self.the("[data-slice=%s]" % slices, "one.dataset.shown || '-1'"))
        self.until(lambda: shown() >= 0)
        begin, less = shown(), LESS[more]
        if begin == wanted:
            return
        self.keys(more)
        self.until(lambda: shown() not in (begin, -1))
        if shown() < begin:
            more, less = less, more
        way = wanted - shown()
        for _ in range(abs(way)):
            self.keys(more if way > 0 else less)
        self.eventually(shown, wanted)

    def test_from_dicom_to_a_pose(self):
        self.make_case()
        self.wait_for_page("place")
        self.find("[data-do=register]:not(:disabled)")
        self.into(".place-canvas")
        # Moves and turns the bone in the first view and back. The draft keeps it.
        before = self.js("return marrow.place().placed.distal")
        self.keys(Keys.ARROW_LEFT, "a", "q", "w", "r")
        self.saved_when(lambda document: document["fragments"]["distal"].get("start") not in (None, before))
        self.keys("f", "s", "e", "d", Keys.ARROW_RIGHT)
        self.wait("!marrow.place().keyMoves && !marrow.place().isKeeping")
        self.into(".place-canvas")
        self.keys(Keys.ENTER)
        self.find("[data-judgement]")
        self.assertIn("start", self.server.draft()["document"]["fragments"]["distal"])

    def test_another_node_in_a_pipeline(self):
        file = self.folder / "femur.yaml"
        shutil.copy(SOURCE / "pipelines" / "femur" / "femur.yaml", file)
        for name in ("parts", "verdict"):  # the pipeline finds them beside its folder
            shutil.copytree(SOURCE / "pipelines" / name, self.scratch / name)
        self.show("pipeline=femur.yaml")
        self.click("[data-node=edges]")
        self.click("[data-do=fits]")
        self.click('[data-use="edges.canny"]')
        used = lambda: yaml.safe_load(file.read_text())["nodes"]["edges"]["uses"]
        self.until(lambda: used() == "edges.canny")
        self.find("[data-do=undo]:not(:disabled)")  # the page knows it, too
        ActionChains(self.driver).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
        self.until(lambda: used() != "edges.canny")


if __name__ == "__main__":
    main()
