#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The report of a run, in headless Chromium: its profile, its graph and its curves; a sequence with slider, player,
curves and 3D view; and the scene: what is drawn, and at which place of the X-ray image.

    tests/tools/report/runs_test.py     exit code 77: skipped, with the reason
"""
import re
import time

from harness import shapes
from harness.page import ReportTest, bundle, made, main, page_without_data

NAMES = [
    {"title": "pose", "kind": "node", "node": "pose"},
    {"title": "drr: radiograph", "kind": "function", "node": "drr"},
    {"title": "case", "kind": "cached", "node": "case"},
]
# [row, name, begin, length, processor time]: a node of 4 s with a call of 1 s and 500 very short ones in it.
BARS = [[0, 0, 1e6, 4e6, 3e6], [0, 1, 2e6, 1e6, 1e6]] + [[0, 1, 4e6 + 20 * i, 10, 10] for i in range(500)]
SUMS = [
    {"kind": "node", "node": "pose", "what": "", "calls": 1, "us": 4e6, "own_us": 2.995e6, "own_thread_us": 2e6},
    {"kind": "function", "node": "drr", "what": "radiograph", "calls": 501, "us": 1.005e6, "own_us": 1.005e6}
    | {"own_thread_us": 1.005e6},
]
CALL = "drr: radiograph\n1.00 s\nprocessor time of this thread 1.00 s"


class RunTest(ReportTest):
    def boxes(self):
        """{tip: (x, y, width)} of each bar of the profile."""
        at = "...['x', 'y', 'width'].map((name) => Number(one.getAttribute(name)))"
        found = self.all("#profile .span", "[one.dataset.tip, %s]" % at)
        return {tip.replace("\u00a0", " "): place for tip, *place in found}

    def test_the_profile(self):
        data = made()
        data["kind"] = "run"
        data["profile"] = {
            "us": 6e6,
            "rows": ["thread 1", "main thread"],
            "names": NAMES,
            "bars": BARS + [[1, 2, 0, 1e6, 0]],
            "busy": [[0, {"thread 1": 1.0}], [3e6, {"thread 1": 0.5, "main thread": 1.0}]],
            "sums": [{**one, "process_us": 1.5 * one["us"]} for one in SUMS],
            "left_out": 12,
        }
        self.show(data)
        self.eventually(lambda: self.count("#profile .span-name") > 0, True)
        boxes = self.boxes()
        pose, call = boxes["pose\n4.00 s\nprocessor time of this thread 3.00 s"], boxes[CALL]
        kept = boxes["case\n1.00 s, its result was kept\nprocessor time of this thread 0.000 s"]
        self.assertAlmostEqual(call[2] / pose[2], 1 / 4, delta=0.01, msg="a quarter of its time")
        self.assertAlmostEqual((call[0] - pose[0]) / pose[2], 1 / 4, delta=0.01, msg="it begins after a quarter")
        self.assertGreater(call[1], pose[1], "beneath it")
        self.assertLess(kept[1], pose[1], "the main thread is the first row")
        self.assertIn("500 short calls\nwithin 0.010 s", boxes, "very short bars are drawn as one")
        self.assertIn("12 short calls have no bar here; the table counts them.", self.texts("#profile .note"))
        rows = [text.replace("\u00a0", " ") for text in self.texts("#profile .slowest tbody tr td")]
        self.assertEqual(rows[:5], ["1", "3.00 s", "75 %", "2.00 s", "1.50"])
        self.assertEqual(rows[5:], ["501", "1.00 s", "25 %", "1.00 s", "1.50"])
        self.assertEqual(self.texts("#profile .slowest tbody th"), ["pose", "drr: radiograph"])
        click = "one.dataset.tip.includes('1.00') && one.dispatchEvent(new MouseEvent('click', {bubbles: true}))"
        self.all("#profile .span.function", click)
        self.eventually(lambda: self.boxes()[CALL][2] > pose[2], True)
        self.press("Whole run", "#profile")
        self.eventually(lambda: self.boxes()[CALL][2] < pose[2], True)

    def test_the_script_is_small_and_names_the_libraries(self):
        script = re.search(r"<script>\n(.*)</script>", page_without_data(bundle.THREE), re.S)[1]
        self.assertLess(len(script.encode()), 900e3)
        for notice in ("2010-2021 Mike Bostock", "Chris Pettitt", "lodash", "three.js authors", "Permission is hereby"):
            self.assertIn(notice, script)

    def test_axes_begin_where_the_data_begin(self):
        run = made("run", with_cube=False)
        run["cells"][0]["convergence"] = [[20000 + 50 * i, 730 + 2**-i] for i in range(9)]
        self.show(run)
        self.eventually(lambda: self.count("#convergence .scale"), 2)
        texts = self.texts("#convergence .scale:first-of-type .tick text")
        ticks = [float(text.replace("−", "-").replace("\u202f", "")) for text in texts]
        self.assertGreaterEqual(min(ticks), 19950, "a curve that starts late fills the plot")
        self.assertLessEqual(max(ticks), 20450)
        self.assertIn("20\u202f000", self.texts("#convergence .tick text"), "numbers as everywhere in the page")

    def test_the_graph_has_layers(self):
        data = made("run", with_cube=False)
        wires = [("a", "b", 0), ("b", "c", 0), ("a", "d", 0), ("c", "d", 1), ("c", "d", 2)]
        data["graph"] = {
            "nodes": [{"id": name, "uses": "kind." + name, "options": {}, "differs": {}} for name in "abcd"],
            "edges": [{"from": source, "to": name, "port": "in%d" % i} for source, name, i in wires],
        }
        self.show(data)
        box = "(({x, y, width, height}) => [x, y, width, height])(one.getBBox())"
        boxes = dict(self.all("#graph .node", "[one.dataset.node, %s]" % box))
        tops = [boxes[name][1] for name in "abcd"]
        self.assertEqual(tops, sorted(tops))
        self.assertEqual(len(set(tops)), 4, "each below what it uses")
        points = "Array.from({length: 200}, (_, i) => one.getPointAtLength(i / 199 * one.getTotalLength()))"
        lines = dict(self.all("#graph .edge", "[one.dataset.tip, %s.map(({x, y}) => [x, y])]" % points))
        self.assertEqual(set(lines), {"a → b: in0", "b → c: in0", "c → d: in1, in2", "a → d: in0"})
        for x, y, width, height in (boxes["b"], boxes["c"]):
            crossed = [p for p in lines["a → d: in0"] if x < p[0] < x + width and y < p[1] < y + height]
            self.assertEqual(crossed, [], "the edge from a to d passes beside the nodes")


def sequence(frames=6, lost=3):
    """A run of a sequence: two films, and the way of the bone 'cube', which is lost in one frame."""
    data = made("run")
    cell = data["cells"][0]
    names = ["%04d" % (i + 1) for i in range(frames)]
    for i, name in enumerate(names):
        for view in ("frontal", "lateral") if i != lost else ("frontal",):
            key = "film %s %s" % (view, name)
            data["pictures"][key] = shapes.picture(8, 8, bytes([20 * i + 9 * (view == "lateral")] * 64), 1)
            cell["pictures"].append({"name": "overlay/%s/cube/%s" % (name, view), "picture": key})
    cell["trajectories"] = [
        {
            "name": "way/cube",
            "frames": names,
            "time_s": [i / 10 for i in range(frames)],
            "found": [i != lost for i in range(frames)],
            "world_from_model": [shapes.flat(shapes.pose([0, 0, 5 * i], [i, 0, 0])) for i in range(frames)],
            "motion": [[0, 0, 5 * i, i, 0, 0] for i in range(frames)],
            "deviation": [[1, 1, 1 + 9 * (i == lost), 1, 1, 1] for i in range(frames)],
        }
    ]
    return data


class SequenceTest(ReportTest):
    def shown(self):
        """The frame's name, and of each film the picture that is shown, or None."""
        sources = self.all(".films img", "one.style.visibility === 'hidden' ? null : one.getAttribute('src')")
        by_source = {url: name for name, url in self.data["pictures"].items()}
        return self.text(".frame-name"), [source and by_source[source] for source in sources]

    def test_slider_player_curves_and_scene(self):
        self.data = sequence()
        self.show(self.data)
        self.browser.show("sequence")
        self.assertEqual(self.shown(), ("0001, 0.000\u00a0s", ["film frontal 0001", "film lateral 0001"]))
        self.choose("Frame", 4, "#sequence")
        self.assertEqual(self.shown(), ("0005, 0.400\u00a0s", ["film frontal 0005", "film lateral 0005"]))
        self.choose("Frame", 3, "#sequence")
        self.assertEqual(self.shown()[1], ["film frontal 0004", None])
        self.assertIn("none in this frame", self.texts(".films figcaption")[1])
        self.choose("Frames a second", 30, "#sequence")
        self.press("Play", "#sequence")
        seen, end = set(), time.monotonic() + 60
        while len(seen) < 6 and time.monotonic() < end:
            seen.add(self.shown()[0])
        self.assertEqual(len(seen), 6, "it goes through all frames and begins again")
        self.press("Pause", "#sequence")
        before = self.shown()
        time.sleep(0.3)
        self.assertEqual(self.shown(), before)
        self.assertIn("Lost in 1 of 6 frames", " ".join(self.texts("#sequence .note")))
        self.eventually(lambda: self.count("#sequence svg.plot"), 6)
        self.assertEqual(self.count("#sequence .lost"), 6)
        heights = self.all(
            "#sequence svg.plot",
            "[...(one.querySelector('.band')?.getAttribute('d') || '').matchAll(/,([\\d.]+)/g)].map((m) => +m[1])",
        )[2]
        spread = [low - high for high, low in zip(heights[:6], heights[:5:-1])]
        self.assertAlmostEqual(spread[3] / spread[0], 10, 1)
        cursor = lambda: self.the("#sequence .cursor", "+one.getAttribute('x1')")
        self.choose("Frame", 0, "#sequence")
        first = cursor()
        self.choose("Frame", 5, "#sequence")
        self.assertGreater(cursor(), first + 50)
        names = self.texts(".gallery span")
        self.assertGreater(len(names), 0)
        self.assertEqual([name for name in names if "/00" in name], [], "its pictures are not among the others")
        self.choose("Frame", 2, "#sequence")
        self.browser.show("scene")
        self.wait("!!marrow.scene")
        if self.js("return !!marrow.scene.failure"):
            self.skipTest("no WebGL")
        place = "const m = marrow.scene.models[0].group.matrix.elements; return [m[12], m[13], m[14]]"
        at = lambda i: [self.data["cells"][0]["trajectories"][0]["world_from_model"][i][k] for k in (3, 7, 11)]
        self.assertEqual(self.js(place), at(2), "the 3D view moves with it")
        self.choose("Frame", 5, "#sequence")
        self.assertEqual(self.js(place), at(5))


