# SPDX-License-Identifier: Apache-2.0
"""What the tests of pages share: how a page is used in headless Chromium, and reports of made-up data."""
import functools
import hashlib
import json
import os
import pathlib
import shutil
import sys
import tempfile
import time
import unittest

from harness import BUILD, SOURCE, browser, shapes, skip, synthetic, synthetic_figures
from harness.sample import sample

sys.path.insert(0, str(SOURCE / "tools" / "report" / "page"))
import bundle  # noqa: E402


class BrowserTest(unittest.TestCase):
    """What is done with a page in the browser that all tests of a file share."""

    @classmethod
    def setUpClass(cls):
        cls.browser = browser.shared()

    def js(self, text, *arguments):
        return self.browser.js(text, *arguments)

    def the(self, selector, what):
        """An expression about the first `one` that is selected."""
        return self.js("const one = document.querySelector(arguments[0]); return " + what, selector)

    def all(self, selector, what):
        """The values of an expression about each `one` that is selected."""
        return self.js("return [...document.querySelectorAll(arguments[0])].map((one) => %s)" % what, selector)

    def text(self, selector):
        return self.the(selector, "one.textContent")

    def texts(self, selector):
        return self.all(selector, "one.textContent")

    def count(self, selector):
        return self.js("return document.querySelectorAll(arguments[0]).length", selector)

    def wait(self, condition, seconds=240):
        return self.browser.wait("return " + condition, seconds)

    def until(self, condition, what="", seconds=120):
        end = time.monotonic() + seconds
        while not (value := condition()):
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.05)
        return value

    def eventually(self, give, wanted):
        """That give() comes to what is wanted: figures are drawn when the browser finds the time."""
        end = time.monotonic() + 60
        while give() != wanted and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(give(), wanted)

    def press(self, text, within="body"):
        """Clicks the button with this text."""
        found = self.js(
            "const all = [...document.querySelectorAll(arguments[1] + ' button')];"
            "const one = all.find((b) => b.textContent.trim() === arguments[0]); if (one) one.click(); return !!one",
            text,
            within,
        )
        self.assertTrue(found, "no button '%s' in %s" % (text, within))

    def choose(self, label, value, within="body"):
        found = self.js(
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

    def fits(self):
        """That nothing is wider than the screen."""
        self.assertLessEqual(self.js("return document.documentElement.scrollWidth - innerWidth"), 0)

    def photograph(self, name):
        """Keeps a picture of the page in the folder MARROW_PICTURES, if it is given."""
        if "MARROW_PICTURES" in os.environ:
            self.browser.picture(os.path.join(os.environ["MARROW_PICTURES"], name + ".png"))


@functools.lru_cache
def made_text(kind, **sizes):
    """What a function of synthetic.py makes, as JSON. It is made once for all tests, because it takes seconds."""
    sources = [pathlib.Path(one.__file__).read_bytes() for one in (synthetic, synthetic_figures, shapes)]
    key = hashlib.sha256(b"".join(sources) + repr((kind, sorted(sizes.items()))).encode()).hexdigest()[:16]
    kept = BUILD / "tests" / "synthetic" / (key + ".json")
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        part = kept.with_suffix(".%d" % os.getpid())
        part.write_text(json.dumps(getattr(synthetic, kind)(**sizes)))
        part.replace(kept)
    return kept.read_text()


def made(kind="comparison", **sizes):
    """A comparison or a run of synthetic.py, for a test that may change it."""
    return json.loads(made_text(kind, **sizes))


@functools.lru_cache
def page_without_data(three):
    return bundle.html(pathlib.Path(bundle.__file__).with_name("report.html"), three)


def page_of(data, three=bundle.THREE):
    """The text of a report's page with this data."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    script = '<script type="application/json" id="data">%s</script>' % text
    return page_without_data(three).replace("<!-- marrow:data -->", script)


class ReportTest(BrowserTest):
    """Pages of reports in a folder of their own."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="marrow_report_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)

    @classmethod
    def write(cls, data, name="page"):
        path = cls.folder / (name + ".html")
        path.write_text(page_of(data))
        return path

    def show(self, data=None, **how):
        """Opens the page of this data; without data, that of the comparison."""
        return self.browser.open(self.write(data or made()), **how)

    def show_changed(self, change):
        """The comparison after a change of its data."""
        data = made()
        change(data)
        self.show(data)

    def tearDown(self):
        faults, asked = self.browser.logs()
        self.assertEqual(faults, [], "the console reports faults")
        self.assertEqual(
            [url for url in asked if not url.startswith("file://%s/" % self.folder)], [], "the page asked the network"
        )

    def ids(self):
        """The cells in the rows of the table that are drawn."""
        return self.all("#cells tbody tr", "one.dataset.id")

    def sections(self):
        return self.all("main > section", "one.id")


def named_tests(suite):
    """The ids of the tests in a suite of unittest, as they are given on the command line: Class.test."""
    for one in suite:
        if isinstance(one, unittest.TestSuite):
            yield from named_tests(one)
        else:
            yield ".".join(one.id().split(".")[-2:])


def main(part=1, needs_browser=True):
    """Runs the tests that the command line names; without names, one of `part` of them, the same in each run. Tests
    that need a browser are skipped without one."""
    if needs_browser and browser.missing():
        skip(browser.missing())
    names = sys.argv[1:]
    if not names:
        every = list(named_tests(unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"])))
        names = sample(every, max(3, len(every) // part))
    unittest.main(argv=sys.argv[:1] + names, verbosity=2)
