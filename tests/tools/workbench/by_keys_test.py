#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The whole way without a mouse: from a DICOM CT, two X-rays and the C-arm's angles to a pose that was moved by hand
and registered, and to another node in a pipeline. Tab reaches everything, and keys use it, as a person would."""
import json
import shutil
import time

import yaml
from selenium.webdriver import ActionChains
from selenium.webdriver.common.keys import Keys

import bench
from bench import SOURCE
from whole_way_test import WholeWayTest as WholeWay

MOST_TABS = 400
CHECKED = "return arguments[0].matches('input[type=checkbox], input[type=radio]')"


class ByKeysTest(WholeWay):
    def keys(self, *keys):
        """Sends keys to the element with the focus."""
        ActionChains(self.browser.driver, duration=0).send_keys(*keys).perform()

    def go_to_step(self, name):
        """By its number; a field with the focus would take the digit."""
        self.browser.js("document.activeElement.blur()")
        self.keys(str(["ct", "bones", "xrays", "check", "save"].index(name) + 1))

    def reach(self, selector):
        """Presses Tab until the element has the focus."""
        self.find_in_sight(selector)
        for _ in range(MOST_TABS):
            if self.browser.js("return !!document.activeElement.matches(%s)" % json.dumps(selector)):
                return self.browser.driver.switch_to.active_element
            self.keys(Keys.TAB)
        self.fail("Tab never reaches " + selector)

    def click(self, selector):
        """Presses Enter or the space bar in place of a click."""
        element = self.reach(selector)
        if self.browser.js(
            "return arguments[0].matches('input:not([type=checkbox]):not([type=radio]), canvas')", element
        ):
            return
        element.send_keys(Keys.SPACE if self.browser.js(CHECKED, element) else Keys.ENTER)

    def add_fragment(self, name, seed_mm):
        box = 'section[aria-label="Fragments"] input[type="text"]'
        self.reach(box).send_keys(name + Keys.ENTER)
        self.find('[data-tool="seed %s"][aria-pressed="true"]' % name)
        index = [
            round((mm - origin) / spacing)
            for mm, origin, spacing in zip(seed_mm, self.grid["origin_mm"], self.grid["spacing_mm"])
        ]
        self.reach('[data-slice="axial"]')
        self.go("axial", index[2], Keys.PAGE_UP)
        self.go("sagittal", index[0], Keys.ARROW_RIGHT)
        self.go("coronal", index[1], Keys.ARROW_DOWN)
        self.keys(Keys.ENTER)
        self.saved_when(lambda document: document["fragments"][name]["seeds"])

    def go(self, slices, wanted, more):
        """Moves the crosshair until these slices show the wanted one. `more` raises or lowers the number."""
        less = {Keys.PAGE_UP: Keys.PAGE_DOWN, Keys.ARROW_RIGHT: Keys.ARROW_LEFT, Keys.ARROW_DOWN: Keys.ARROW_UP}[more]
        shown = lambda: int(self.browser.js("return document.querySelector('[data-slice=%s]').dataset.shown" % slices))
        begin = shown()
        if begin == wanted:
            return
        self.keys(more)
        self.browser.wait("return document.querySelector('[data-slice=%s]').dataset.shown !== '%d'" % (slices, begin))
        if shown() < begin:
            more, less = less, more
        way = wanted - shown()
        for _ in range(abs(way)):
            self.keys(more if way > 0 else less)
        self.browser.wait("return document.querySelector('[data-slice=%s]').dataset.shown === '%d'" % (slices, wanted))

    def add_view(self, view, beta_deg):
        self.click('[data-do="add-view"]')
        self.click('#dialog [data-choose="%s"]' % view["image"])
        given = {"alpha_deg": 0, "beta_deg": beta_deg}
        if not beta_deg:  # the second view has the distances of the first
            given.update(source_to_detector_mm=1000, source_to_isocentre_mm=600, pixel_mm=0.586)
        for key, value in given.items():
            self.reach('#dialog [data-arm="%s"]' % key).send_keys(str(value))
        self.keys(Keys.ENTER)
        self.saved_when(lambda document: any(one["name"] == view["name"] for one in document["views"]))

    def moved_by_keys(self):
        """Moves and turns the bone in the first view and back. The draft keeps it."""
        self.reach(".place-canvas")
        before = self.browser.js("return marrow.place().placed.distal")
        self.keys(Keys.ARROW_LEFT, "a", "q", "w", "r")
        self.saved_when(lambda document: document["fragments"]["distal"].get("start") not in (None, before))
        self.keys("f", "s", "e", "d", Keys.ARROW_RIGHT)
        self.browser.wait("return !marrow.place().keyMoves && !marrow.place().isKeeping")

    def test_from_dicom_to_a_pose(self):
        self.make_case()
        self.click('[data-do="place"]')
        self.wait_for_page("place")
        self.browser.wait("return !!document.querySelector('[data-do=register]:not(:disabled)')", 120)
        self.moved_by_keys()
        self.reach(".place-canvas")
        self.keys(Keys.ENTER)
        self.browser.wait("return !!document.querySelector('[data-judgement]')", 240)
        self.assertIn("start", self.document()["fragments"]["distal"])

    def wait_for_file(self, file, condition):
        end = time.monotonic() + 120
        while not condition(yaml.safe_load(file.read_text())):
            self.assertLess(time.monotonic(), end, file.read_text())
            time.sleep(0.1)

    def test_another_node_in_a_pipeline(self):
        file = self.folder / "femur.yaml"
        shutil.copy(SOURCE / "pipelines" / "femur" / "femur.yaml", file)
        for name in ("parts", "verdict"):  # the pipeline finds them beside its folder
            shutil.copytree(SOURCE / "pipelines" / name, self.scratch / name)
        server = self.open()
        self.show(server, "pipeline=femur.yaml")
        self.click("[data-node=edges]")
        self.click("[data-do=fits]")
        self.click('[data-use="edges.canny"]')
        used = lambda document: document["nodes"]["edges"]["uses"]
        self.wait_for_file(file, lambda document: used(document) == "edges.canny")
        self.browser.wait("return !!document.querySelector('[data-do=undo]:not(:disabled)')")  # the page knows it, too
        ActionChains(self.browser.driver).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
        self.wait_for_file(file, lambda document: used(document) != "edges.canny")


del WholeWay  # its own tests are elsewhere

if __name__ == "__main__":
    bench.main()
