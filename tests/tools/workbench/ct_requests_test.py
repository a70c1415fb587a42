#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The server's answers about CTs and label maps: reading them, doubts about them, the places of their voxels, and their
segmentation, first coarse, then full, with outlines that lie on the bone's surface."""
import array
import math
import os
import socket
import struct
import subprocess
import urllib.parse

import numpy
import yaml

import made_cases
from bench import BenchTest
from harness import MARROW, formats
from harness.page import main
from made_cases import LOWER, RADIUS, SIZE, UPPER, balls, point_of, two_balls, write_scan

LARGE = (120, 116, 124)  # it has more voxels than a coarse grid
# Coarser than the CT, mirrored in x and z, and it does not cover the CT's first and last slices.
LABELS = formats.straight((20, 18, 20), (2.0, 2.0, 2.0), (38.5, 0.5, 40.5))
LABELS["direction"] = [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]


class CtTest(BenchTest):
    def opened(self, **ct):
        """The state of the job that reads it, when it has ended."""
        return self.server.job("/api/ct/open", ct=ct)

    def name(self, **ct):
        return self.opened(**ct)["result"]["name"]

    def setUp(self):
        super().setUp()
        write_scan(self.folder)
        self.enter()

    def test_slices_hold_the_values_of_the_volume(self):
        values = (7 * numpy.arange(numpy.prod(SIZE))) % 3000 - 1000
        write_scan(self.folder, values=values)
        about = self.opened(file="scan.mha")["result"]
        self.assertEqual((about["size"], about["doubts"]), (list(SIZE), []))
        self.assertEqual((about["lowest_hu"], about["highest_hu"]), (values.min(), values.max()))
        volume = values.reshape(SIZE[::-1])
        for axis, index, wanted in ((2, 5, volume[5]), (1, 35, volume[:, 35]), (0, 0, volume[:, :, 0])):
            path = "/api/ct/slice?ct=%s&axis=%d&index=%d" % (about["name"], axis, index)
            self.assertEqual(numpy.frombuffer(self.server.bytes(path)[1], "<i2").tolist(), wanted.ravel().tolist())
        for query, status, fault in (
            ("ct=%s&axis=2&index=44" % about["name"], 400, "'index' must be a whole number from 0 to 43, got '44'"),
            ("ct=%s&axis=3&index=0" % about["name"], 400, "'axis' must be a whole number from 0 to 2, got '3'"),
            ("ct=ct-99&axis=2&index=0", 409, "this CT is no longer in memory; it is opened again"),
        ):
            self.assertEqual(self.server.fault("/api/ct/slice?" + query, status=status), fault)

    def test_two_tabs_share_one_copy_until_the_file_changes_or_vanishes(self):
        first = self.name(file="scan.mha")
        self.assertEqual(self.name(file="scan.mha"), first)
        self.assertNotEqual(self.name(file="scan.mha", flip=["z"]), first)
        write_scan(self.folder, values=-1000 * numpy.ones(numpy.prod(SIZE), int))
        second = self.name(file="scan.mha")
        self.assertNotEqual(second, first)
        (self.folder / "scan.mha").unlink()
        self.assertEqual(self.server.ask("GET", "/api/ct/slice?ct=%s&axis=0&index=3" % second)[0], 200)
        self.assertIn("there is no such file or folder", self.opened(file="scan.mha")["error"])

    def test_what_looks_wrong_is_said(self):
        for name, grid, lowest, doubt in (
            (
                "offset.mha",
                {},
                0,
                "No value is below -500 HU (the lowest is 0), but air is near -1000 HU. Is this a CT? If its file "
                "holds HU + 1024, give the offset -1024.",
            ),
            (
                "oblique.mha",
                {"direction": made_cases.turned((0, 0, 30))},
                -1000,
                "The axes of its grid are turned by 30 degrees from the patient's. The slices follow the grid, so "
                "they are oblique.",
            ),
            (
                "thin.mha",
                {"size": (40, 36, 4)},
                -1000,
                "It has only 4 slices along one of its axes. Are files of the series missing?",
            ),
            (
                "thick.mha",
                {"spacing_mm": (0.5, 0.5, 5.0)},
                -1000,
                "Its voxels are 5 mm long and 0.5 mm wide, so the bone's surface is not well known along the longer "
                "side.",
            ),
        ):
            grid = {**formats.straight(SIZE), **grid}
            write_scan(self.folder, name, grid, [lowest, lowest + 2000] * (math.prod(grid["size"]) // 2))
            self.assertEqual(self.opened(file=name)["result"]["doubts"], [doubt])
        self.assertEqual(self.opened(file="offset.mha", value_offset_hu=-1024)["result"]["doubts"], [])

    def test_what_cannot_be_read_is_said_in_words(self):
        (self.folder / "notes.txt").write_text("")
        whole = formats.mha(formats.straight((4, 4, 4)), [0] * 64)
        (self.folder / "cut.mha").write_bytes(whole[:-9])
        (self.folder / "sizeless.mha").write_bytes(whole.replace(b"ElementSpacing = 1.0 1.0 1.0\n", b""))
        with open(self.folder / "huge.mha", "wb") as file:
            file.write(formats.mha(formats.straight((1000, 1000, 1000)), []))
            file.truncate(2_000_000_300)  # takes no room on the disk
        for file, fault in (
            ("gone.mha", "there is no such file or folder"),
            ("notes.txt", r"not a volume that can be read; known are \.mha"),
            ("cut.mha", r"cut\.mha: "),
            ("sizeless.mha", "voxel_size_mm"),
            (
                "huge.mha",
                r"^this CT would take about 4\.0 GB of memory, and at most \d\.\d GB are used for CTs here; cut it to "
                "the bone, or store it with larger voxels$",
            ),
        ):
            state = self.opened(file=file)
            self.assertEqual(state["state"], "failed", file)
            self.assertRegex(state["error"], fault)
        spacing_mm = self.opened(file="sizeless.mha", voxel_size_mm=[1, 2, 3])["result"]["spacing_mm"]
        self.assertEqual(spacing_mm, [1, 2, 3])
        outside = self.server.fault("/api/ct/open", {"ct": {"file": "../ct.mha"}})
        self.assertIn("leads out of the folder", outside)
        self.assertEqual(self.server.fault("/api/ct/open", {"ct": {}}), "the request names no file of a CT")

    def test_a_browser_that_goes_away_harms_nothing(self):
        job = self.server.post("/api/ct/open", ct={"file": "scan.mha"})["job"]
        request = "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nCookie: %s\r\n\r\n"
        for path in ["/api/job?job=%s&since=0" % job] + 20 * ["/api/ct/slice?ct=ct-1&axis=0&index=1"]:
            with socket.create_connection(("127.0.0.1", self.server.port)) as connection:
                connection.sendall((request % (path, self.server.port, self.server.cookie)).encode())
        name = self.server.finish(job)["result"]["name"]
        self.assertEqual(self.server.ask("GET", "/api/ct/slice?ct=%s&axis=0&index=3" % name)[0], 200)

    def test_the_shown_command_reads_the_same(self):
        name = "it's $HOME.mha"
        write_scan(self.folder, name)
        command = self.server.post("/api/ct/open", ct={"file": name, "flip": ["z"]})["command"]
        environment = {**os.environ, "PATH": "%s:%s" % (MARROW.parent, os.environ["PATH"])}
        environment["MARROW_CACHE"] = str(self.scratch / "store")
        ended = subprocess.run(command, shell=True, cwd=self.folder, env=environment, capture_output=True, text=True)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        resolved = yaml.safe_load((self.folder / "runs" / "node" / "pipeline.yaml").read_text())["nodes"]["node"]
        path = str(self.folder.resolve() / name.replace("$", "$$"))
        self.assertEqual((resolved["with"]["flip"], resolved["with"]["path"]), (["z"], path))


class LabelsTest(BenchTest):
    def setUp(self):
        super().setUp()
        write_scan(self.folder)
        self.values = balls(LABELS, (2, LOWER, RADIUS), (5, UPPER, RADIUS))
        self.write("bones.seg.nrrd", ("tibia", 2), ("fibula", 5))
        self.enter()

    def write(self, name, *segments):
        (self.folder / name).write_bytes(made_cases.seg_nrrd(LABELS, self.values, segments))

    def opened(self, file="bones.seg.nrrd"):
        return self.server.job("/api/labels/open", labels=file)

    def test_segments_are_described_and_slices_follow_the_grid_of_the_ct(self):
        result = self.opened()["result"]
        segments = result["segments"]
        described = [(one["number"], one["name"], one["label"]) for one in segments]
        self.assertEqual(described, [(2, "tibia", "tibia"), (5, "fibula", "fibula")])
        for one, centre in zip(segments, (LOWER, UPPER)):
            self.assertEqual(one["volume_ml"], (self.values == one["number"]).sum() * 8 / 1000)
            self.assertLess(math.dist(one["middle_mm"], centre), math.sqrt(3))
        self.assertNotIn("ct", result)
        ct = self.server.done("/api/ct/open", ct={"file": "scan.mha"})["name"]
        for axis, index in ((0, 20), (1, 18), (2, 11), (2, 0)):
            low, high = [k for k in range(3) if k != axis]
            path = "/api/labels/slice?labels=%s&ct=%s&axis=%d&index=%d" % (result["name"], ct, axis, index)
            places = array.array("H", self.server.bytes(path)[1])
            self.assertEqual(len(places), SIZE[low] * SIZE[high])
            for i, place in enumerate(places):
                at = [index, index, index]
                at[low], at[high] = i % SIZE[low], i // SIZE[low]
                distances = {1: math.dist(at, LOWER), 2: math.dist(at, UPPER)}
                inside = [number for number, far in distances.items() if far < RADIUS - 1.8]
                near = [number for number, far in distances.items() if far < RADIUS + 1.8]
                self.assertIn(place, inside or near + [0], at)
        self.assertEqual(set(places), {0}, "the labels do not reach the first slice")
        fault = self.server.fault("/api/labels/slice?labels=labels-9&ct=%s&axis=0&index=0" % ct, status=409)
        self.assertEqual(fault, "this label map is no longer in memory; it is opened again")

    def test_the_label_is_what_tells_a_segment_from_the_others(self):
        for number, (segments, labels) in enumerate(
            (
                ((("bone", 2), ("bone", 5)), [2, 5]),
                ((("11", 2), ("fibula", 5)), [2, "fibula"]),
                ((("tibia", 2), ("bone", 5), ("bone", 5)), ["tibia", None, None]),
            )
        ):
            self.write("%d.seg.nrrd" % number, *segments)
            found = self.opened("%d.seg.nrrd" % number)["result"]["segments"]
            self.assertEqual([one["label"] for one in found], labels)

    def test_what_is_no_label_map_is_said(self):
        header = formats.mha(formats.straight((12, 12, 12)), [])
        (self.folder / "many.mha").write_bytes(header + struct.pack("<1728h", *range(1728)))
        for file, fault in (
            ("scan.mha", "scan.mha: is no label map: a voxel has the value -1000"),
            ("many.mha", "many.mha: has 1727 labels, and at most 1000 are shown here. Is it a segmentation of a body?"),
            ("gone.nrrd", "gone.nrrd: there is no such file or folder"),
        ):
            self.assertIn(fault, self.opened(file)["error"])


class SegmentTest(BenchTest):
    def begin(self, size=SIZE, centres=(LOWER, UPPER), radius=RADIUS, grid=None):
        """A server with an open CT of two balls."""
        write_scan(self.folder, grid=grid or formats.straight(size), values=two_balls(size, *centres, radius))
        self.enter()
        self.ct = self.server.done("/api/ct/open", ct={"file": "scan.mha"})["name"]

    def segment(self, fragments, method="bone", **more):
        job = self.server.post("/api/segment", ct=self.ct, fragments=fragments, method=method, **more)["job"]
        return self.server.finish(job)

    def outlines(self, segmentation, axis, index):
        """The ends of the lines of each fragment, in indices of the two other axes."""
        query = "segmentation=%s&axis=%d&index=%d" % (segmentation, axis, index)
        about, content = self.server.bytes("/api/segmentation/outlines?" + query)
        numbers, result = array.array("f", content), {}
        for fragment in about:
            part, numbers = numbers[: fragment["numbers"]], numbers[fragment["numbers"] :]
            result[fragment["name"]] = list(zip(part[::2], part[1::2]))
        return result

    def lie_on_the_surface(self, segmentation, centre, radius, delta):
        for axis in range(3):
            middle = [centre[k] for k in range(3) if k != axis]
            ends = self.outlines(segmentation, axis, centre[axis])["one"]
            self.assertGreater(len(ends), 60)
            for end in ends:
                self.assertAlmostEqual(math.dist(end, middle), radius, delta=delta)

    def grown(self, state):
        return [event for event in state["events"] if event["event"] == "grown"]

    def test_outlines_lie_on_the_surface_in_a_flipped_grid_of_long_voxels(self):
        grid = formats.straight(SIZE, (0.8, 0.8, 1.6), (5.0, -7.0, 90.0))
        grid["direction"] = LABELS["direction"]
        self.begin(grid=grid)
        fragments = {
            "one": {"seeds": [point_of(grid, LOWER)]},
            "two": {"seeds": [point_of(grid, UPPER)], "register": False},
        }
        state = self.segment(fragments)
        self.assertEqual(state["state"], "done", state["error"])
        result = state["result"]
        self.assertEqual([event["stage"] for event in self.grown(state)], ["full"])
        self.assertEqual(list(result["volumes_ml"]), ["one"], "the other one is only separated from it")
        ball_ml = 4 / 3 * math.pi * RADIUS**3 * 0.8 * 0.8 * 1.6 / 1000
        self.assertAlmostEqual(result["volumes_ml"]["one"] / ball_ml, 1, delta=0.1)
        self.lie_on_the_surface(result["segmentation"], LOWER, RADIUS, 0.8)
        self.assertEqual(self.outlines(result["segmentation"], 2, 32)["one"], [])

    def test_the_coarse_result_comes_first_and_lies_in_the_same_place(self):
        centres, radius = ((60, 58, 40), (60, 58, 95)), 20
        self.begin(LARGE, centres, radius)
        fragments = {"one": {"seeds": [centres[0]]}, "two": {"seeds": [centres[1]]}}
        job = self.server.post("/api/segment", ct=self.ct, fragments=fragments, method="bone")["job"]
        seen, since = [], 0
        while not seen:
            state = self.server.get("/api/job?job=%s&since=%d" % (job, since))
            since = state["next"]
            seen = self.grown(state)
            self.assertNotEqual(state["state"], "failed", state["error"])
        self.assertEqual(seen[0]["stage"], "coarse")
        self.lie_on_the_surface(seen[0]["segmentation"], centres[0], radius, 1.2)
        state = self.server.finish(job)
        stages = [event["stage"] for event in self.grown(state)]
        self.assertEqual((state["state"], stages), ("done", ["coarse", "full"]))
        for name in ("one", "two"):
            self.assertAlmostEqual(seen[0]["volumes_ml"][name] / state["result"]["volumes_ml"][name], 1, delta=0.1)

    def test_a_level_set_does_it_too_and_the_surface_is_a_closed_one(self):
        self.begin()
        name = "<one> & more"
        for method in ("femur", "bone"):
            result = self.segment({name: {"seeds": [LOWER]}}, method)["result"]
            self.assertAlmostEqual(result["volumes_ml"][name], 4 / 3 * math.pi * 8**3 / 1000, delta=0.4)
        query = urllib.parse.urlencode({"segmentation": result["segmentation"], "fragment": name})
        about, content = self.server.bytes("/api/segmentation/surface?" + query)
        self.assertEqual(len(content), 12 * about["vertices"] + 12 * about["triangles"])
        vertices = array.array("f", content[: 12 * about["vertices"]])
        for i in range(0, len(vertices), 3):
            self.assertAlmostEqual(math.dist(vertices[i : i + 3], LOWER), 8, delta=0.8)
        self.assertLess(max(array.array("I", content[12 * about["vertices"] :])), about["vertices"])

    def test_what_is_wrong_is_said(self):
        self.begin()
        seed = {"one": {"seeds": [LOWER]}}
        for asked, status, fault in (
            ({"fragments": {}}, 400, "there is no fragment; add one, with seeds inside its bone"),
            ({"fragments": {"one": {}}}, 400, "fragment 'one' has no seed; click inside its bone first"),
            ({"method": "magic"}, 400, "the method must be 'bone', 'femur' or 'given', got 'magic'"),
            ({"ct": "ct-99"}, 409, "this CT is no longer in memory; it is opened again"),
        ):
            asked = {"ct": self.ct, "fragments": seed, "method": "bone", **asked}
            self.assertEqual(self.server.fault("/api/segment", asked, status), fault)
        fault = self.server.fault("/api/segmentation/outlines?segmentation=x&axis=0&index=0", status=409)
        self.assertEqual(fault, "this segmentation is no longer in memory; segment again")
        state = self.segment({"one": {"seeds": [[2, 2, 2]]}})
        self.assertEqual(state["state"], "failed")
        self.assertIn("fragment 'one'", state["error"])
        state = self.segment(seed, threshold_hu=5000)
        self.assertIn("no voxel reaches the threshold of 5000 HU", state["error"])

    def test_too_many_fragments_for_the_memory(self):
        size, bone = (512, 512, 400), b"\x84\x03" * (512 * 512)  # 900 HU
        with open(self.folder / "ct.mha", "wb") as file:
            file.write(formats.mha(formats.straight(size), []))
            begin = file.tell()
            file.seek(begin + 2 * 512 * 512 * 100)
            file.write(30 * bone)
            file.truncate(begin + 2 * 512 * 512 * 400)
        self.enter()
        self.ct = self.server.done("/api/ct/open", ct={"file": "ct.mha"})["name"]
        state = self.segment({"part %d" % i: {"seeds": [[30 + 60 * i, 250, 115]]} for i in range(8)})
        self.assertRegex(
            state["error"],
            r"^on the grid of the CT, 8 fragments would take 3\.4 GB of memory, and at most \d\.\d GB are used here; "
            r"the result on the coarse grid stays\. Register fewer fragments, or cut the CT to the bone$",
        )
        self.assertEqual([event["stage"] for event in self.grown(state)], ["coarse"])


if __name__ == "__main__":
    main(part=2, needs_browser=False)
