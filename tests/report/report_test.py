#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The report's page in headless Chromium, on made-up data.

    tests/report/report_test.py [--pictures FOLDER]     exit code 77: skipped, with the reason

With --pictures, each section is also photographed: light, dark, and 400 px wide.
"""
import argparse
import pathlib
import shutil
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1] / "tools" / "report")]
import assemble  # noqa: E402
import browser  # noqa: E402
import shapes  # noqa: E402
import synthetic  # noqa: E402

SECTIONS = [
    "summary",
    "distributions",
    "paired",
    "capture",
    "by-case",
    "pictures",
    "scene",
    "convergence",
    "landscape",
    "graph",
    "cells",
    "failures",
    "repeat",
]
HOSTILE = "</script><script>window.hurt = 1</script><img src=x onerror='window.hurt = 2'>\"&amp;${1}"

# The result's pixels of the drawn canvas: their bounds in pixels of the canvas, and how many they are.
COVERED = """
const scene = Page.scene, gl = scene.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight;
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


class ReportTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow_report_"))
        cls.browser = browser.Browser()
        cls.comparison_data = synthetic.comparison()
        cls.run_data = synthetic.run()
        cls.comparison = cls.write("comparison", cls.comparison_data)
        cls.run_page = cls.write("run", cls.run_data)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        shutil.rmtree(cls.folder)

    @classmethod
    def write(cls, name, data):
        path = cls.folder / (name + ".html")
        path.write_text(assemble.assemble(data))
        return path

    def tearDown(self):
        faults, asked = self.browser.logs()
        self.assertEqual(faults, [], "the console reports faults")
        self.assertEqual(
            [url for url in asked if not url.startswith("file://%s/" % self.folder)], [], "the page asked the network"
        )

    def texts(self, selector):
        return self.browser.js(
            "return [...document.querySelectorAll(arguments[0])].map((item) => item.textContent)", selector
        )

    def press(self, text, within="body"):
        found = self.browser.js(
            (
                "const b = [...document.querySelectorAll(arguments[1] + ' button')].find((b) => b.textContent.trim()"
                " === arguments[0]); if (b) b.click(); return !!b"
            ),
            text,
            within,
        )
        self.assertTrue(found, "no button '%s' in %s" % (text, within))

    def choose(self, label, value, within="body"):
        found = self.browser.js(
            """const f = [...document.querySelectorAll(arguments[2] + ' label.field')].find(
              (f) => f.firstChild.textContent === arguments[0]);
            const s = f && f.querySelector('select, input');
            if (!s) return false;
            s.value = arguments[1];
            s.dispatchEvent(new Event(s.matches('select') ? 'change' : 'input'));
            return true""",
            label,
            value,
            within,
        )
        self.assertTrue(found, "no control '%s' in %s" % (label, within))

    def eventually(self, give, wanted):
        """That give() comes to what is wanted: figures are drawn when the browser finds the time."""
        end = time.monotonic() + 60
        while give() != wanted and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(give(), wanted)

    def test_all_sections_are_there(self):
        self.browser.open(self.comparison)
        self.assertEqual(
            self.browser.js("return [...document.querySelectorAll('main > section')].map((s) => s.id)"), SECTIONS
        )
        self.assertEqual(len(self.texts("#summary tbody tr")), 4)
        self.assertEqual(len(self.texts("#summary .verdicts li")), 3)
        self.assertEqual(self.texts("#contents a"), self.texts("main > section > h2"))
        done = sum(cell["status"] == "done" for cell in self.comparison_data["cells"])
        self.eventually(lambda: len(self.texts("#distributions .point")), done)
        self.assertEqual(len(self.texts("#graph .node")), len(synthetic.GRAPH))
        self.assertEqual(len(self.texts("#graph .node.differs")), 2)
        self.eventually(lambda: len(self.texts("#landscape svg.plot")), 6)

    def test_paired_plots(self):
        self.browser.open(self.comparison)
        self.eventually(lambda: len(self.texts("#paired .estimate")), 3)
        self.press("Pairs", "#paired")
        pairs = sum(item["pairs"] for item in self.comparison_data["comparisons"][:3])
        self.eventually(lambda: len(self.texts("#paired .better, #paired .worse")), pairs)

    def test_capture_counts_every_cell_once(self):
        self.browser.open(self.comparison)
        counts = self.browser.js(
            "return Figures.captureBins(Data.load()).map((row) => row.reduce((sum, item) => [sum[0] + item.count,"
            " sum[1] + item.of], [0, 0]))"
        )
        wanted = [[item["success"]["count"], item["success"]["of"]] for item in self.comparison_data["summary"]]
        self.assertEqual(counts, wanted)
        shown = self.texts("#capture .verdicts li")
        for variant, item, text in zip(
            self.comparison_data["variants"], self.comparison_data["summary"], shown, strict=True
        ):
            name, value = text.split(": ")
            self.assertEqual(name, variant["name"])
            self.assertEqual(value.startswith("at least "), item["capture"]["is_open"])
            self.assertAlmostEqual(
                float(value.removeprefix("at least ").removesuffix(" mm")), item["capture"]["range"], delta=0.05
            )
        ours = self.browser.js("return Data.wilson(7, 20)")
        for key, value in synthetic.wilson(7, 20).items():
            self.assertAlmostEqual(ours[key], value, 9)

    def test_wipe_moves_with_mouse_and_keys(self):
        self.browser.open(self.comparison)
        self.browser.show("pictures")
        clip = lambda: self.browser.js(
            "return getComputedStyle(document.querySelector('.side-b')).clipPath + ' ' +"
            " document.querySelector('.handle').getAttribute('aria-valuenow')"
        )
        self.assertEqual(clip(), "inset(0px 0px 0px 50%) 50")
        # They give the stage its size.
        self.browser.wait(
            "return [...document.querySelectorAll('.stage img')].every((image) => image.complete && image.naturalWidth"
            " > 0)"
        )
        self.browser.drag(".stage", 0.5, 0.2)
        self.eventually(clip, "inset(0px 0px 0px 20%) 20")
        for _ in range(5):
            self.browser.key("ARROW_RIGHT", ".handle")
        self.eventually(clip, "inset(0px 0px 0px 30%) 30")

    def test_blink_and_side_by_side(self):
        self.browser.open(self.comparison)
        self.browser.show("pictures")
        self.press("Blink", "#pictures")
        visible = lambda: self.browser.js(
            "return [...document.querySelectorAll('.stage img')].map((image) => getComputedStyle(image).visibility)"
        )
        seen, samples, end = set(), 0, time.monotonic() + 60
        while samples < 40 or (len(seen) < 2 and time.monotonic() < end):
            seen.add(tuple(visible()))
            samples += 1
            time.sleep(0.05)
        self.assertEqual(seen, {("visible", "hidden"), ("hidden", "visible")})
        self.press("Pause", "#pictures")
        before = visible()
        self.browser.key("SPACE", ".stage")
        self.eventually(visible, before[::-1])
        time.sleep(0.9)
        self.assertEqual(visible(), before[::-1], "a paused blink goes on")
        self.press("Side by side", "#pictures")
        self.assertEqual(visible(), ["visible", "visible"])
        boxes = self.browser.js(
            "return [...document.querySelectorAll('.stage img')].map((image) => { const r ="
            " image.getBoundingClientRect(); return [r.left, r.right, r.width] })"
        )
        self.assertLessEqual(boxes[0][1], boxes[1][0])
        self.assertAlmostEqual(boxes[0][2], boxes[1][2], 0)

    def test_scene_is_drawn(self):
        self.browser.open(self.comparison)
        self.browser.show("scene")
        self.browser.wait("return !!Page.scene && !!Page.scene.renderer")
        bluish = COVERED % "pixels[i + 3] === 255 && pixels[i + 2] > pixels[i] + 25"
        self.browser.js("Page.scene.planes = false")
        covered = self.browser.js(bluish)
        self.assertGreater(covered["count"], 0.02 * covered["w"] * covered["h"])
        self.browser.js("document.querySelector('canvas.scene').focus({preventScroll: true})")
        for _ in range(4):
            self.browser.key("-", "canvas.scene")
        self.assertLess(self.browser.js(bluish)["count"], 0.6 * covered["count"])
        self.browser.js("Page.scene.shownPoses.result = Page.scene.shownPoses.truth = false")
        self.assertEqual(self.browser.js(COVERED % "pixels[i + 3] > 0")["count"], 0)

    def test_look_through_is_aligned(self):
        self.browser.open(self.run_page)
        self.browser.show("scene")
        self.browser.wait(
            "return !!Page.scene && !!Page.scene.renderer && Page.scene.views.every((view) =>"
            " view.quad.material.map.image)"
        )
        scene = next(iter(self.run_data["scenes"].values()))
        corners = [
            shapes.apply([scene["poses"][0]["world_from_model"][4 * i : 4 * i + 4] for i in range(4)], vertex)
            for vertex in shapes.cube()[0]
        ]
        for view in scene["views"]:
            self.browser.js(
                (
                    "Page.scene.lookThrough(arguments[0]); Page.scene.style.through = 'surface';"
                    " Page.scene.imageOpacity = 0"
                ),
                view["name"],
            )
            at = [shapes.project(view, corner)[:2] for corner in corners]
            worst = max(
                abs(ours - given)
                for corner, pixel in zip(corners, at)
                for ours, given in zip(self.browser.js("return Page.scene.pixelOf(arguments[0])", corner), pixel)
            )
            self.assertLess(worst, 0.01, "projection by three.js, px")
            for zoom in (1, 1.4):
                self.browser.js(
                    (
                        "Page.scene.orbit.flat = {zoom: arguments[0], x: 0.1 * (arguments[0] - 1), y: -0.05 *"
                        " (arguments[0] - 1)}"
                    ),
                    zoom,
                )
                drawn = self.bounds(view, zoom, "pixels[i + 2] > 60")
                wanted = [min(u for u, _ in at), max(u for u, _ in at), min(v for _, v in at), max(v for _, v in at)]
                model = max(abs(a - b) for a, b in zip(drawn, wanted))
                self.assertLess(model, 0.5, "drawn model against its projection, px")
                self.browser.js("Page.scene.modelOpacity = 0; Page.scene.imageOpacity = 1")
                marks = self.bounds(view, zoom, "pixels[i] > 100")  # one white pixel a corner, which falls off linearly
                self.browser.js("Page.scene.modelOpacity = 1; Page.scene.imageOpacity = 0")
                reach = 1 - 100 / 255
                image = max(abs(a - round(b) - side) for a, b, side in zip(marks, wanted, (-reach, reach) * 2))
                self.assertLess(image, 0.5, "corners in the X-ray against their projection, px")
                self.browser.js("Page.scene.style.through = 'outline'")
                lines = self.bounds(view, zoom, "pixels[i + 2] > 60")
                self.browser.js("Page.scene.style.through = 'surface'")
                outline = max(abs(a - b) for a, b in zip(lines, wanted))
                self.assertLess(
                    outline, 1.0, "drawn outline against its projection, px"
                )  # the line is 1.8 canvas pixels thick
                print(
                    "look through %-8s zoom %.1f: projection %.2g px, drawn model %.2f px, outline %.2f px, X-ray"
                    " %.2f px" % (view["name"], zoom, worst, model, outline, image)
                )

    def bounds(self, view, zoom, condition):
        """Left, right, top, bottom of the drawn pixels that fulfil a condition, in pixels of the view's image."""
        found = self.browser.js(COVERED % condition)
        self.assertGreater(found["count"], 0)
        flat = self.browser.js("return Page.scene.flat(arguments[0])", view)
        u = lambda x: (((2 * x / found["w"] - 1) - flat["x"]) / flat["sx"] + 1) / 2 * view["width_px"] - 0.5
        v = lambda y: (1 - ((1 - 2 * y / found["h"]) - flat["y"]) / flat["sy"]) / 2 * view["height_px"] - 0.5
        return [u(found["left"]), u(found["right"] + 1), v(found["top"]), v(found["bottom"] + 1)]

    def test_sorting_and_filtering(self):
        self.browser.open(self.comparison)
        rows = lambda: self.browser.js(
            "return [...document.querySelectorAll('#cells tbody tr')].map((row) => row.dataset.id)"
        )
        cells = self.comparison_data["cells"]
        self.assertEqual(rows(), [cell["id"] for cell in cells[:50]])
        self.press("mTRE mm", "#cells")
        finite = sorted((cell for cell in cells if cell["values"][0] is not None), key=lambda cell: cell["values"][0])
        self.assertEqual(rows(), [cell["id"] for cell in finite[:50]])
        self.press("mTRE mm", "#cells")
        self.press("Next", "#cells .pager")
        self.choose("Variant", "1", "#cells")
        self.choose("Outcome", "failed", "#cells")
        self.assertEqual(
            set(rows()), {cell["id"] for cell in cells if cell["variant"] == 1 and cell["status"] == "failed"}
        )
        self.choose("Outcome", "", "#cells")
        self.choose("Text", "case-03", "#cells")
        self.assertEqual(set(rows()), {cell["id"] for cell in cells if cell["variant"] == 1 and cell["case"] == 2})
        self.press("Worst mm", "#summary")
        worst = [item["metrics"]["mtre_mm"]["worst"] for item in self.comparison_data["summary"]]
        self.assertEqual(
            self.browser.js(
                "return [...document.querySelectorAll('#summary tbody tr')].map((row) => Number(row.dataset.row))"
            ),
            sorted(range(4), key=worst.__getitem__),
        )

    def test_drill_down(self):
        self.browser.open(self.comparison)
        cells = self.comparison_data["cells"]
        rich = next(cell for cell in cells if cell["scene"] and cell["variant"] == 1)
        self.browser.js(
            (
                "document.querySelector('#distributions .point[data-cell=\"' + arguments[0] + '\"]').dispatchEvent(new"
                " MouseEvent('click', {bubbles: true}))"
            ),
            rich["id"],
        )
        self.assertTrue(self.browser.js("return document.getElementById('cell').open"))
        text = self.browser.js("return document.getElementById('cell').innerText")
        for wanted in (
            "canny, case-01",
            "edges.canny",
            "marrow cell experiments/edges.yaml " + rich["id"],
            rich["folder"],
            "%d" % rich["evaluations"],
        ):
            self.assertIn(wanted, text)
        self.assertEqual(len(self.texts("#cell .gallery img")), len(rich["pictures"]))
        self.press("Show in 3D", "#cell")
        self.assertEqual(len(self.texts("#cell canvas.scene")), 1)
        self.press("Close", "#cell")
        failed = next(cell for cell in cells if cell["status"] == "failed")
        self.press(failed["id"], "#failures")
        self.assertIn(failed["reason"], self.browser.js("return document.getElementById('cell').innerText"))
        self.browser.open(self.comparison)
        self.browser.js("location.hash = '#cell=' + arguments[0]; location.reload()", rich["id"])
        self.browser.wait(
            "return document.documentElement.dataset.ready === 'true' && document.getElementById('cell').open"
        )

    def test_run_page_leaves_out_comparisons(self):
        self.browser.open(self.run_page)
        self.assertEqual(
            self.browser.js("return [...document.querySelectorAll('main > section')].map((s) => s.id)"),
            [
                name
                for name in SECTIONS
                if name in ("summary", "pictures", "scene", "convergence", "landscape", "graph", "repeat")
            ],
        )
        self.assertIn("mTRE", self.browser.js("return document.querySelector('#summary').innerText"))

    def test_hostile_text_is_text(self):
        data = synthetic.comparison(cases=3, starts=2, looked_at=1)
        data["experiment"].update(name=HOSTILE, help=HOSTILE, text=HOSTILE, command=HOSTILE, file=HOSTILE)
        data["variants"][1].update(name=HOSTILE, options={HOSTILE: HOSTILE})
        data["cases"][0] = data["starts"][0] = data["metrics"][0]["label"] = data["metrics"][0]["unit"] = HOSTILE
        data["metrics"] = [dict(metric) for metric in data["metrics"]]
        data["cells"][-1].update(status="failed", reason=HOSTILE, id=HOSTILE)
        data["comparisons"][0].update(variant=HOSTILE, sentence=HOSTILE)
        data["graph"]["nodes"][0].update(
            id=HOSTILE, uses=HOSTILE, options={HOSTILE: HOSTILE}, differs={HOSTILE: HOSTILE}
        )
        for cell in data["cells"]:
            for picture in cell["pictures"]:
                picture["name"] = HOSTILE + picture["name"]
        self.browser.open(self.comparison)
        scripts = self.browser.js("return document.scripts.length")
        self.browser.open(self.write("hostile", data))
        self.browser.show("scene")
        self.press(HOSTILE, "#failures")
        for text in (self.texts("h1")[0], self.texts("#cell .reason")[0]):
            self.assertEqual(text, HOSTILE)
        self.assertIsNone(self.browser.js("return window.hurt || null"))
        self.assertEqual(self.browser.js("return document.querySelectorAll('img[onerror], img[src=x]').length"), 0)
        self.assertEqual(self.browser.js("return document.scripts.length"), scripts)

    def test_thousand_cells(self):
        data = synthetic.comparison(cases=25, starts=10)
        self.assertEqual(len(data["cells"]), 1000)
        path = self.write("thousand", data)
        seconds = self.browser.open(path)
        self.assertLess(seconds, 60)
        sorting = min(
            self.browser.js(
                "const begin = performance.now(); document.querySelectorAll('#cells .sort')[6].click();"
                " document.body.offsetHeight; return performance.now() - begin"
            )
            for _ in range(5)
        )
        print(
            "1000 cells: ready in %.2f s, sorted in %.0f ms, file %.1f MB"
            % (seconds, sorting, path.stat().st_size / 1e6)
        )
        self.assertLess(sorting, 2000)

    def test_without_three_and_without_data(self):
        path = self.folder / "no_three.html"
        path.write_text(assemble.assemble(self.run_data, three=pathlib.Path("/nowhere/three.min.js")))
        self.browser.open(path)
        self.browser.show("scene")
        self.browser.wait("return document.querySelector('#scene').innerText.includes('libjs-three')")
        self.browser.open(
            self.write("bare", {"marrow": "0.1.0", "format": 1, "kind": "comparison", "experiment": {"name": "bare"}})
        )
        self.assertEqual(self.texts("h1"), ["bare"])

    def test_narrow_page_does_not_scroll_sideways(self):
        for page in (self.comparison, self.run_page):
            self.browser.open(page, 400)
            for section in self.browser.js("return [...document.querySelectorAll('main > section')].map((s) => s.id)"):
                self.browser.show(section)
            self.assertEqual(self.browser.js("return document.documentElement.scrollWidth"), 400)

    def test_theme(self):
        ink = lambda: self.browser.js("return getComputedStyle(document.body).backgroundColor")
        self.browser.open(self.comparison, theme="dark")
        self.assertEqual(ink(), "rgb(20, 24, 27)")
        self.press("Light")
        self.assertEqual(ink(), "rgb(255, 255, 255)")
        self.browser.js("localStorage.clear()")

    def test_controls_have_names(self):
        self.browser.open(self.comparison)
        self.browser.show("scene")
        self.browser.wait("return !!Page.scene")
        nameless = self.browser.js(
            """const controls = 'button, select, input, [role=button], [role=slider], svg[role=img], canvas, img';
            const named = (item) => item.textContent.trim() || item.getAttribute('aria-label') ||
              item.getAttribute('alt') || (item.labels && item.labels.length);
            return [...document.querySelectorAll(controls)].filter((item) => !item.closest('dialog') && !named(item))
              .map((item) => item.outerHTML.slice(0, 120))"""
        )
        self.assertEqual(nameless, [])


def photograph(folder):
    folder.mkdir(parents=True, exist_ok=True)
    page = folder / "comparison.html"
    page.write_text(assemble.assemble(synthetic.comparison()))
    window = browser.Browser()
    for name, width_px, theme in (("light", 1200, "light"), ("dark", 1200, "dark"), ("narrow", 400, "light")):
        window.open(page, width_px, theme=theme)
        for section in ["top"] + SECTIONS:
            window.show(section)
            time.sleep(0.7)
            window.picture(folder / ("%s_%s.png" % (name, section)))
    window.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=pathlib.Path, help="folder for pictures of all sections")
    arguments, others = parser.parse_known_args()
    reason = browser.missing()
    if reason:
        print("skipped: " + reason)
        return 77
    if arguments.pictures:
        photograph(arguments.pictures)
    return 0 if unittest.main(argv=sys.argv[:1] + others, exit=False, verbosity=2).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
