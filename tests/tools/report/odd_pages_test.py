#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Pages that are unlike others, in headless Chromium: hostile texts, no cells, narrow and dark ones, and
for those who do not see them.

    tests/tools/report/odd_pages_test.py     exit code 77: skipped, with the reason
"""
import pathlib
import sys

from harness import synthetic
from harness.page import PageTest, page_of, run_tests

HOSTILE = "</script><script>window.hurt = 1</script><img src=x onerror='window.hurt = 2'>\"&amp;${1}"


class OddPagesTest(PageTest):
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

    def test_without_three_and_without_data(self):
        path = self.folder / "no_three.html"
        path.write_text(page_of(self.run_data, three=pathlib.Path("/nowhere/three.module.js")))
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
        self.browser.wait("return !!marrow.scene")
        nameless = self.browser.js(
            """const controls = 'button, select, input, [role=button], [role=slider], svg[role=img], canvas, img';
            const beside = 'button img[alt=""]';
            const named = (item) => item.textContent.trim() || item.matches(beside) ||
              item.getAttribute('aria-label') || item.getAttribute('alt') || (item.labels && item.labels.length);
            return [...document.querySelectorAll(controls)].filter((item) => !item.closest('dialog') && !named(item))
              .map((item) => item.outerHTML.slice(0, 120))"""
        )
        self.assertEqual(nameless, [])


if __name__ == "__main__":
    sys.exit(run_tests(sys.argv[1:]))
