#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Segmenting on the page "Case": first coarse, then full, with outlines that lie on the bone's surface."""
import array
import json
import math
import unittest
import urllib.parse

import ct_cases
from bench import BenchTest
from harness import formats

SMALL, LARGE = (40, 36, 44), (120, 116, 124)  # the large one has more voxels than a coarse grid


class SegmentTest(BenchTest):
    def begin(self, size, centres, radius, grid=None):
        """A server with an open CT of two balls; the name of the CT."""
        values = ct_cases.two_balls(size, *centres, radius)
        (self.folder / "ct.mha").write_bytes(formats.mha(grid or formats.straight(size), values))
        server = self.open()
        server.enter()
        state = server.finish(server.json("POST", "/api/ct/open", {"ct": {"file": "ct.mha"}})["job"])
        return server, state["result"]["name"]

    def segment(self, server, ct, fragments, method="bone", **more):
        return server.json("POST", "/api/segment", {"ct": ct, "fragments": fragments, "method": method, **more})["job"]

    def outlines(self, server, segmentation, axis, index):
        """The ends of the lines of each fragment, in indices of the two other axes."""
        query = "segmentation=%s&axis=%d&index=%d" % (segmentation, axis, index)
        status, headers, content = server.ask("GET", "/api/segmentation/outlines?" + query)
        self.assertEqual(status, 200, content)
        numbers, result = array.array("f", content), {}
        for fragment in json.loads(headers["X-Marrow-About"]):
            part, numbers = numbers[: fragment["numbers"]], numbers[fragment["numbers"] :]
            result[fragment["name"]] = list(zip(part[::2], part[1::2]))
        return result

    def test_outlines_lie_on_the_surface_in_a_flipped_grid_of_long_voxels(self):
        grid = {
            **formats.straight(SMALL, (0.8, 0.8, 1.6), (5.0, -7.0, 90.0)),
            "direction": [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
        }
        centres, radius = ((20, 18, 11), (20, 18, 32)), 8
        server, ct = self.begin(SMALL, centres, radius, grid)
        fragments = {
            "one": {"seeds": [ct_cases.point_of(grid, centres[0])]},
            "two": {"seeds": [ct_cases.point_of(grid, centres[1])], "register": False},
        }
        state = server.finish(self.segment(server, ct, fragments))
        self.assertEqual(state["state"], "done", state["error"])
        result = state["result"]
        self.assertEqual([event["stage"] for event in state["events"] if event["event"] == "grown"], ["full"])
        self.assertEqual(list(result["volumes_ml"]), ["one"], "the other one is only separated from it")
        ball_ml = 4 / 3 * math.pi * radius**3 * 0.8 * 0.8 * 1.6 / 1000
        self.assertAlmostEqual(result["volumes_ml"]["one"] / ball_ml, 1, delta=0.1)
        for axis in range(3):
            middle = [centres[0][k] for k in range(3) if k != axis]
            ends = self.outlines(server, result["segmentation"], axis, centres[0][axis])["one"]
            self.assertGreater(len(ends), 60)
            for end in ends:
                self.assertAlmostEqual(math.dist(end, middle), radius, delta=0.8)
        self.assertEqual(self.outlines(server, result["segmentation"], 2, 32)["one"], [])

    def test_the_coarse_result_comes_first_and_lies_in_the_same_place(self):
        centres, radius = ((60, 58, 40), (60, 58, 95)), 20
        server, ct = self.begin(LARGE, centres, radius)
        fragments = {"one": {"seeds": [centres[0]]}, "two": {"seeds": [centres[1]]}}
        job = self.segment(server, ct, fragments)
        seen, since = [], 0
        while not seen:
            state = server.json("GET", "/api/job?job=%s&since=%d" % (job, since))
            since = state["next"]
            seen = [event for event in state["events"] if event["event"] == "grown"]
            self.assertNotEqual(state["state"], "failed", state["error"])
        self.assertEqual(seen[0]["stage"], "coarse")
        for axis in range(3):
            middle = [centres[0][k] for k in range(3) if k != axis]
            for end in self.outlines(server, seen[0]["segmentation"], axis, centres[0][axis])["one"]:
                self.assertAlmostEqual(math.dist(end, middle), radius, delta=1.2)
        state = server.finish(job)
        stages = [event["stage"] for event in state["events"] if event["event"] == "grown"]
        self.assertEqual((state["state"], stages), ("done", ["coarse", "full"]))
        for name in ("one", "two"):
            self.assertAlmostEqual(seen[0]["volumes_ml"][name] / state["result"]["volumes_ml"][name], 1, delta=0.1)

    def test_a_level_set_does_it_too(self):
        centres = ((20, 18, 11), (20, 18, 32))
        server, ct = self.begin(SMALL, centres, 8)
        state = server.finish(self.segment(server, ct, {"one": {"seeds": [centres[0]]}}, "femur"))
        self.assertEqual(state["state"], "done", state["error"])
        self.assertAlmostEqual(state["result"]["volumes_ml"]["one"], 4 / 3 * math.pi * 8**3 / 1000, delta=0.4)

    def test_the_surface_is_a_closed_one_around_the_seed(self):
        centres = ((20, 18, 11), (20, 18, 32))
        server, ct = self.begin(SMALL, centres, 8)
        name = "<one> & more"
        result = server.finish(self.segment(server, ct, {name: {"seeds": [centres[0]]}}))["result"]
        query = urllib.parse.urlencode({"segmentation": result["segmentation"], "fragment": name})
        status, headers, content = server.ask("GET", "/api/segmentation/surface?" + query)
        about = json.loads(headers["X-Marrow-About"])
        self.assertEqual((status, len(content)), (200, 12 * about["vertices"] + 12 * about["triangles"]))
        vertices = array.array("f", content[: 12 * about["vertices"]])
        for i in range(0, len(vertices), 3):
            self.assertAlmostEqual(math.dist(vertices[i : i + 3], centres[0]), 8, delta=0.8)
        self.assertLess(max(array.array("I", content[12 * about["vertices"] :])), about["vertices"])

    def test_what_is_wrong_is_said(self):
        server, ct = self.begin(SMALL, ((20, 18, 11), (20, 18, 32)), 8)
        seed = {"one": {"seeds": [[20, 18, 11]]}}
        for asked, status, fault in (
            ({"fragments": {}}, 400, "there is no fragment; add one, with seeds inside its bone"),
            ({"fragments": {"one": {}}}, 400, "fragment 'one' has no seed; click inside its bone first"),
            ({"method": "magic"}, 400, "the method must be 'bone', 'femur' or 'given', got 'magic'"),
            ({"ct": "ct-99"}, 409, "this CT is no longer in memory; it is opened again"),
        ):
            answer = server.ask("POST", "/api/segment", {"ct": ct, "fragments": seed, "method": "bone", **asked})
            self.assertEqual((answer[0], json.loads(answer[2])["error"]), (status, fault))
        answer = server.ask("GET", "/api/segmentation/outlines?segmentation=x&axis=0&index=0")
        self.assertEqual(
            (answer[0], json.loads(answer[2])["error"]),
            (409, "this segmentation is no longer in memory; segment again"),
        )
        state = server.finish(self.segment(server, ct, {"one": {"seeds": [[2, 2, 2]]}}))
        self.assertEqual(state["state"], "failed")
        self.assertIn("fragment 'one'", state["error"])
        state = server.finish(self.segment(server, ct, seed, threshold_hu=5000))
        self.assertIn("no voxel reaches the threshold of 5000 HU", state["error"])

    def test_too_many_fragments_for_the_memory(self):
        size, bone = (512, 512, 400), b"\x84\x03" * (512 * 512)  # 900 HU
        with open(self.folder / "ct.mha", "wb") as file:
            file.write(formats.mha(formats.straight(size), []))
            begin = file.tell()
            for z in range(100, 130):
                file.seek(begin + 2 * 512 * 512 * z)
                file.write(bone)
            file.truncate(begin + 2 * 512 * 512 * 400)
        server = self.open()
        server.enter()
        ct = server.finish(server.json("POST", "/api/ct/open", {"ct": {"file": "ct.mha"}})["job"])["result"]["name"]
        fragments = {"part %d" % i: {"seeds": [[30 + 60 * i, 250, 115]]} for i in range(8)}
        state = server.finish(self.segment(server, ct, fragments))
        self.assertRegex(
            state["error"],
            r"^on the grid of the CT, 8 fragments would take 3\.4 GB of memory, and at most \d\.\d GB are used here; "
            r"the result on the coarse grid stays\. Register fewer fragments, or cut the CT to the bone$",
        )
        self.assertEqual([event["stage"] for event in state["events"] if event["event"] == "grown"], ["coarse"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
