#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The report's page in headless Chromium, on made-up data: its sections, and that they answer to mouse and keys.

    tests/tools/report/report_test.py     exit code 77: skipped, with the reason
"""
import functools
import http.server
import shutil
import threading
import time

from harness import synthetic, synthetic_verdicts
from harness.modules import modules
from harness.page import ReportTest, made, main, page_of

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


# What lies beside the page, in the folder report/, in headless Chromium: it is loaded when it is asked for, from disk
# and from a server; without it the page is whole but for that, and says what is missing.


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


class PartsTest(ReportTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        data = synthetic.as_table(made(cases=3, starts=2, variants=2, looked_at=2))
        (cls.folder / "whole").mkdir()
        cls.page = cls.folder / "whole" / "report.html"
        cls.page.write_text(page_of(synthetic.put_beside(data, cls.folder / "whole" / "report", [(0, 1)])))
        cls.part = cls.folder / "whole" / "report" / data["parts"][0]["file"]
        (cls.folder / "alone").mkdir()
        cls.alone = shutil.copy(cls.page, cls.folder / "alone" / "report.html")
        cls.link = "#cell=canny/case-01/1"

    def check_cell(self):
        self.eventually(lambda: self.all("#cell .gallery img", "one.naturalWidth"), [256] * 4)
        headings = ["Pictures", "Convergence", "Cost about the result", "3D", "Its recipe"]
        self.assertEqual(self.texts("#cell h3")[-5:], headings)

    def test_a_part_is_loaded_once_it_is_asked_for(self):
        self.browser.open(self.page)
        self.assertEqual(self.browser.logs()[1], [self.page.as_uri()])
        options = self.texts("#pictures .picker label:first-of-type option")
        self.assertEqual(options, ["case-01, start 0", "case-01, start 1"])
        self.choose("Case and start", "1", "#pictures")
        self.eventually(lambda: self.all("#pictures .stage img", "one.naturalWidth"), [256, 256])
        self.browser.show("scene")
        self.wait("!!marrow.scene")
        self.eventually(lambda: self.count("#convergence svg.plot"), 1)
        self.browser.open(self.page, hash=self.link)
        self.check_cell()
        self.assertEqual(self.browser.logs()[1], [self.page.as_uri(), self.part.as_uri()])
        self.press("Close", "#cell")
        self.press("adaptive relaxation/case-01/1", "#cells")
        self.check_cell()
        self.assertEqual(self.browser.logs()[1], [], "it is loaded once")

    def test_from_a_server(self):
        handler = functools.partial(Quiet, directory=str(self.folder / "whole"))
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            address = "http://127.0.0.1:%d/" % server.server_port
            self.browser.open(address + "report.html", hash=self.link)
            self.check_cell()
            wanted = [address + "report.html", address + "report/" + self.part.name]
            self.assertEqual(self.browser.logs(), ([], wanted))
            server.shutdown()

    def test_a_page_alone_says_what_is_missing(self):
        self.browser.open(self.alone, hash=self.link)
        why = (
            "Of case-01, start 1, pictures and curves (%.2f MB) are not in this page but in the file report/%s beside"
            " it, which cannot be loaded. Open report.html where the comparison wrote it, or copy the folder report/"
            " along with the page."
        ) % (self.part.stat().st_size / 1e6, self.part.name)
        self.eventually(lambda: self.texts("#cell .note")[1:], [why + " Or make them again:"])
        command = "marrow cell experiments/edges.yaml canny/case-01/1 && marrow show runs/edges/pictures/"
        self.assertIn(command + "canny/case-01/1", self.texts("#cell .command code"))
        self.press("Close", "#cell")
        self.choose("Case and start", "1", "#pictures")
        self.eventually(lambda: self.texts("#pictures .note"), [why])
        self.choose("Case and start", "0", "#pictures")
        self.eventually(lambda: self.count("#pictures .stage img"), 2)
        faults = {fault.split(" - ")[0] for fault in self.browser.logs()[0]}
        self.assertEqual(faults, {(self.alone.parent / "report" / self.part.name).as_uri()})
        (self.folder / "damaged" / "report").mkdir(parents=True)
        page = shutil.copy(self.page, self.folder / "damaged" / "report.html")
        (self.folder / "damaged" / "report" / self.part.name).write_text("Parts.take('another', {});")
        self.browser.open(page, hash=self.link)
        self.eventually(lambda: "which cannot be loaded" in "".join(self.texts("#cell .note")), True)

    def test_a_workbench_gives_the_part_to_a_page_in_its_frame(self):
        frame = self.folder / "frame.html"
        frame.write_text(
            """<!DOCTYPE html><html data-ready="true"><link rel="icon" href="data:,">
            <iframe sandbox="allow-scripts" width="1000" height="800" src="alone/report.html"></iframe>
            <script>window.asked = [];
            const frame = document.querySelector('iframe').contentWindow;
            document.querySelector('iframe').onload = () => frame.postMessage({marrow: 'gives parts'}, '*');
            addEventListener('message', (event) => asked.push(event.data));</script>"""
        )
        self.browser.open(frame)
        self.browser.driver.switch_to.frame(0)
        self.wait("document.documentElement.dataset.ready === 'true'")
        self.press("canny/case-01/1", "#cells")
        self.browser.driver.switch_to.default_content()
        self.eventually(lambda: self.js("return asked"), [{"marrow": "part", "file": self.part.name}])
        self.js(
            "frame.postMessage({marrow: 'part', file: arguments[0], text: arguments[1]}, '*')",
            self.part.name,
            self.part.read_text(),
        )
        self.browser.driver.switch_to.frame(0)
        self.check_cell()
        self.browser.driver.switch_to.default_content()


if __name__ == "__main__":
    main()
