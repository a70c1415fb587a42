#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Reports for people who use a screen reader or a voice: names contain what is seen, landmarks differ, and no picture
repeats the text beside it. The same rules as axe's label-content-name-mismatch, landmark-unique and
image-redundant-alt. With MARROW_AXE=axe.min.js, axe itself checks the pages, too.

    tests/tools/report/accessible_report_test.py     exit code 77: skipped, with the reason
"""
import os
import pathlib
import sys

from harness import synthetic, synthetic_verdicts
from harness.page import PageTest, run_tests

COMMON = """const words = (text) => text.toLowerCase().replace(/[^\\p{L}\\p{N}]+/gu, ' ').trim();
const shown = (one) => one.checkVisibility();
const brief = (one) => one.outerHTML.slice(0, 120);
"""
OTHER_NAME = """const named = 'button, a[href], [role=button], [role=tab], [role=option], summary';
return [...document.querySelectorAll(named)].filter(shown).filter((one) => {
  const name = one.getAttribute('aria-label'), text = words(one.textContent);
  return name !== null && text && !words(name).includes(text);
}).map(brief)"""
SAME_LANDMARKS = """const sections = 'section[aria-labelledby], section[aria-label], [role=region]';
const landmarks = sections + ', nav, main, header, aside';
const name = (one) => [one.getAttribute('role') || (one.matches('section') ? 'region' : one.localName),
  one.getAttribute('aria-label') || (document.getElementById(one.getAttribute('aria-labelledby')) || {}).textContent];
const all = [...document.querySelectorAll(landmarks)].filter(shown).map((one) => [String(name(one)), brief(one)]);
return all.filter(([name], i) => all.findIndex(([other]) => other === name) !== i)"""
REPEATED = """return [...document.querySelectorAll('button img, a img')].filter(
    (one) => one.alt && words(one.closest('button, a').textContent) === words(one.alt)).map(brief)"""
AXE = """const done = arguments[0];
axe.run(document, {rules: {'label-content-name-mismatch': {enabled: true}}}).then(
    (found) => done(found.violations.map((one) => [one.id, one.nodes.map((node) => node.html.slice(0, 120))])))"""


class AccessibleReportTest(PageTest):
    def pages(self):
        data = synthetic.comparison()
        synthetic_verdicts.add_verdicts(data)
        run = synthetic.run()
        synthetic_verdicts.add_verdict(run["cells"][0], "doubtful")
        return {"comparison": self.write("all", data), "run": self.write("judged", run)}

    def test_names_landmarks_and_pictures(self):
        axe = os.environ.get("MARROW_AXE")
        for name, page in self.pages().items():
            for width_px, theme in ((1440, "light"), (400, "dark")):
                with self.subTest(page=name, width_px=width_px, theme=theme):
                    self.browser.open(page, width_px, theme=theme)
                    self.browser.wait("return document.querySelectorAll('#landscape svg.plot').length")
                    for rule in (OTHER_NAME, SAME_LANDMARKS, REPEATED):
                        self.assertEqual(self.browser.js(COMMON + rule), [])
                    if axe:
                        self.browser.js(pathlib.Path(axe).read_text())
                        self.assertEqual(self.browser.driver.execute_async_script(AXE), [])

    def test_nothing_is_wider_than_the_screen(self):
        """Neither the page nor, but for code and the table of all runs on a phone, anything in it."""
        wide = """return [...document.querySelectorAll('main .scroll')].filter(
            (one) => shown(one) && !one.matches('.rows') && one.scrollWidth > one.clientWidth + 1).map(brief)"""
        for name, page in self.pages().items():
            for width_px in (1440, 1024, 400):
                with self.subTest(page=name, width_px=width_px):
                    self.browser.open(page, width_px)
                    self.assertEqual(self.browser.js("return document.documentElement.scrollWidth"), width_px)
                    self.browser.js("document.querySelectorAll('main details').forEach((one) => (one.open = true))")
                    self.assertEqual(self.browser.js(COMMON + wide), [])
                    cut = """return [...document.querySelectorAll('svg.plot text')].filter((one) => {
                      const box = one.getBoundingClientRect();
                      return box.left < 0 || box.right > innerWidth;
                    }).map((one) => one.textContent)"""
                    self.assertEqual(self.browser.js(cut), [])
                    outside = """const boxes = [...document.querySelectorAll('#contents a')];
                        return boxes.map((one) => one.getBoundingClientRect())
                            .filter((box) => box.right > innerWidth || box.left < 0).length"""
                    self.assertEqual(self.browser.js(outside), 0, "each section can be reached")
            if name == "comparison":
                self.browser.open(page, 1440)
                rows = "const r = document.querySelector('.rows'); return r.scrollWidth - r.clientWidth"
                self.assertLessEqual(self.browser.js(rows), 0, "the table of all runs fits")


if __name__ == "__main__":
    sys.exit(run_tests(sys.argv[1:]))