# The result's pixels of the drawn canvas: their bounds in pixels of the canvas, and how many they are.
COVERED = """
const scene = marrow.scene, gl = scene.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight;
scene.drawNow();
const pixels = new Uint8Array(4 * w * h);
gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
let [left, right, top, bottom, count] = [w, -1, h, -1, 0];
for (let y = 0; y < h; ++y) for (let x = 0; x < w; ++x) {
  const i = 4 * (y * w + x);
  if (!(%s)) continue;
  ++count;
  left = Math.min(left, x);
  right = Math.max(right, x);
  top = Math.min(top, h - 1 - y);
  bottom = Math.max(bottom, h - 1 - y);
}
return {left, right, top, bottom, count, w, h};
"""


class SceneTest(ReportTest):
    def test_scene_is_drawn(self):
        self.show()
        self.browser.show("scene")
        self.wait("!!marrow.scene && !!marrow.scene.renderer")
        bluish = COVERED % "pixels[i + 3] === 255 && pixels[i + 2] > pixels[i] + 25"
        self.js("marrow.scene.planes = false")
        covered = self.js(bluish)
        self.assertGreater(covered["count"], 0.02 * covered["w"] * covered["h"])
        self.the("canvas.scene", "one.focus({preventScroll: true})")
        for _ in range(4):
            self.browser.key("-", "canvas.scene")
        self.assertLess(self.js(bluish)["count"], 0.6 * covered["count"])
        self.js("marrow.scene.shownPoses.result = marrow.scene.shownPoses.truth = false")
        self.assertEqual(self.js(COVERED % "pixels[i + 3] > 0")["count"], 0)

    def test_look_through_is_aligned(self):
        data = made("run")
        self.show(data)
        self.browser.show("scene")
        loaded = "marrow.scene.views.every((view) => view.quad.material.map.image)"
        self.wait("!!marrow.scene && !!marrow.scene.renderer && " + loaded)
        scene = next(iter(data["scenes"].values()))
        pose = [scene["poses"][0]["world_from_model"][4 * i : 4 * i + 4] for i in range(4)]
        corners = [shapes.apply(pose, vertex) for vertex in shapes.cube()[0]]
        style = lambda text: self.js(re.sub(r"(\w+) =", r"marrow.scene.\1 =", text))
        for view in scene["views"]:
            self.js("marrow.scene.lookThrough(arguments[0]); marrow.scene.style.through = 'surface'", view["name"])
            style("imageOpacity = 0")
            at = [shapes.project(view, corner)[:2] for corner in corners]
            ours = [self.js("return marrow.scene.pixelOf(arguments[0])", corner) for corner in corners]
            worst = max(abs(a - b) for one, pixel in zip(ours, at) for a, b in zip(one, pixel))
            self.assertLess(worst, 0.01, "projection by three.js, px")
            wanted = [min(u for u, _ in at), max(u for u, _ in at), min(v for _, v in at), max(v for _, v in at)]
            for zoom in (1, 1.4):
                flat = {"zoom": zoom, "x": 0.1 * (zoom - 1), "y": -0.05 * (zoom - 1)}
                self.js("marrow.scene.orbit.flat = arguments[0]", flat)
                drawn = self.bounds(view, "pixels[i + 2] > 60")
                model = max(abs(a - b) for a, b in zip(drawn, wanted))
                self.assertLess(model, 0.5, "drawn model against its projection, px")
                style("modelOpacity = 0; imageOpacity = 1")
                marks = self.bounds(view, "pixels[i] > 100")  # one white pixel a corner, which falls off linearly
                style("modelOpacity = 1; imageOpacity = 0")
                reach = 1 - 100 / 255
                image = max(abs(a - round(b) - side) for a, b, side in zip(marks, wanted, (-reach, reach) * 2))
                self.assertLess(image, 0.5, "corners in the X-ray against their projection, px")
                self.js("marrow.scene.style.through = 'outline'")
                lines = self.bounds(view, "pixels[i + 2] > 60")
                self.js("marrow.scene.style.through = 'surface'")
                outline = max(abs(a - b) for a, b in zip(lines, wanted))
                # The line is 1.8 canvas pixels thick.
                self.assertLess(outline, 1.0, "drawn outline against its projection, px")
                print("look through %-8s zoom %.1f: projection %.2g px, " % (view["name"], zoom, worst), end="")
                print("drawn model %.2f px, outline %.2f px, X-ray %.2f px" % (model, outline, image))

    def bounds(self, view, condition):
        """Left, right, top, bottom of the drawn pixels that fulfil a condition, in pixels of the view's image."""
        found = self.js(COVERED % condition)
        self.assertGreater(found["count"], 0)
        flat = self.js("return marrow.scene.flat(arguments[0])", view)
        u = lambda x: (((2 * x / found["w"] - 1) - flat["x"]) / flat["sx"] + 1) / 2 * view["width_px"] - 0.5
        v = lambda y: (1 - ((1 - 2 * y / found["h"]) - flat["y"]) / flat["sy"]) / 2 * view["height_px"] - 0.5
        return [u(found["left"]), u(found["right"] + 1), v(found["top"]), v(found["bottom"] + 1)]


if __name__ == "__main__":
    main()
