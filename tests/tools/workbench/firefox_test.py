#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The main way in Firefox: from the first page to a case, its bone registered on the page Place, a pipeline that is
run, and its report."""
import shutil
import unittest

from bench import PIPELINE, BenchTest
from harness import firefox, skip
from harness.cases import SMALL, simulate
from harness.page import BrowserTest


class FirefoxTest(BenchTest, BrowserTest):
    @classmethod
    def setUpClass(cls):
        cls.browser = firefox.Firefox()
        cls.addClassCleanup(cls.browser.close)

    def wait_for_page(self, name):
        self.wait("document.documentElement.dataset.ready === '%s'" % name)
        self.photograph("firefox-" + name)

    def show(self, page):
        """Another page by the bar."""
        self.browser.click("#pages [data-page=%s]" % page)
        self.wait_for_page(page)

    def test_from_the_folder_to_a_report(self):
        shutil.copytree(simulate(self.scratch / "simulated", *SMALL), self.folder / "mine")
        (self.folder / "small.yaml").write_text(PIPELINE)
        self.browser.open(self.open().address)
        self.wait_for_page("home")
        self.browser.click('[data-case="mine"] .name')
        self.wait_for_page("case")
        self.until(lambda: len(shown := self.all("[data-slice]", "!!one.dataset.shown")) == 3 and all(shown))
        self.show("place")
        self.browser.click("[data-do=register]:not(:disabled)")
        self.browser.find("[data-judgement]")
        self.show("pipeline")
        self.browser.click("a[href='#pipeline=small.yaml']")
        self.browser.type("[data-input=level]", "0.4\ue004")  # and Tab
        self.browser.click("[data-do=run]:not(:disabled)")
        self.wait("document.documentElement.dataset.run === 'done'", 300)
        self.show("results")
        self.browser.click("[data-result='runs/small'] a")
        self.browser.find("iframe.report:not([aria-busy])")
        self.browser.into("iframe.report")
        self.wait_for_page("true")
        self.assertEqual(self.js("return document.title"), "small · marrow")


if __name__ == "__main__":
    if not firefox.program():
        skip("missing Debian package: firefox-esr")
    unittest.main(verbosity=2)
