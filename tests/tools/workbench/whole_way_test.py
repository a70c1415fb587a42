#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The whole way in the browser: from a DICOM CT, two X-rays and the C-arm's angles to a registered pose. Mouse clicks
are counted, and the command line finds the same pose from the saved case."""
import os
import shlex
import shutil
import subprocess
import zlib

import numpy
import yaml
from selenium.webdriver.common.keys import Keys

import bench
from bench import MARROW, SMALL, PageTest, simulate
from harness import formats

MOST_CLICKS = 20


def read_mha(path):
    """(size, spacing, origin, values) of a MetaImage that marrow wrote."""
    data = path.read_bytes()
    end = data.index(b"ElementDataFile = LOCAL\n") + len(b"ElementDataFile = LOCAL\n")
    header = dict(line.split(" = ", 1) for line in data[:end].decode().strip().splitlines())
    numbers = lambda key: [float(part) for part in header[key].split()]
    size = [int(n) for n in numbers("DimSize")]
    values = numpy.frombuffer(
        zlib.decompress(data[end:]), {"MET_SHORT": "<i2", "MET_FLOAT": "<f4"}[header["ElementType"]]
    )
    return size, numbers("ElementSpacing"), numbers("Offset"), values


class WholeWayTest(PageTest):
    def setUp(self):
        super().setUp()
        case = simulate(self.scratch / "simulated", *SMALL) / "case"
        self.given = yaml.safe_load((case / "case.yaml").read_text())
        size, spacing, origin, values = read_mha(case / self.given["ct"])
        self.grid = {"size": size, "spacing_mm": spacing, "origin_mm": origin}
        values = numpy.clip(numpy.round(values), -1024, 32767).astype("<i2")
        formats.dicom_series(self.folder / "scan", size, values, spacing_mm=spacing, origin_mm=origin)
        for view in self.given["views"]:
            shutil.copy(case / view["image"], self.folder)
        self.clicks = 0

    def click(self, selector):
        super().click(selector)
        self.clicks += 1

    def go_to_step(self, name):
        super().go_to_step(name)
        self.clicks += 1

    def choose_ct(self):
        self.click('[data-do="choose-ct"]')
        self.click('#dialog [data-open="scan"]')
        self.click('#dialog [data-choose="scan"]')
        self.wait_for_slices()

    def add_fragment(self, name, seed_mm):
        """Adds a fragment, and puts its seed into a slice by a click."""
        box = 'section[aria-label="Fragments"] input[type="text"]'
        self.click(box)
        self.find(box).send_keys(name + Keys.ENTER)  # a click puts a seed now
        self.find('[data-tool="seed %s"][aria-pressed="true"]' % name)
        index = [
            round((mm - origin) / spacing)
            for mm, origin, spacing in zip(seed_mm, self.grid["origin_mm"], self.grid["spacing_mm"])
        ]
        self.go_to_slice("axial", index[2])
        self.click_axial(index)
        self.saved_when(lambda document: document["fragments"][name]["seeds"])

    def click_axial(self, index):
        from selenium.webdriver import ActionChains

        canvas = self.find_in_sight('[data-slice="axial"]')
        width, height = self.browser.js(
            "const r = arguments[0].getBoundingClientRect(); return [r.width, r.height]", canvas
        )
        extent = [n * s for n, s in zip(self.grid["size"], self.grid["spacing_mm"])]
        scale = min(width / extent[0], height / extent[1])
        x, y = (((index[k] + 0.5) * self.grid["spacing_mm"][k] - extent[k] / 2) * scale for k in range(2))
        chain = ActionChains(self.browser.driver, duration=0)
        chain.move_to_element_with_offset(canvas, round(x), round(y)).click().perform()
        self.clicks += 1

    def add_view(self, view, beta_deg):
        self.click('[data-do="add-view"]')
        self.click('#dialog [data-choose="%s"]' % view["image"])
        box = lambda key: self.find('#dialog [data-arm="%s"]' % key)
        given = {"alpha_deg": 0, "beta_deg": beta_deg}
        if not beta_deg:  # the second view has the distances of the first
            given.update(source_to_detector_mm=1000, source_to_isocentre_mm=600, pixel_mm=0.586)
        for key, value in given.items():
            self.assertEqual(box(key).get_attribute("value"), "", key)
            box(key).send_keys(str(value))
        box("pixel_mm").send_keys(Keys.ENTER)
        self.saved_when(lambda document: any(one["name"] == view["name"] for one in document["views"]))

    def make_case(self):
        """The case from the CT to the saved folder."""
        server = self.open()
        self.show(server, "case=mine")
        self.choose_ct()
        for name, fragment in self.given["fragments"].items():
            self.add_fragment(name, fragment["seeds"][0])
        for name, fragment in self.given["fragments"].items():
            if not fragment.get("register", True):
                self.click('[data-fragment="%s"] input[type="checkbox"]' % name)
        for view, beta_deg in zip(self.given["views"], (0, 90)):
            self.add_view(view, beta_deg)
        self.click('[data-do="save"]')
        self.browser.wait("return document.querySelector('[data-saved]').textContent.includes('Saved in')", 120)

    def test_from_dicom_to_a_pose(self):
        self.make_case()
        self.click('[data-do="place"]')
        self.click('[data-do="register"]:not(:disabled)')
        self.saved_when(lambda document: "start" in document["fragments"]["distal"])
        self.browser.wait("return !!document.querySelector('[data-judgement]')", 120)
        print("clicks: %d" % self.clicks)
        self.assertLessEqual(self.clicks, MOST_CLICKS)

        found = numpy.array(self.document()["fragments"]["distal"]["start"])
        off = numpy.linalg.inv(numpy.array(self.given["fragments"]["distal"]["truth"]["matrix"])) @ found
        angle_deg = numpy.degrees(numpy.arccos(numpy.clip((numpy.trace(off[:3, :3]) - 1) / 2, -1, 1)))
        print("off by %.3f degrees" % angle_deg)
        self.assertLess(angle_deg, 1)
        self.same_on_the_command_line(found)

    def same_on_the_command_line(self, found):
        text = self.browser.js("return document.querySelector('.place-command code').textContent")
        words = shlex.split(text)
        self.assertEqual(words[:2], ["marrow", "run"])
        environment = {**os.environ, "MARROW_CACHE": str(self.scratch / "other-store")}
        arguments = [MARROW, *words[1:], "--out", self.scratch / "again"]
        ended = subprocess.run(arguments, capture_output=True, text=True, cwd=self.folder, env=environment)
        self.assertIn(ended.returncode, (0, 3), ended.stderr)
        pose = yaml.safe_load((self.scratch / "again" / "outputs" / "pose" / "distal.yaml").read_text())
        self.assertEqual(numpy.array(pose["matrix"]).tolist(), found.tolist())


if __name__ == "__main__":
    bench.main()
