#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Label maps and surfaces on the page "Case": shown over the slices, picked by number or name, and saved."""
import array
import json
import math
import struct

import yaml

import bench
import ct_cases
from bench import PageTest
from harness import formats
from harness.program import marrow

SIZE = (40, 36, 44)
LOWER, UPPER, RADIUS = (20, 18, 11), (20, 18, 32), 8
# Coarser than the CT, mirrored in x and z, and it does not cover the CT's first and last slices.
LABELS = {
    **formats.straight((20, 18, 20), (2.0, 2.0, 2.0), (38.5, 0.5, 40.5)),
    "direction": [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
}
SEGMENTS = (("tibia", 2), ("fibula", 5))
# How many pixels of the axial slice have about this colour.
COUNTED = """
  const canvas = document.querySelector('[data-slice="axial"]'), {width, height} = canvas;
  const {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    count += Math.hypot(...[0, 1, 2].map((k) => data[i + k] - arguments[0][k])) < 24;
  return count;"""


def octahedron(centre, radius):
    """A closed surface as text STL, in cm."""
    tips = [[centre[k] + sign * radius * (k == axis) for k in range(3)] for axis in range(3) for sign in (1, -1)]
    lines = ["solid bone"]
    for x in (0, 1):
        for y in (2, 3):
            for z in (4, 5):
                corners = [tips[x], tips[y], tips[z]]
                if (x + y + z) % 2:
                    corners.reverse()
                lines += ["facet normal 0 0 0", "outer loop"]
                lines += ["vertex %g %g %g" % tuple(value / 10 for value in corner) for corner in corners]
                lines += ["endloop", "endfacet"]
    return "\n".join(lines + ["endsolid bone", ""])


class LabelsTest(PageTest):
    def setUp(self):
        super().setUp()
        (self.folder / "scan.mha").write_bytes(
            formats.mha(formats.straight(SIZE), ct_cases.two_balls(SIZE, LOWER, UPPER, RADIUS))
        )
        self.values = ct_cases.labelled_balls(LABELS, [(2, LOWER, RADIUS), (5, UPPER, RADIUS)])
        (self.folder / "bones.seg.nrrd").write_bytes(ct_cases.seg_nrrd(LABELS, self.values, SEGMENTS))
        (self.folder / "front.png").write_bytes(formats.png(64, 64, [128] * 4096))

    def enter(self):
        server = self.open()
        server.enter()
        return server

    def opened(self, server, file="bones.seg.nrrd", **more):
        return server.finish(server.json("POST", "/api/labels/open", {"labels": file, **more})["job"])

    def begin(self, **document):
        """The page of a case 'mine' with one view."""
        server = self.enter()
        view = {"name": "frontal", "image": "front.png", "camera": ct_cases.CAMERA}
        document = {"ct": {"file": "scan.mha"}, "views": [view], "fragments": {}, "landmarks": [], **document}
        server.json("POST", "/api/draft/change", {"case": "mine", "revision": 0, "what": "x", "document": document})
        page = self.open()
        self.show(page, "case=mine")
        return page

    def wait(self, condition):
        self.browser.wait("return " + condition, 240)

    def pick(self, fragment, option):
        """Chooses what gives a fragment."""
        from selenium.webdriver.support.ui import Select

        Select(self.find_in_sight('[data-way="%s"]' % fragment)).select_by_visible_text(option)

    def save(self):
        self.click('[data-do="save"]')
        self.wait("/Saved in|Not saved/.test(document.querySelector('[data-saved]').textContent)")
        return self.find("[data-saved]").text

    def written(self):
        return yaml.safe_load((self.folder / "mine" / "case.yaml").read_text())

    def reads(self, *outputs):
        only = [word for output in outputs for word in ("--only", output)]
        pipeline = bench.SOURCE / "pipelines/workbench/case.yaml"
        ended = marrow("run", pipeline, "case=%s" % (self.folder / "mine"), "--out", self.scratch / "out", *only)
        self.assertEqual(ended.returncode, 0, ended.stderr)

    def test_the_server_describes_the_segments(self):
        state = self.opened(self.enter())
        self.assertEqual(state["state"], "done", state["error"])
        segments = state["result"]["segments"]
        self.assertEqual(
            [(one["number"], one["name"], one["label"]) for one in segments],
            [(2, "tibia", "tibia"), (5, "fibula", "fibula")],
        )
        for one, centre in zip(segments, (LOWER, UPPER)):
            self.assertEqual(one["volume_ml"], self.values.count(one["number"]) * 8 / 1000)
            self.assertLess(math.dist(one["middle_mm"], centre), math.sqrt(3))
        self.assertNotIn("ct", state["result"])

    def test_slices_follow_the_grid_of_the_ct(self):
        server = self.enter()
        ct = server.finish(server.json("POST", "/api/ct/open", {"ct": {"file": "scan.mha"}})["job"])["result"]["name"]
        labels = self.opened(server)["result"]["name"]
        balls = ((1, LOWER), (2, UPPER))
        for axis, index in ((0, 20), (1, 18), (2, 11), (2, 0)):
            low, high = [k for k in range(3) if k != axis]
            path = "/api/labels/slice?labels=%s&ct=%s&axis=%d&index=%d" % (labels, ct, axis, index)
            places = array.array("H", server.ask("GET", path)[2])
            self.assertEqual(len(places), SIZE[low] * SIZE[high])
            for i, place in enumerate(places):
                at = [0, 0, 0]
                at[axis], at[low], at[high] = index, i % SIZE[low], i // SIZE[low]
                inside = [number for number, centre in balls if math.dist(at, centre) < RADIUS - 1.8]
                near = [number for number, centre in balls if math.dist(at, centre) < RADIUS + 1.8]
                self.assertIn(place, inside or near + [0], at)
        self.assertEqual(set(places), {0}, "the labels do not reach the first slice")
        answer = server.ask("GET", "/api/labels/slice?labels=labels-9&ct=%s&axis=0&index=0" % ct)
        fault = "this label map is no longer in memory; it is opened again"
        self.assertEqual((answer[0], json.loads(answer[2])["error"]), (409, fault))

    def test_the_label_is_what_tells_a_segment_from_the_others(self):
        for segments, labels in (
            ((("bone", 2), ("bone", 5)), [2, 5]),
            ((("11", 2), ("fibula", 5)), [2, "fibula"]),
            ((("tibia", 2), ("bone", 5), ("bone", 5)), ["tibia", None, None]),
        ):
            (self.folder / "other.seg.nrrd").write_bytes(ct_cases.seg_nrrd(LABELS, self.values, segments))
            found = self.opened(self.enter(), "other.seg.nrrd")["result"]["segments"]
            self.assertEqual([one["label"] for one in found], labels)

    def test_what_is_no_label_map_is_said(self):
        server = self.enter()
        many = struct.pack("<%dh" % 1728, *range(1728))
        header = formats.mha(formats.straight((12, 12, 12)), [])
        (self.folder / "many.mha").write_bytes(header + many)
        for file, fault in (
            ("scan.mha", "scan.mha: is no label map: a voxel has the value -1000"),
            ("many.mha", "many.mha: has 1727 labels, and at most 1000 are shown here. Is it a segmentation of a body?"),
            ("gone.nrrd", "gone.nrrd: there is no such file or folder"),
        ):
            self.assertIn(fault, self.opened(server, file)["error"])

    def test_labels_are_picked_from_the_list_and_saved(self):
        self.begin()
        self.wait_for_slices()
        self.click('[data-do="choose-labels"]')
        self.click('#dialog [data-choose="bones.seg.nrrd"]')
        self.wait("document.querySelectorAll('[data-segment]').length === 2")
        self.click('[aria-label="Go to 2 tibia"]')
        self.wait("document.querySelector('[data-read=\"label\"]').textContent === 'At the crosshair: 2 tibia'")
        self.click('[data-do="add-label"]')
        self.saved_when(lambda document: document["fragments"] == {"tibia": {"label": "tibia", "register": True}})
        # Bone of 900 HU, grey 198 in the window of bone, with 55 % of the fragment's colour, 56b4e9, over it.
        mixed = [198 + 0.55 * (value - 198) for value in (0x56, 0xB4, 0xE9)]
        self.browser.wait(
            COUNTED.replace("arguments[0]", json.dumps(mixed)).replace("return count", "return count > 800")
        )
        self.click('[data-add="5"]')
        self.saved_when(lambda document: "fibula" in document["fragments"])
        self.click('[data-do="segment"]')
        self.wait("!!document.querySelector('[data-segmented=\"full\"]')")
        self.assertRegex(
            self.find("[data-segmented]").text, r"As the pipelines take them: fibula [12]\.\d+ ml, tibia [12]\.\d+ ml"
        )
        self.wait("Number(document.querySelector('canvas.surface').dataset.triangles) > 100")
        text = self.save()
        self.assertIn("copied into it: ct.mha, labels.seg.nrrd, frontal.png", text)
        self.assertNotIn("femur", text)
        written = self.written()
        self.assertEqual((written["ct"], written["labels"]), ("ct.mha", "labels.seg.nrrd"))
        expected = {name: {"label": name, "register": True} for name in ("fibula", "tibia")}
        self.assertEqual(written["fragments"], expected)
        self.reads("ct", "label", "views")
        log = self.browser.driver.get_log("browser")  # requests that the page gave up are in it, too
        self.assertEqual([], [line for line in log if line["level"] == "SEVERE" and line["source"] != "network"])

    def test_a_fragment_takes_another_label_and_seeds_again(self):
        self.begin(labels="bones.seg.nrrd", fragments={"bone": {"seeds": [list(LOWER)], "register": True}})
        self.wait("document.querySelectorAll('[data-segment]').length === 2")
        self.pick("bone", "5 fibula")
        self.saved_when(lambda document: document["fragments"]["bone"] == {"label": "fibula", "register": True})
        self.wait("document.querySelector('[data-segment=\"5\"]').textContent.includes('is the fragment bone')")
        self.pick("bone", "seeds")
        self.saved_when(lambda document: document["fragments"]["bone"] == {"seeds": [], "register": True})
        self.click('[data-add="2"]')
        self.wait(
            "[...document.querySelectorAll('.fragments-panel .fault')].some((one) => one.textContent.includes("
            "'Some fragments are given by seeds, some by label'))"
        )
        self.find('.labels-panel input[type="search"]').send_keys("fib")
        self.wait("document.querySelectorAll('[data-segment]').length === 1")

    def test_a_surface_without_a_ct(self):
        (self.folder / "bone.stl").write_text(octahedron(LOWER, 10))
        self.begin(ct=None, fragments={"bone": {"seeds": [], "register": True}})
        self.pick("bone", "a surface …")
        self.click('#dialog [data-choose="bone.stl"]')
        self.saved_when(lambda document: document["fragments"]["bone"].get("surface") == {"file": "bone.stl"})
        self.browser.js(
            "arguments[0].value = 10; arguments[0].dispatchEvent(new Event('change'))",
            self.find('[aria-label="mm of one unit of the surface of bone"]'),
        )
        self.saved_when(lambda document: document["fragments"]["bone"]["surface"] == {"file": "bone.stl", "scale": 10})
        self.click('[data-do="segment"]')
        self.wait("!!document.querySelector('[data-segmented=\"full\"]')")
        self.assertRegex(self.find("[data-segmented]").text, r"bone 1\.3\d ml", "4/3 r^3 of an octahedron")
        self.assertIn("Saved in", self.save())
        self.assertNotIn("ct", self.written())
        self.assertEqual(self.written()["fragments"]["bone"]["surface"], {"file": "bone.stl", "scale": 10})
        self.reads("surface")

    def test_labels_without_a_ct_are_shown_over_air(self):
        self.begin(ct=None, labels="bones.seg.nrrd", fragments={"tibia": {"label": 2, "register": True}})
        self.wait_for_slices()
        self.wait("document.querySelector('.ct-panel').textContent.includes('The slices have the grid of the labels.')")
        self.click('[aria-label="Go to 2 tibia"]')
        mixed = [0.55 * value for value in (0x56, 0xB4, 0xE9)]
        self.browser.wait(
            COUNTED.replace("arguments[0]", json.dumps(mixed)).replace("return count", "return count > 800")
        )
        self.assertIn("Saved in", self.save())
        self.assertEqual(self.written()["labels"], "labels.seg.nrrd")
        self.assertEqual(self.written()["fragments"]["tibia"]["label"], 2)

    def test_what_cannot_be_saved_is_said(self):
        far = {**LABELS, "origin_mm": (500.0, 0.0, 0.0)}
        (self.folder / "far.seg.nrrd").write_bytes(ct_cases.seg_nrrd(far, self.values, SEGMENTS))
        (self.folder / "bone.stl").write_text(octahedron((2000, 0, 0), 10))
        before = "the case is not saved, and what was in its folder is as before: "
        server = self.enter()
        view = {"name": "frontal", "image": "front.png", "camera": ct_cases.CAMERA}
        for revision, (document, fault) in enumerate(
            (
                (
                    {"labels": "far.seg.nrrd", "fragments": {"a": {"label": "tibia"}}},
                    before + "fragment 'a': its label lies outside the CT; were both made from the same scan?",
                ),
                (
                    {"fragments": {"a": {"surface": {"file": "bone.stl"}}}},
                    before
                    + "fragment 'a': its surface lies outside the CT; is it in cm, in another frame (RAS), or of "
                    "another scan?",
                ),
                (
                    {"fragments": {"a": {"label": "tibia"}, "b": {"surface": {"file": "gone.stl"}}}},
                    "fragment 'a' has a label, but there is no label map; choose one\n  "
                    "fragment 'b', its surface: there is no 'gone.stl' any more",
                ),
                ({"labels": "bones.seg.nrrd", "fragments": {"a": {"label": "femur"}}}, "has no segment 'femur'"),
            )
        ):
            document = {"ct": {"file": "scan.mha"}, "views": [view], "landmarks": [], **document}
            asked = {"case": "c", "revision": revision, "what": "x", "document": document}
            server.json("POST", "/api/draft/change", asked)
            job = server.json("POST", "/api/case/save", {"case": "c", "revision": revision + 1})["job"]
            self.assertIn(fault, server.finish(job)["error"])
        self.assertFalse((self.folder / "c").exists())


if __name__ == "__main__":
    bench.main()
