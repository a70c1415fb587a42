# SPDX-License-Identifier: Apache-2.0
"""What the tests of the report's page share: pages of made-up data in headless Chromium, and how they are used."""
import functools
import json
import pathlib
import shutil
import sys
import tempfile
import time
import unittest

from harness import SOURCE, browser, skip, synthetic

sys.path.insert(0, str(SOURCE / "tools" / "report" / "page"))
import bundle  # noqa: E402

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


@functools.lru_cache
def page_without_data(three):
    return bundle.html(pathlib.Path(bundle.__file__).with_name("report.html"), three)


def page_of(data, three=bundle.THREE):
    """The text of a report's page with this data."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    script = '<script type="application/json" id="data">%s</script>' % text
    return page_without_data(three).replace("<!-- marrow:data -->", script)


class BrowserTest(unittest.TestCase):
    """A browser, a folder for pages, and what is done with a page."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow_report_"))
        cls.browser = browser.Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        shutil.rmtree(cls.folder)

    @classmethod
    def write(cls, name, data):
        path = cls.folder / (name + ".html")
        path.write_text(page_of(data))
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


class PageTest(BrowserTest):
    """The same with the page of a comparison and that of a run."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.comparison_data = synthetic.comparison()
        cls.run_data = synthetic.run()
        cls.comparison = cls.write("comparison", cls.comparison_data)
        cls.run_page = cls.write("run", cls.run_data)


def run_tests(arguments=()):
    """The exit code of this file's tests, which are skipped without a browser."""
    if browser.missing():
        skip(browser.missing())
    program = unittest.main(argv=sys.argv[:1] + list(arguments), exit=False, verbosity=2)
    return 0 if program.result.wasSuccessful() else 1
