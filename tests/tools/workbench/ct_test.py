#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The CT of the page "Case": reading it, doubts about it, the places of its voxels, and the server's answers."""
import array
import json
import math
import os
import random
import re
import socket
import subprocess

import yaml

import bench
import ct_cases
from bench import BenchTest, PageTest
from harness import formats
from harness.modules import modules

SIZE = (40, 36, 32)


class CtServerTest(BenchTest):
    def opened(self, server, **ct):
        """The state of the job that reads it, when it has ended."""
        return server.finish(server.json("POST", "/api/ct/open", {"ct": ct})["job"])

    def write(self, name, grid=None, values=None):
        grid = grid or formats.straight(SIZE)
        count = grid["size"][0] * grid["size"][1] * grid["size"][2]
        (self.folder / name).write_bytes(formats.mha(grid, values or [-1000, 1000] * (count // 2)))

    def enter(self):
        server = self.open()
        server.enter()
        return server

    def test_slices_hold_the_values_of_the_volume(self):
        values = [(7 * i) % 3000 - 1000 for i in range(SIZE[0] * SIZE[1] * SIZE[2])]
        self.write("ct.mha", values=values)
        server = self.enter()
        about = self.opened(server, file="ct.mha")["result"]
        self.assertEqual((about["size"], about["doubts"]), (list(SIZE), []))
        self.assertEqual((about["lowest_hu"], about["highest_hu"]), (min(values), max(values)))
        at = lambda x, y, z: values[(z * SIZE[1] + y) * SIZE[0] + x]
        for axis, index, wanted in (
            (2, 5, [at(x, y, 5) for y in range(SIZE[1]) for x in range(SIZE[0])]),
            (1, 35, [at(x, 35, z) for z in range(SIZE[2]) for x in range(SIZE[0])]),
            (0, 0, [at(0, y, z) for z in range(SIZE[2]) for y in range(SIZE[1])]),
        ):
            path = "/api/ct/slice?ct=%s&axis=%d&index=%d" % (about["name"], axis, index)
            self.assertEqual(list(array.array("h", server.ask("GET", path)[2])), wanted)

    def test_a_slice_that_is_not_there(self):
        self.write("ct.mha")
        server = self.enter()
        name = self.opened(server, file="ct.mha")["result"]["name"]
        for query, status, fault in (
            ("ct=%s&axis=2&index=32" % name, 400, "'index' must be a whole number from 0 to 31, got '32'"),
            ("ct=%s&axis=3&index=0" % name, 400, "'axis' must be a whole number from 0 to 2, got '3'"),
            ("ct=ct-99&axis=2&index=0", 409, "this CT is no longer in memory; it is opened again"),
        ):
            answer = server.ask("GET", "/api/ct/slice?" + query)
            self.assertEqual((answer[0], json.loads(answer[2])["error"]), (status, fault))

    def test_two_tabs_share_one_copy_until_the_file_changes(self):
        self.write("ct.mha")
        server = self.enter()
        first, second = (self.opened(server, file="ct.mha")["result"]["name"] for _ in range(2))
        self.assertEqual(first, second)
        self.assertNotEqual(self.opened(server, file="ct.mha", flip=["z"])["result"]["name"], first)
        self.write("ct.mha", values=[-1000] * (SIZE[0] * SIZE[1] * SIZE[2]))
        self.assertNotEqual(self.opened(server, file="ct.mha")["result"]["name"], first)

    def test_what_looks_wrong_is_said(self):
        count = SIZE[0] * SIZE[1] * SIZE[2]
        self.write("offset.mha", values=[0, 2000] * (count // 2))
        self.write("oblique.mha", {**formats.straight(SIZE), "direction": ct_cases.turned((0, 0, 30))})
        self.write("thin.mha", formats.straight((40, 36, 4)))
        self.write("thick.mha", formats.straight(SIZE, (0.5, 0.5, 5.0)))
        server = self.enter()
        for file, doubt in (
            (
                "offset.mha",
                "No value is below -500 HU (the lowest is 0), but air is near -1000 HU. Is this a CT? If its file "
                "holds HU + 1024, give the offset -1024.",
            ),
            (
                "oblique.mha",
                "The axes of its grid are turned by 30 degrees from the patient's. The slices follow the grid, so "
                "they are oblique.",
            ),
            ("thin.mha", "It has only 4 slices along one of its axes. Are files of the series missing?"),
            (
                "thick.mha",
                "Its voxels are 5 mm long and 0.5 mm wide, so the bone's surface is not well known along the longer "
                "side.",
            ),
        ):
            self.assertEqual(self.opened(server, file=file)["result"]["doubts"], [doubt])
        self.assertEqual(self.opened(server, file="offset.mha", value_offset_hu=-1024)["result"]["doubts"], [])

    def test_what_cannot_be_read_is_said_in_words(self):
        (self.folder / "notes.txt").write_text("")
        (self.folder / "cut.mha").write_bytes(formats.mha(formats.straight((4, 4, 4)), [0] * 64)[:-9])
        whole = formats.mha(formats.straight((4, 4, 4)), [0] * 64)
        (self.folder / "sizeless.mha").write_bytes(whole.replace(b"ElementSpacing = 1.0 1.0 1.0\n", b""))
        server = self.enter()
        for file, fault in (
            ("gone.mha", "there is no such file or folder"),
            ("notes.txt", "not a volume that can be read; known are .mha"),
            ("cut.mha", "cut.mha: "),
            ("sizeless.mha", "voxel_size_mm"),
        ):
            state = self.opened(server, file=file)
            self.assertEqual(state["state"], "failed", file)
            self.assertIn(fault, state["error"])
        self.assertEqual(
            self.opened(server, file="sizeless.mha", voxel_size_mm=[1, 2, 3])["result"]["spacing_mm"], [1, 2, 3]
        )
        answer = server.ask("POST", "/api/ct/open", {"ct": {"file": "../ct.mha"}})
        self.assertEqual(answer[0], 400)
        self.assertIn("leads out of the folder", json.loads(answer[2])["error"])
        answer = server.ask("POST", "/api/ct/open", {"ct": {}})
        self.assertEqual(json.loads(answer[2])["error"], "the request names no file of a CT")

    def test_a_volume_of_2_gb_is_refused_before_it_is_read(self):
        with open(self.folder / "huge.mha", "wb") as file:
            file.write(formats.mha(formats.straight((1000, 1000, 1000)), []))
            file.truncate(2_000_000_300)  # takes no room on the disk
        state = self.opened(self.enter(), file="huge.mha")
        self.assertRegex(
            state["error"],
            r"^this CT would take about 4\.0 GB of memory, and at most \d\.\d GB are used for CTs here; cut it to the "
            "bone, or store it with larger voxels$",
        )

    def test_a_ct_that_vanishes_stays_open_and_is_not_opened_again(self):
        self.write("ct.mha")
        server = self.enter()
        name = self.opened(server, file="ct.mha")["result"]["name"]
        (self.folder / "ct.mha").unlink()
        self.assertEqual(server.ask("GET", "/api/ct/slice?ct=%s&axis=0&index=3" % name)[0], 200)
        self.assertIn("there is no such file or folder", self.opened(server, file="ct.mha")["error"])

    def test_a_browser_that_goes_away_harms_nothing(self):
        self.write("ct.mha")
        server = self.enter()
        job = server.json("POST", "/api/ct/open", {"ct": {"file": "ct.mha"}})["job"]
        request = "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nCookie: %s\r\n\r\n"
        for path in ["/api/job?job=%s&since=0" % job] + 20 * ["/api/ct/slice?ct=ct-1&axis=0&index=1"]:
            with socket.create_connection(("127.0.0.1", server.port)) as connection:
                connection.sendall((request % (path, server.port, server.cookie)).encode())
        name = server.finish(job)["result"]["name"]
        self.assertEqual(server.ask("GET", "/api/ct/slice?ct=%s&axis=0&index=3" % name)[0], 200)

    def test_the_shown_command_reads_the_same(self):
        self.write("ct.mha")
        name = "it's $HOME.mha"
        self.write(name)
        command = self.enter().json("POST", "/api/ct/open", {"ct": {"file": name, "flip": ["z"]}})["command"]
        environment = {**os.environ, "PATH": "%s:%s" % (bench.MARROW.parent, os.environ["PATH"])}
        environment["MARROW_CACHE"] = str(self.scratch / "store")
        ended = subprocess.run(command, shell=True, cwd=self.folder, env=environment, capture_output=True, text=True)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        resolved = yaml.safe_load((self.folder / "runs" / "node" / "pipeline.yaml").read_text())
        self.assertEqual(resolved["nodes"]["node"]["with"]["flip"], ["z"])
        self.assertEqual(
            resolved["nodes"]["node"]["with"]["path"], str(self.folder.resolve() / name.replace("$", "$$"))
        )


def random_geometry(chance):
    """A grid with any size of voxels, turned and flipped in any way; axes in any order."""
    rows = ct_cases.turned([chance.uniform(-180, 180) for _ in range(3)])
    if chance.random() < 0.5:  # as most scanners: along the patient's axes, but in any order and direction
        order, signs = chance.sample(range(3), 3), [chance.choice((-1, 1)) for _ in range(3)]
        rows = [[signs[k] if order[k] == row else 0 for k in range(3)] for row in range(3)]
    return {
        "size": [chance.randint(8, 512) for _ in range(3)],
        "spacing_mm": [chance.uniform(0.2, 3) for _ in range(3)],
        "origin_mm": [chance.uniform(-500, 500) for _ in range(3)],
        "direction": rows,
    }


class CtPageTest(PageTest):
    def open_case(self, grid, values, width_px=1440, theme="light", name="ct.mha"):
        (self.folder / name).write_bytes(formats.mha(grid, values))
        server = self.open()
        self.show(server, "case=mine", width_px=width_px, theme=theme)
        self.choose(name)
        return server

    def choose(self, name):
        self.click('[data-do="choose-ct"]')
        self.click('#dialog [data-choose="%s"]' % name)
        self.wait_for_slices()

    def test_what_is_clicked_comes_back_in_1000_geometries(self):
        """A voxel's centre that is drawn somewhere is what a click there means."""
        server = self.open()
        self.show(server)
        chance = random.Random(7)
        cases = []
        for _ in range(1000):
            grid = random_geometry(chance)
            index = [chance.randrange(n) for n in grid["size"]]
            view = {
                "centre": [chance.uniform(0, n) for n in grid["size"]],
                "scale": chance.uniform(0.2, 20),
                "width": chance.randint(100, 900),
                "height": chance.randint(100, 900),
            }
            cases.append([grid, index, view, chance.choice(("axial", "coronal", "sagittal"))])
        answers = self.browser.js(
            modules(SliceGeometry="workbench/page/slice_geometry.js")
            + """return arguments[0].map(([ct, index, view, name]) => {
              const G = SliceGeometry, plane = G.planes(ct)[name], place = G.place(ct, plane, view, index);
              const back = G.indexAt(ct, plane, view, place, index[plane.across]);
              const numbers = G.pictureTransform(ct, plane, view);
              const [low, high] = [0, 1, 2].filter((axis) => axis !== plane.across);
              const [u, v] = [index[low] + 0.5, index[high] + 0.5];  // the middle of its pixel in the picture
              return {plane, point: G.point(ct, back), place, drawn: [numbers[0] * u + numbers[2] * v + numbers[4],
                numbers[1] * u + numbers[3] * v + numbers[5]], back: G.index(ct, G.point(ct, index))};
            });""",
            cases,
        )
        for (grid, index, view, name), answer in zip(cases, answers):
            wanted = ct_cases.point_of(grid, index)
            self.assertLess(math.dist(answer["point"], wanted), 0.01)
            self.assertLess(math.dist(answer["drawn"], answer["place"]), 1e-6, "the picture lies where points lie")
            self.assertLess(math.dist(answer["back"], index), 1e-6)
            plane = answer["plane"]
            self.assertEqual(
                sorted([plane["across"], plane["right"]["axis"], plane["down"]["axis"]]), [0, 1, 2], (grid, name)
            )
            # On the screen: to the right the patient's left (sagittal: back), down the back (others: feet).
            along = lambda one, row: one["sign"] * grid["direction"][row][one["axis"]]
            for one, row, sign in (
                (plane["right"], 1 if name == "sagittal" else 0, 1),
                (plane["down"], 1 if name == "axial" else 2, 1 if name == "axial" else -1),
            ):
                self.assertGreater(sign * along(one, row), 0)

    def test_the_pixels_lie_where_the_page_says(self):
        """One bright voxel in a flipped grid of long voxels: the middle of what is bright is its place."""
        from selenium.webdriver.common.keys import Keys

        grid = {
            "size": [33, 25, 20],
            "spacing_mm": [1.0, 1.5, 2.0],
            "origin_mm": [10.0, -20.0, 30.0],
            "direction": [[-1, 0, 0], [0, 0, 1], [0, 1, 0]],
        }
        values = [-1000] * (33 * 25 * 20)
        values[(13 * 25 + 6) * 33 + 20] = 2000
        self.open_case(grid, values)
        for name, slice_number in (("axial", 6), ("coronal", 13), ("sagittal", 20)):
            self.go_to_slice(name, slice_number)
        self.click('[data-window="all"]')
        wanted = ct_cases.point_of(grid, [20, 6, 13])
        for name in ("axial", "coronal", "sagittal"):
            self.click_at(name, *self.middle_of_bright(name))
            point_mm, value_hu = self.crosshair()
            scale = self.browser.js("return document.querySelector('[data-slice=\"%s\"]').clientWidth" % name) / 50
            self.assertLess(math.dist(point_mm, wanted), 1.2 / scale + 0.1, name)
            self.assertEqual(value_hu, 2000)
        for keys in ("+++", "-", "++"):  # closer, with another part of the slice in the middle
            for name in ("axial", "coronal", "sagittal"):
                canvas = self.find('[data-slice="%s"]' % name)
                self.browser.js("arguments[0].focus()", canvas)
                canvas.send_keys(keys, Keys.SHIFT + Keys.ARROW_LEFT, Keys.SHIFT + Keys.ARROW_DOWN)
                self.click_at(name, *self.middle_of_bright(name))
                self.assertLess(math.dist(self.crosshair()[0], wanted), 0.25, name)

    def test_dragging_with_the_right_button_changes_the_window(self):
        from selenium.webdriver.common.actions.action_builder import ActionBuilder

        self.open_case(formats.straight((20, 20, 20)), 8000 * [-1000])
        canvas = self.find_in_sight('[data-slice="axial"]')
        for dx, dy, changed in ((60, 0, ("400", "2580")), (0, 40, ("480", "2580"))):
            builder = ActionBuilder(self.browser.driver, duration=0)
            builder.pointer_action.move_to(canvas).pointer_down(2).move_by(dx, dy).pointer_up(2)
            builder.perform()
            boxes = "[...document.querySelectorAll('.ct-slices input.short')].slice(-2).map((one) => one.value)"
            self.browser.wait("return %s.join() === '%s'" % (boxes, ",".join(changed)))

    def middle_of_bright(self, name):
        """The middle of the white pixels of a slice."""
        self.browser.js("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        return self.browser.js(
            """const canvas = document.querySelector('[data-slice="' + arguments[0] + '"]'), {width, height} = canvas;
            const {data} = canvas.getContext('2d').getImageData(0, 0, width, height), sums = [0, 0, 0];
            for (let i = 0; i < width * height; ++i)
              if (Math.min(data[4 * i], data[4 * i + 1], data[4 * i + 2]) > 150)
                [i % width + 0.5, Math.floor(i / width) + 0.5, 1].forEach((x, k) => (sums[k] += x));
            return [sums[0] / sums[2], sums[1] / sums[2]];""",
            name,
        )

    def click_at(self, name, x, y):
        from selenium.webdriver import ActionChains

        canvas = self.find_in_sight('[data-slice="%s"]' % name)
        size = canvas.size
        chain = ActionChains(self.browser.driver, duration=0)
        chain.move_to_element_with_offset(canvas, round(x - size["width"] / 2), round(y - size["height"] / 2))
        chain.click().perform()

    def crosshair(self):
        """What the page says of the crosshair: (mm, HU)."""
        text = self.browser.js("return document.querySelector('[data-read=\"crosshair\"]').textContent")
        found = re.search(r": (-?[\d.]+), (-?[\d.]+), (-?[\d.]+) mm(?:, (-?\d+) HU)?", text)
        return [float(part) for part in found.groups()[:3]], found.group(4) and int(found.group(4))


if __name__ == "__main__":
    bench.main()
