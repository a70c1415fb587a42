#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The report's page in headless Chromium, on made-up data: its sections, and that they answer to mouse and keys.

    tests/tools/report/report_test.py     exit code 77: skipped, with the reason
"""
import time

from harness import synthetic, synthetic_verdicts
from harness.modules import modules
from harness.page import ReportTest, made, main

SECTIONS = "summary distributions paired capture by-case pictures scene convergence landscape graph cells failures"
OF_A_RUN = "summary pictures scene convergence landscape graph repeat"
LOADED = "[...document.querySelectorAll('.stage img')].every((image) => image.complete && image.naturalWidth > 0)"


class PageTest(ReportTest):
    def test_all_sections_are_there(self):
        data = made()
        self.show(data)
        self.assertEqual(self.sections(), SECTIONS.split() + ["repeat"])
        self.assertEqual((self.count("#summary tbody tr"), self.count("#summary .verdicts li")), (4, 3))
        self.assertEqual(self.texts("#contents a"), self.texts("main > section > h2"))
        done = sum(cell["status"] == "done" for cell in data["cells"])
        self.eventually(lambda: self.count("#distributions .point"), done)
        self.assertEqual((self.count("#graph .node"), self.count("#graph .node.differs")), (len(synthetic.GRAPH), 2))
        self.eventually(lambda: self.count("#landscape svg.plot"), 6)
        self.eventually(lambda: self.count("#paired .estimate"), 3)
        self.press("Pairs", "#paired")
        pairs = sum(item["pairs"] for item in data["comparisons"][:3])
        self.eventually(lambda: self.count("#paired .better, #paired .worse"), pairs)
        self.js("scrollTo(0, 2000)")
        self.eventually(lambda: self.browser.box("#bar")[1], 0)

    def test_capture_counts_every_cell_once(self):
        data = made()
        self.show(data)
        counts = self.js(
            modules(Data="report/page/data.js", Figures="report/page/figures.js")
            + "return Figures.captureBins(Data.load()).map((row) =>"
            " row.reduce((sum, item) => [sum[0] + item.count, sum[1] + item.of], [0, 0]))"
        )
        self.assertEqual(counts, [[item["success"]["count"], item["success"]["of"]] for item in data["summary"]])
        shown = self.texts("#capture .verdicts li")
        for variant, item, text in zip(data["variants"], data["summary"], shown, strict=True):
            name, value = text.split(": ")
            self.assertEqual(name, variant["name"])
            self.assertEqual(value.startswith("at least "), item["capture"]["is_open"])
            value = float(value.removeprefix("at least ").removesuffix("\u00a0mm"))
            self.assertAlmostEqual(value, item["capture"]["range"], delta=0.05)

    def test_two_pictures_are_compared(self):
        self.show()
        self.browser.show("pictures")
        place = lambda: self.the(".handle", "one.getAttribute('aria-valuenow')")
        clip = lambda: (self.the(".side-b", "getComputedStyle(one).clipPath"), place())
        self.assertEqual(clip(), ("inset(0px 0px 0px 50%)", "50"))
        self.wait(LOADED)  # they give the stage its size
        # Figures above that are drawn late move the stage: then it is missed, and dragged again.
        self.eventually(lambda: self.browser.drag(".stage", 0.5, 0.2) or clip(), ("inset(0px 0px 0px 20%)", "20"))
        for _ in range(5):
            self.browser.key("ARROW_RIGHT", ".handle")
        self.eventually(clip, ("inset(0px 0px 0px 30%)", "30"))
        self.press("Blink", "#pictures")
        visible = lambda: tuple(self.all(".stage img", "getComputedStyle(one).visibility"))
        seen, samples, end = set(), 0, time.monotonic() + 60
        while samples < 40 or (len(seen) < 2 and time.monotonic() < end):
            seen.add(visible())
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
        self.assertEqual(visible(), ("visible", "visible"))
        first, second = self.all(".stage img", "one.getBoundingClientRect().toJSON()")
        self.assertLessEqual(first["right"], second["left"])
        self.assertAlmostEqual(first["width"], second["width"], 0)

    def test_a_run_compares_its_outline_with_what_it_was_found_by(self):
        data = made("run", with_cube=False)
        one = data["cells"][0]["pictures"][0]["picture"]
        names = ["edges/frontal", "edges/lateral", "overlay/distal/lateral", "result/distal/lateral", "scene/lateral"]
        data["cells"][0]["pictures"] = [{"name": name, "picture": one} for name in names]
        self.show(data)
        chosen = self.all("#pictures .comparer select", "one.value")
        self.assertEqual(chosen, ["edges/lateral", "result/distal/lateral"], "of one view")

    def test_sorting_and_filtering(self):
        data = made()
        self.show(data)
        shown = lambda cells: [cell["id"] for cell in cells[: len(self.ids())]]
        cells = data["cells"]
        self.assertGreater(len(self.ids()), 10)
        self.assertEqual(self.ids(), shown(cells))
        self.press("mTRE mm", "#cells")
        finite = sorted((cell for cell in cells if cell["values"][0] is not None), key=lambda cell: cell["values"][0])
        self.assertEqual(self.ids(), shown(finite))
        self.press("mTRE mm", "#cells")
        self.assertEqual(self.ids(), shown(finite[::-1]))
        self.choose("Variant", "1", "#cells")
        self.choose("Outcome", "failed", "#cells")
        of_the_variant = [cell for cell in cells if cell["variant"] == 1]
        self.assertEqual(set(self.ids()), {cell["id"] for cell in of_the_variant if cell["status"] == "failed"})
        self.choose("Outcome", "", "#cells")
        self.choose("Text", "case-03", "#cells")
        self.assertEqual(set(self.ids()), {cell["id"] for cell in of_the_variant if cell["case"] == 2})
        self.press("Worst mm", "#summary")
        worst = [item["metrics"]["mtre_mm"]["worst"] for item in data["summary"]]
        rows = self.all("#summary tbody tr", "Number(one.dataset.row)")
        self.assertEqual(rows, sorted(range(4), key=worst.__getitem__))

    def test_drill_down(self):
        data = made()
        self.show(data)
        rich = next(cell for cell in data["cells"] if cell["scene"] and cell["variant"] == 1)
        point = '#distributions .point[data-cell="%s"]' % rich["id"]
        self.the(point, "one.dispatchEvent(new MouseEvent('click', {bubbles: true}))")
        self.assertTrue(self.the("#cell", "one.open"))
        text = self.the("#cell", "one.innerText")
        command = "marrow cell experiments/edges.yaml " + rich["id"]
        for wanted in ("canny, case-01", "edges.canny", command, rich["folder"], "%d" % rich["evaluations"]):
            self.assertIn(wanted, text)
        self.assertEqual(self.count("#cell .gallery img"), len(rich["pictures"]))
        self.press("Show in 3D", "#cell")
        self.assertEqual(self.count("#cell canvas.scene"), 1)
        self.press("Close", "#cell")
        failed = next(cell for cell in data["cells"] if cell["status"] == "failed")
        self.press(failed["id"], "#failures")
        self.assertIn(failed["reason"], self.the("#cell", "one.innerText"))
        self.show(data)
        self.js("location.hash = '#cell=' + arguments[0]; location.reload()", rich["id"])
        self.wait("document.documentElement.dataset.ready === 'true' && document.getElementById('cell').open")

    def test_what_is_not_there_because_a_node_failed_that_may(self):
        run, why = made("run", with_cube=False), "node 'f' (test.fail) failed: too large"
        run["cells"][0]["absent"] = why
        self.show(run)
        shown = self.the("#summary", "one.innerText")
        self.assertIn("What is not there\n" + why, shown)
        self.assertNotIn("Why it failed", shown)
        data = made(cases=2, starts=1)
        cell = next(cell for cell in data["cells"] if cell["status"] == "done")
        cell.update(values=[None] * len(cell["values"]), absent=why, success=False)
        self.show(data)
        self.press(cell["id"], "#cells")
        self.assertIn(why, self.the("#cell", "one.innerText"))

    def test_a_run_shows_its_verdict_first(self):
        run = made("run", with_cube=False)
        synthetic_verdicts.add_verdict(run["cells"][0], "doubtful")
        self.show(run)
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
        first = self.the("main table", "one.closest('section').id")
        self.assertEqual(first, "verdict", "no other table comes before it")

    def test_a_comparison_counts_what_verdicts_are_worth(self):
        data = made(cases=6, starts=5)
        synthetic_verdicts.add_verdicts(data)
        self.show(data)
        self.assertIn("A silent failure is a run that is no success", self.texts("#summary .note")[-1])
        shown = self.all("#summary table", "one.querySelectorAll('tbody tr')[2]?.innerText")[-1]
        counts = data["summary"][2]["verdicts"]
        for key in ("silent_failures", "false_alarms"):
            self.assertIn("%d/%d" % (counts[key]["count"], counts[key]["of"]), shown)
        self.press("Verdict", "#cells")
        cell = next(cell for cell in data["cells"] if cell.get("verdict") == "wrong")
        self.choose("Text", "wrong", "#cells")
        self.assertIn(cell["id"], self.ids())
        self.press(cell["id"], "#cells")
        text = self.the("#cell", "one.innerText")
        self.assertIn("the contour leads to a pose 6 mm away", text)
        self.assertRegex(text, r"Verdict\s+wrong failure 84 %")

    def test_run_page_leaves_out_comparisons(self):
        self.show(made("run"))
        self.assertEqual(self.sections(), OF_A_RUN.split())
        self.assertIn("mTRE", self.the("#summary", "one.innerText"))


if __name__ == "__main__":
    main()
