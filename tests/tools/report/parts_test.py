#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What lies beside the page, in the folder report/, in headless Chromium: it is loaded when it is asked for, from disk
and from a server; without it the page is whole but for that, and says what is missing.

    tests/tools/report/parts_test.py     exit code 77: skipped, with the reason
"""
import functools
import http.server
import shutil
import threading

from harness import synthetic
from harness.page import ReportTest, made, main, page_of


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
