#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The report's page in headless Chromium, on made-up data: its sections, and that they answer to mouse and keys.

    tests/tools/report/report_test.py [--pictures FOLDER]     exit code 77: skipped, with the reason

With --pictures, each section is also photographed: light, dark, and 400 px wide.
"""
import argparse
import pathlib
import sys
import time

from harness import browser
from harness import synthetic
from harness import synthetic_verdicts
from harness.modules import modules
from harness.page import SECTIONS, PageTest, page_of, run_tests


class ReportTest(PageTest):
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
        scripts = modules(Data="report/page/data.js", Figures="report/page/figures.js")
        counts = self.browser.js(
            scripts + "return Figures.captureBins(Data.load())"
            ".map((row) => row.reduce((sum, item) => [sum[0] + item.count,"
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
                float(value.removeprefix("at least ").removesuffix("\u00a0mm")), item["capture"]["range"], delta=0.05
            )

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
        # Figures above that are drawn late move the stage: then it is missed, and dragged again.
        self.eventually(lambda: self.browser.drag(".stage", 0.5, 0.2) or clip(), "inset(0px 0px 0px 20%) 20")
        for _ in range(5):
            self.browser.key("ARROW_RIGHT", ".handle")
        self.eventually(clip, "inset(0px 0px 0px 30%) 30")

    def test_a_run_compares_its_outline_with_what_it_was_found_by(self):
        data = synthetic.run(with_cube=False)
        pictures = data["cells"][0]["pictures"]
        one = pictures[0]["picture"]
        names = ["edges/frontal", "edges/lateral", "overlay/distal/lateral", "result/distal/lateral", "scene/lateral"]
        data["cells"][0]["pictures"] = [{"name": name, "picture": one} for name in names]
        self.browser.open(self.write("pair", data))
        chosen = "return [...document.querySelectorAll('#pictures .comparer select')].map((one) => one.value)"
        self.assertEqual(self.browser.js(chosen), ["edges/lateral", "result/distal/lateral"], "of one view")

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

    def test_sorting_and_filtering(self):
        self.browser.open(self.comparison)
        rows = lambda: self.browser.js(
            "return [...document.querySelectorAll('#cells tbody tr')].map((row) => row.dataset.id)"
        )
        shown = lambda cells: [cell["id"] for cell in cells[: len(rows())]]
        cells = self.comparison_data["cells"]
        self.assertGreater(len(rows()), 10)
        self.assertEqual(rows(), shown(cells))
        self.press("mTRE mm", "#cells")
        finite = sorted((cell for cell in cells if cell["values"][0] is not None), key=lambda cell: cell["values"][0])
        self.assertEqual(rows(), shown(finite))
        self.press("mTRE mm", "#cells")
        self.assertEqual(rows(), shown(finite[::-1]))
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

    def test_what_is_not_there_because_a_node_failed_that_may(self):
        run, why = synthetic.run(with_cube=False), "node 'f' (test.fail) failed: too large"
        run["cells"][0]["absent"] = why
        self.browser.open(self.write("absent_run", run))
        shown = self.browser.js("return document.getElementById('summary').innerText")
        self.assertIn("What is not there\n" + why, shown)
        self.assertNotIn("Why it failed", shown)
        data = synthetic.comparison(cases=2, starts=1)
        cell = next(cell for cell in data["cells"] if cell["status"] == "done")
        cell.update(values=[None] * len(cell["values"]), absent=why, success=False)
        self.browser.open(self.write("absent_cell", data))
        self.press(cell["id"], "#cells")
        self.assertIn(why, self.browser.js("return document.getElementById('cell').innerText"))

    def test_a_run_shows_its_verdict_first(self):
        run = synthetic.run(with_cube=False)
        synthetic_verdicts.add_verdict(run["cells"][0], "doubtful")
        self.browser.open(self.write("judged_run", run))
        self.assertEqual(self.texts("main > section > h2")[:2], ["Verdict", "Result"])
        self.assertEqual(self.texts("#contents a"), self.texts("main > section > h2"))
        self.assertEqual(self.texts(".verdict-head"), ["distal: doubtful failure 12 %"])
        _, reasons, remedies = synthetic_verdicts.VERDICTS["doubtful"]
        self.assertEqual(self.texts(".verdict-list li"), reasons + remedies)
        self.assertEqual(self.texts(".verdict h3"), ["Why", "What would settle it"])
        self.assertEqual(self.texts(".verdict figcaption"), ["overlay/distal/frontal", "overlay/distal/lateral"])
        self.assertEqual(self.texts(".verdict .pose caption"), ["pose/distal: world_from_ct"], "of this fragment alone")
        self.assertEqual(self.texts(".verdict .pose tr:first-child td"), ["0.80000", "-0.60000", "0.00000", "12.50 mm"])
        self.assertIn("0.100, 0.120, 7.10 deg; 0.200, 0.210, 0.400 mm", self.texts(".verdict .note")[0])
        first = self.browser.js("return document.querySelector('main table').closest('section').id")
        self.assertEqual(first, "verdict", "no other table comes before it")

    def test_a_comparison_counts_what_verdicts_are_worth(self):
        data = synthetic.comparison(cases=6, starts=5)
        synthetic_verdicts.add_verdicts(data)
        self.browser.open(self.write("judged", data))
        self.assertIn("A silent failure is a run that is no success", self.texts("#summary .note")[-1])
        shown = self.browser.js(
            "return [...document.querySelectorAll('#summary table')].pop().querySelectorAll('tbody tr')[2].innerText"
        )
        counts = data["summary"][2]["verdicts"]
        for key in ("silent_failures", "false_alarms"):
            self.assertIn("%d/%d" % (counts[key]["count"], counts[key]["of"]), shown)
        self.press("Verdict", "#cells")
        cell = next(cell for cell in data["cells"] if cell.get("verdict") == "wrong")
        self.choose("Text", "wrong", "#cells")
        self.assertIn(
            cell["id"],
            self.browser.js("return [...document.querySelectorAll('#cells tbody tr')].map((row) => row.dataset.id)"),
        )
        self.press(cell["id"], "#cells")
        text = self.browser.js("return document.getElementById('cell').innerText")
        self.assertIn("the contour leads to a pose 6 mm away", text)
        self.assertRegex(text, r"Verdict\s+wrong failure 84 %")

    def test_the_bar_stays_at_the_top(self):
        self.browser.open(self.comparison)
        self.browser.js("scrollTo(0, 2000)")
        self.eventually(lambda: self.browser.js("return document.getElementById('bar').getBoundingClientRect().top"), 0)

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


def photograph(folder):
    folder.mkdir(parents=True, exist_ok=True)
    page = folder / "comparison.html"
    page.write_text(page_of(synthetic.comparison()))
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
    if arguments.pictures and not browser.missing():
        photograph(arguments.pictures)
    return run_tests(others)


if __name__ == "__main__":
    sys.exit(main())
