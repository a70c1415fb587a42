#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The main way in Firefox: from the first page to a case, its bone registered on the page Place, a pipeline that is
run, and its report."""
import os
import shutil
import unittest

from bench import SMALL, BenchTest, simulate
from harness import firefox, skip
from pipeline_bench import PIPELINE


class FirefoxTest(BenchTest):
    @classmethod
    def setUpClass(cls):
        cls.browser = firefox.Firefox()
        cls.addClassCleanup(cls.browser.close)

    def setUp(self):
        super().setUp()
        self.js, self.click = self.browser.js, self.browser.click

    def wait_for_page(self, name):
        self.browser.wait("return document.documentElement.dataset.ready === '%s'" % name)

    def show(self, page):
        """Another page by the bar."""
        self.click("#pages [data-page=%s]" % page)
        self.wait_for_page(page)

    def picture(self, name):
        if "MARROW_PICTURES" in os.environ:
            self.browser.picture(os.path.join(os.environ["MARROW_PICTURES"], "firefox-%s.png" % name))

    def test_from_the_folder_to_a_report(self):
        shutil.copytree(simulate(self.scratch / "simulated", *SMALL) / "case", self.folder / "mine")
        (self.folder / "small.yaml").write_text(PIPELINE)
        self.browser.open(self.open().address)
        self.wait_for_page("home")
        self.picture("home")
        self.click('[data-case="mine"] .name')
        self.wait_for_page("case")
        self.browser.wait(
            "const all = [...document.querySelectorAll('[data-slice]')];"
            "return all.length === 3 && all.every((one) => one.dataset.shown)",
            240,
        )
        self.picture("case")
        self.show("place")
        self.click("[data-do=register]:not(:disabled)")
        self.browser.wait("return !!document.querySelector('[data-judgement]')", 240)
        self.picture("place")
        self.show("pipeline")
        self.click("a[href='#pipeline=small.yaml']")
        self.browser.type("[data-input=level]", "0.4\ue004")  # and Tab
        self.click("[data-do=run]:not(:disabled)")
        self.browser.wait("return document.documentElement.dataset.run === 'done'", 300)
        self.picture("pipeline")
        self.show("results")
        self.click("[data-result='runs/small'] a")
        self.browser.wait("return !!document.querySelector('iframe.report:not([aria-busy])')")
        self.browser.into("iframe.report")
        self.browser.wait("return document.documentElement.dataset.ready === 'true'")
        self.assertEqual(self.js("return document.title"), "small · marrow")
        self.browser.into(None)
        self.picture("results")


if __name__ == "__main__":
    if not firefox.program():
        skip("missing Debian package: firefox-esr")
    unittest.main(verbosity=2)
