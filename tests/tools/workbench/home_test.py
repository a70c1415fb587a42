#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The first page and what surrounds all pages: new cases, drafts, the case that goes along, keys, and the bar."""
import bench
from bench import PageTest


class HomeTest(PageTest):
    def setUp(self):
        super().setUp()
        self.js = self.browser.js
        (self.folder / "cases" / "7").mkdir(parents=True)
        (self.folder / "cases" / "7" / "case.yaml").write_text("marrow-case: 1\n")
        (self.folder / ".marrow" / "drafts").mkdir(parents=True)
        self.drafts = self.folder / ".marrow" / "drafts"

    def show_home(self, page="home", **size):
        self.server = self.open()
        self.show(self.server, page, **size)
        self.browser.logs()

    def rows(self):
        return self.js("return [...document.querySelectorAll('[data-case]')].map((one) => one.dataset.case)")

    def press(self, key, code, modifiers=0):
        self.browser.driver.execute_cdp_cmd(
            "Input.dispatchKeyEvent", {"type": "keyDown", "modifiers": modifiers, "key": key, "code": code}
        )

    def test_a_new_case_gets_a_name(self):
        self.show_home()
        self.click("[data-do=new-case]")
        box = self.find("[data-do=name]")
        self.assertEqual(box.get_attribute("value"), "case")
        for name, fault in (
            ("cases/7", "There is a case cases/7 already."),
            ("../x", "no part of it begins with a dot"),
            ("/x", "A name is a folder below this one"),
            ("", "Give the case a name, such as case."),
        ):
            box.clear()
            box.send_keys(name + "\n")
            self.assertIn(fault, self.js("return document.querySelector('#dialog [role=alert]').textContent"))
        box.send_keys("cases/8\n")
        self.wait_for_page("case")
        self.assertEqual(self.js("return location.hash"), "#case=cases/8")
        self.assertEqual(list(self.drafts.iterdir()), [], "nothing is written before a change")

    def test_drafts_are_listed_and_thrown_away(self):
        (self.drafts / "cases%2F9.jsonl").write_text('{"what": "a", "document": {}}\n{"what": "b", "document": {}}\n')
        (self.drafts / "broken.jsonl").write_text("garbage\n")
        self.show_home()
        self.assertEqual(self.rows(), ["broken", "cases/7", "cases/9"])
        of = lambda case: self.js("return document.querySelector('[data-case=\"%s\"]').innerText" % case)
        self.assertIn("1 change not saved, just now", of("cases/9"))
        self.assertIn("broken.jsonl:1:1:1: not valid JSON", of("broken"))
        self.click('[data-throw="cases/9"]')
        self.click("[data-do=throw-away]")
        self.browser.wait("return document.querySelectorAll('[data-case]').length === 2", 30)
        self.click('[data-throw="broken"]')
        self.click("[data-do=throw-away]")
        self.browser.wait("return document.querySelectorAll('[data-case]').length === 1", 30)
        self.assertEqual(list(self.drafts.iterdir()), [])

    def test_a_draft_of_garbage_is_not_an_empty_case(self):
        (self.drafts / "broken.jsonl").write_text("garbage\n")
        self.show_home("case=broken")
        self.assertIn("not valid JSON", self.js("return document.querySelector('.fault').textContent"))
        self.assertFalse(self.js("return !!document.querySelector('section.panel')"))

    def test_the_case_goes_along(self):
        self.show_home()
        links = "return [...document.querySelectorAll('#pages a')].map((one) => one.getAttribute('href'))"
        self.assertEqual(self.js(links), ["#home=", "#case=", "#place=", "#pipeline=", "#results="])
        self.assertTrue(self.js("return document.getElementById('present-case').hidden"))
        self.click("#pages [data-page=case]")
        self.wait_for_page("cases")
        self.assertEqual(self.js("return document.querySelector('#pages [aria-current]').dataset.page"), "case")
        self.assertEqual(self.rows(), ["cases/7"], "without a case, the page lists them")
        self.click('[data-case="cases/7"] .name')
        self.browser.wait("return location.hash === '#case=cases/7'", 30)
        self.wait_for_page("case")
        self.click("#pages [data-page=results]")
        self.wait_for_page("results")
        self.assertEqual(self.js(links), ["#home=", "#case=cases/7", "#place=cases/7", "#pipeline=", "#results="])
        self.assertEqual(self.js("return document.getElementById('present-case').textContent"), "cases/7")

    def test_keys_lead_from_section_to_section_and_save(self):
        self.show_home()
        at = "return document.activeElement.getAttribute('aria-label')"
        seen = []
        for _ in range(5):
            self.press("ArrowDown", "ArrowDown", 1)
            seen.append(self.js(at))
        self.assertEqual(seen, ["Cases", "Runs", "Comparisons", "Pipelines", "Cases"])
        self.press("ArrowUp", "ArrowUp", 1)
        self.assertEqual(self.js(at), "Pipelines")
        self.press("s", "KeyS", 2)
        self.browser.wait("return document.getElementById('notices').textContent.includes('nothing to save')", 30)

    def test_the_button_of_the_theme_says_what_it_will_do(self):
        self.show_home()
        label = "return document.getElementById('theme').textContent"
        self.assertEqual(self.js(label), "Dark")
        self.click("#theme")
        self.assertEqual(self.js(label), "Light")
        self.assertEqual(self.js("return document.getElementById('theme').getAttribute('aria-label')"), None)
        self.click("#theme")
        self.assertEqual(self.js(label), "Dark")

    def test_the_bar_wraps_on_a_phone(self):
        self.show_home("case=cases/7", width_px=400, height_px=800)
        links = self.js(
            "return [...document.querySelectorAll('#pages a')].map((one) => one.getBoundingClientRect())"
            ".map((box) => [box.left, box.right])"
        )
        self.assertTrue(all(left >= 0 and right <= 400 for left, right in links), links)
        bar = "return document.getElementById('%s').getBoundingClientRect().%s"
        self.assertLessEqual(self.js(bar % ("pages", "bottom")), self.js(bar % ("bar", "bottom")) + 1)


if __name__ == "__main__":
    bench.main(part=1)
