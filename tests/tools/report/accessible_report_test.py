#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Reports for all people and on all screens: names contain what is seen, landmarks differ, and no picture repeats the
text beside it, by the same rules as axe's label-content-name-mismatch, landmark-unique and image-redundant-alt. Words
have the meanings of docs/glossary.md, for those who point at them and for those who go there by the Tab key. Hostile
texts stay texts. With MARROW_AXE=axe.min.js, axe itself checks the pages, too.

    tests/tools/report/accessible_report_test.py     exit code 77: skipped, with the reason
"""
import os
import pathlib
import re

from harness import SOURCE, synthetic_verdicts
from harness.modules import modules
from harness.page import ReportTest, made, main, page_of

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
NAMELESS = """const controls = 'button, select, input, [role=button], [role=slider], svg[role=img], canvas, img';
const named = (one) => one.textContent.trim() || one.matches('button img[alt=""]') || one.getAttribute('aria-label') ||
    one.getAttribute('alt') || (one.labels && one.labels.length);
return [...document.querySelectorAll(controls)].filter((one) => !one.closest('dialog') && !named(one)).map(brief)"""
AXE = """const done = arguments[0];
axe.run(document, {rules: {'label-content-name-mismatch': {enabled: true}}}).then(
    (found) => done(found.violations.map((one) => [one.id, one.nodes.map((node) => node.html.slice(0, 120))])))"""
# Of all but code and, on a phone, the table of all runs.
WIDE = """return [...document.querySelectorAll('main .scroll')].filter(
    (one) => shown(one) && !one.matches('.rows') && one.scrollWidth > one.clientWidth + 1).map(brief)"""
CUT = """return [...document.querySelectorAll('svg.plot text, #contents a')].filter((one) => {
  const box = one.getBoundingClientRect();
  return box.left < 0 || box.right > innerWidth;
}).map((one) => one.textContent)"""
HOSTILE = "</script><script>window.hurt = 1</script><img src=x onerror='window.hurt = 2'>\"&amp;${1}"
# What a word and its meaning are in the page: the word without its unit, and the box that says more.
POINT = """const word = document.querySelector(arguments[0]), box = word.getBoundingClientRect();
word.dispatchEvent(new PointerEvent('pointermove', {clientX: box.x + 2, clientY: box.y + 2, bubbles: true}));
const tip = document.getElementById('tooltip');
return tip.hidden ? null : tip.textContent"""


def judged():
    data = made()
    synthetic_verdicts.add_verdicts(data)
    return data


class AccessibleReportTest(ReportTest):
    def pages(self):
        run = made("run")
        synthetic_verdicts.add_verdict(run["cells"][0], "doubtful")
        return {"comparison": judged(), "run": run}

    def test_names_landmarks_and_pictures(self):
        axe = os.environ.get("MARROW_AXE")
        for name, data in self.pages().items():
            for width_px, theme in ((1440, "light"), (400, "dark")):
                with self.subTest(page=name, width_px=width_px, theme=theme):
                    self.show(data, width_px=width_px, theme=theme)
                    self.wait("document.querySelectorAll('#landscape svg.plot').length")
                    self.browser.show("scene")
                    self.wait("!!marrow.scene")
                    for rule in (OTHER_NAME, SAME_LANDMARKS, REPEATED, NAMELESS):
                        self.assertEqual(self.js(COMMON + rule), [])
                    if axe:
                        self.js(pathlib.Path(axe).read_text())
                        self.assertEqual(self.browser.driver.execute_async_script(AXE), [])

    def test_nothing_is_wider_than_the_screen(self):
        """Neither the page nor anything in it, and each section can be reached."""
        for name, data in self.pages().items():
            for width_px in (1440, 1024, 400):
                with self.subTest(page=name, width_px=width_px):
                    self.show(data, width_px=width_px)
                    width = lambda: self.js("return document.documentElement.scrollWidth")
                    self.assertEqual(width(), width_px)
                    if (name, width_px) == ("comparison", 1440):
                        self.assertLessEqual(self.the(".rows", "one.scrollWidth - one.clientWidth"), 0, "all runs fit")
                    for section in self.sections() if width_px == 400 or "MARROW_PICTURES" in os.environ else ():
                        self.browser.show(section)
                        self.photograph("report-%s-%d-%s" % (name, width_px, section))
                    self.js("document.querySelectorAll('main details').forEach((one) => (one.open = true))")
                    self.assertEqual(self.js(COMMON + WIDE), [])
                    self.assertEqual(self.js(CUT), [])
                    self.assertEqual(width(), width_px, "drawn and opened")

    def test_theme(self):
        ink = lambda: self.the("body", "getComputedStyle(one).backgroundColor")
        self.show(theme="dark")
        self.assertEqual(ink(), "rgb(20, 24, 27)")
        self.press("Light")
        self.assertEqual(ink(), "rgb(255, 255, 255)")
        self.js("localStorage.clear()")

    def test_hostile_text_is_text(self):
        data = made(cases=3, starts=2, looked_at=1)
        data["experiment"].update(name=HOSTILE, help=HOSTILE, text=HOSTILE, command=HOSTILE, file=HOSTILE)
        data["variants"][1].update(name=HOSTILE, options={HOSTILE: HOSTILE})
        data["cases"][0] = data["starts"][0] = data["metrics"][0]["label"] = data["metrics"][0]["unit"] = HOSTILE
        data["cells"][-1].update(status="failed", reason=HOSTILE, id=HOSTILE)
        data["comparisons"][0].update(variant=HOSTILE, sentence=HOSTILE)
        node = {"id": HOSTILE, "uses": HOSTILE, "options": {HOSTILE: HOSTILE}, "differs": {HOSTILE: HOSTILE}}
        data["graph"]["nodes"][0].update(node)
        for cell in data["cells"]:
            for picture in cell["pictures"]:
                picture["name"] = HOSTILE + picture["name"]
        self.show()
        scripts = self.js("return document.scripts.length")
        self.show(data)
        self.browser.show("scene")
        self.press(HOSTILE, "#failures")
        self.assertEqual([self.text("h1"), self.text("#cell .reason")], 2 * [HOSTILE])
        self.assertIsNone(self.js("return window.hurt || null"))
        self.assertEqual(self.count("img[onerror], img[src=x]"), 0)
        self.assertEqual(self.js("return document.scripts.length"), scripts)

    def test_without_three_and_without_data(self):
        path = self.folder / "no_three.html"
        path.write_text(page_of(made("run"), three=pathlib.Path("/nowhere/three.module.js")))
        self.browser.open(path)
        self.browser.show("scene")
        self.wait("document.querySelector('#scene').innerText.includes('libjs-three')")
        self.show({"marrow": "0.1.0", "format": 1, "kind": "comparison", "experiment": {"name": "bare"}})
        self.assertEqual(self.texts("h1"), ["bare"])


class GlossaryTest(ReportTest):
    @classmethod
    def setUpClass(cls):
        """{name in small letters: meaning} of the document."""
        super().setUpClass()
        cls.entries = {}
        text = (SOURCE / "docs" / "glossary.md").read_text()
        for item in re.findall(r"^- (\*\*(?:.|\n)*?)(?=\n- |\n\n|\Z)", text, re.M):
            names, meaning = re.fullmatch(r"(\*\*.+?\*\*): (.+)", " ".join(item.split())).groups()
            for name in re.findall(r"\*\*(.+?)\*\*", names):
                assert name.lower() not in cls.entries, name + " is explained twice"
                cls.entries[name.lower()] = meaning

    def test_words_of_a_comparison_are_explained(self):
        data, count = judged(), 0
        self.show(data)
        heads = self.all(
            ":is(#summary, #paired, #cells) thead th",
            "[one.querySelector('button').firstChild.textContent, one.dataset.tip || null]",
        )
        metrics = [metric["label"] for metric in data["metrics"]]  # an experiment names its figures as it likes
        for title, tip in heads:
            if title not in metrics or title.lower() in self.entries:
                count += 1
                self.assertEqual(tip, self.entries.get(title.lower()), title)
                self.assertIsNotNone(tip, title + ": docs/glossary.md does not explain it")
        self.assertGreater(count, 25)
        shown = self.all("#cells .outcome", "[one.textContent, one.dataset.tip]")
        self.assertTrue({"trusted", "doubtful", "wrong"} & {word for word, _ in shown}, shown)
        for word, tip in shown:
            self.assertEqual(tip, self.entries[word], word)
        self.browser.show("capture")
        self.assertEqual(self.js(POINT, "#capture h2 .term"), self.entries["capture range"])
        script = modules(Glossary="report/page/glossary.js")
        found = self.js(script + "return arguments[0].map(Glossary.meaning)", list(self.entries))
        self.assertEqual(dict(zip(self.entries, found)), self.entries, "every entry is found by its name")

    def test_words_of_a_run_are_explained(self):
        data = made("run")
        cell = data["cells"][0]
        synthetic_verdicts.add_verdict(cell, "doubtful")
        reason = "a random pose nearby explains the images 0.72 times as well"
        cell["verdicts"][0]["reasons"] = [*cell["verdicts"][0]["reasons"], reason]
        names = ["rotation_deg", "mtre_mm", "matched_percent", "unheard_of_mm", "frontal_median_px"]
        rows = [{"name": name, "unit": "", "values": [1]} for name in names]
        data["figures"] = [{"name": "errors", "columns": ["final"], "rows": rows}]
        self.show(data)
        terms = self.all("#verdict .term", "[one.textContent, one.dataset.tip, one.tabIndex]")
        words = {word: (tip, place) for word, tip, place in terms}
        for word in ("doubtful", "long axis", "random pose nearby", "times as well"):
            self.assertEqual(words[word], (self.entries[word], 0), word)
        self.assertIn(reason, self.texts("#verdict .verdict-list li"))
        tips = self.all("table.figures tbody th", "[one.textContent, one.querySelector('.term')?.dataset.tip || null]")
        wanted = [self.entries["rotation"], self.entries["mtre"], self.entries["matched"], None]
        wanted.append("In “frontal” alone: " + self.entries["median"])
        self.assertEqual(tips, [list(pair) for pair in zip(names, wanted)])


if __name__ == "__main__":
    main()
