#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""All pages of `marrow open` for people who see little, or use no mouse: contrast by WCAG 2.1 AA in light and dark,
names for screen readers, and no page wider than a narrow screen."""
import itertools
import pathlib
import shutil
import tempfile

from bench import PageTest
from harness import SOURCE
from harness.cases import FEMUR, SMALL, simulate
from harness.page import main
from harness.program import marrow
from harness.sample import sample

# Text whose contrast to what is behind it is too low: [ratio, text, its element]. By WCAG 2.1, 1.4.3: 4.5, and 3 for
# large text. Controls that are switched off, and text over pictures, do not count.
LOW_CONTRAST = """
const numbers = (colour) => (colour.match(/[\\d.]+/g) || []).map(Number);
const light = ([r, g, b]) => [r, g, b].map((v) => (v /= 255, v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
const over = (top, below) => {
  const a = top.length > 3 ? top[3] : 1;
  return [0, 1, 2].map((i) => a * top[i] + (1 - a) * below[i]);
};
function behind(node) {
  const layers = [];
  for (; node; node = node.parentElement) {
    const colour = numbers(getComputedStyle(node).backgroundColor);
    if (colour.length === 3 || colour[3] > 0) layers.push(colour);
    if (colour.length === 3 || colour[3] === 1) break;
  }
  const paper = numbers(getComputedStyle(document.body).backgroundColor);
  return layers.reverse().reduce((below, top) => over(top, below), paper);
}
const found = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const text = walker.currentNode.textContent.trim(), node = walker.currentNode.parentElement;
  if (!text || node.closest('script, noscript, svg, [hidden], :disabled, .hidden, canvas')) continue;
  if (!node.checkVisibility()) continue;
  const style = getComputedStyle(node), size = parseFloat(style.fontSize);
  const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
  const ground = behind(node), ink = over(numbers(style.color), ground);
  const [a, b] = [light(ink), light(ground)].sort((x, y) => y - x), ratio = (a + 0.05) / (b + 0.05);
  if (ratio < (large ? 3 : 4.5)) found.push([ratio.toFixed(2), text.slice(0, 40), node.outerHTML.slice(0, 120)]);
}
return found;
"""
# What can be reached by the keyboard and has no name that a screen reader could say.
UNNAMED = """
const reached = 'a[href], button, input, select, textarea, canvas, [tabindex], dialog[open]';
return [...document.querySelectorAll(reached)].filter(
    (one) => !one.closest('[hidden], [aria-hidden="true"]') && one.checkVisibility() && one.id !== 'page' &&
        !one.textContent.trim() && !one.getAttribute('aria-label') && !one.getAttribute('aria-labelledby') &&
        !one.title && !(one.labels && one.labels.length)).map((one) => one.outerHTML.slice(0, 120));
"""
# Names that lack the words that are seen: who says them to the computer presses nothing. By WCAG 2.1, 2.5.3.
MISNAMED = """
const words = (text) => text.toLowerCase().replace(/[^\\p{L}\\p{N} ]/gu, ' ').replace(/ +/g, ' ').trim();
return [...document.querySelectorAll('a[aria-label], button[aria-label]')].filter(
    (one) => !words(one.getAttribute('aria-label')).includes(words(one.textContent))).map((one) => one.outerHTML);
"""
# Parts of the page that a screen reader lists under the same name.
SAME_PARTS = """
const parts = [...document.querySelectorAll('nav, aside, header, section[aria-label]')]
    .filter((one) => one.checkVisibility()).map((one) => one.localName + ' ' + one.getAttribute('aria-label'));
return parts.filter((one, i) => parts.indexOf(one) !== i);
"""
ALL = (LOW_CONTRAST, UNNAMED, MISNAMED, SAME_PARTS)
TWO = "results=run&with=again"
PAGES = ("home", "case=case", "place=case", "pipeline=femur/femur.yaml", "results=run", "results=", TWO)


class AccessibleTest(PageTest):
    """Its folder holds a case, a pipeline and runs, which are made once for all tests."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.made = pathlib.Path(tempfile.mkdtemp(prefix="marrow-accessible-"))
        cls.addClassCleanup(shutil.rmtree, cls.made, ignore_errors=True)
        folder = cls.made / "folder"
        shutil.copytree(simulate(cls.made / "simulated", *SMALL), folder / "case")
        for name in ("femur", "parts", "verdict"):
            shutil.copytree(SOURCE / "pipelines" / name, folder / name)
        for out in ("run", "again"):
            environment = {"MARROW_CACHE": str(cls.made / "store")}
            command = ["run", FEMUR, "case=case", "--out", out, "--quiet"]
            assert marrow(*command, cwd=folder, extra_environment=environment).returncode == 0

    def setUp(self):
        super().setUp()
        for name in ("folder", "store"):  # the store knows what the pages compute of the case
            shutil.copytree(self.made / name, self.scratch / name, dirs_exist_ok=True)
        self.open()

    def page(self, page, **look):
        """The page, when the work that it begins with is done."""
        self.show(page, **look)
        self.wait("!document.querySelector('.notice.job, iframe[aria-busy]')")
        self.assertEqual([text for text in self.texts(".fault") if text], [], page)
        if page.startswith("pipeline"):
            self.browser.key("ENTER", "[data-node=edges]")
            self.find("[data-do=fits]")

    def test_contrast_and_names_on_all_pages(self):
        for theme, page in sample(itertools.product(("light", "dark"), PAGES), 5):
            with self.subTest(page=page, theme=theme):
                self.page(page, theme=theme)
                for what in ALL:
                    self.assertEqual(self.js(what), [])

    def test_all_steps_of_a_case(self):
        self.page("case=case")
        self.js("document.querySelectorAll('details').forEach((one) => (one.open = true))")
        for step in ("ct", "bones", "xrays", "check", "save"):
            with self.subTest(step=step):
                self.go_to_step(step)
                for what in ALL:
                    self.assertEqual(self.js(what), [])

    def test_no_page_is_wider_than_the_screen(self):
        for width_px, page in sample(itertools.product((1440, 1024, 400), PAGES), 8, key=lambda one: one[1]):
            with self.subTest(page=page, width_px=width_px):
                self.page(page, width_px=width_px)
                self.fits()
                if page.startswith("case"):
                    self.assertEqual(self.js(UNNAMED), [])
                self.photograph("%s-%d" % (page.split("=")[0], width_px))


if __name__ == "__main__":
    main()
