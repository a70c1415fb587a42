#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The first page and what surrounds all pages: new cases, drafts, the case that goes along, keys, and the bar."""
from bench import PageTest
from harness.page import main


class HomeTest(PageTest):
    def setUp(self):
        super().setUp()
        (self.folder / "cases" / "7").mkdir(parents=True)
        (self.folder / "cases" / "7" / "case.yaml").write_text("marrow-case: 1\n")
        self.drafts = self.folder / ".marrow" / "drafts"
        self.drafts.mkdir(parents=True)

    def rows(self):
        return self.all("[data-case]", "one.dataset.case")

    def test_a_new_case_gets_a_name(self):
        self.show()
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
            self.assertIn(fault, self.text("#dialog [role=alert]"))
        box.send_keys("cases/8\n")
        self.wait_for_page("case")
        self.assertEqual(self.js("return location.hash"), "#case=cases/8")
        self.assertEqual(list(self.drafts.iterdir()), [], "nothing is written before a change")

    def test_drafts_are_listed_and_thrown_away(self):
        (self.drafts / "cases%2F9.jsonl").write_text('{"what": "a", "document": {}}\n{"what": "b", "document": {}}\n')
        (self.drafts / "broken.jsonl").write_text("garbage\n")
        self.show()
        self.assertEqual(self.rows(), ["broken", "cases/7", "cases/9"])
        of = lambda case: self.the('[data-case="%s"]' % case, "one.innerText")
        self.assertIn("1 change not saved, just now", of("cases/9"))
        self.assertIn("broken.jsonl:1:1:1: not valid JSON", of("broken"))
        self.show("case=broken")
        self.assertIn("not valid JSON", self.text(".fault"))
        self.assertEqual(self.count("section.panel"), 0, "a draft of garbage is not an empty case")
        self.show()
        for case, left in (("cases/9", 2), ("broken", 1)):
            self.click('[data-throw="%s"]' % case)
            self.click("[data-do=throw-away]")
            self.eventually(lambda: len(self.rows()), left)
        self.assertEqual(list(self.drafts.iterdir()), [])

    def test_the_case_goes_along(self):
        self.show()
        links = lambda: self.all("#pages a", "one.getAttribute('href')")
        self.assertEqual(links(), ["#home=", "#case=", "#place=", "#pipeline=", "#results="])
        self.assertTrue(self.the("#present-case", "one.hidden"))
        self.click("#pages [data-page=case]")
        self.wait_for_page("cases")
        self.assertEqual(self.the("#pages [aria-current]", "one.dataset.page"), "case")
        self.assertEqual(self.rows(), ["cases/7"], "without a case, the page lists them")
        self.click('[data-case="cases/7"] .name')
        self.wait("location.hash === '#case=cases/7'")
        self.wait_for_page("case")
        self.click("#pages [data-page=results]")
        self.wait_for_page("results")
        self.assertEqual(links(), ["#home=", "#case=cases/7", "#place=cases/7", "#pipeline=", "#results="])
        self.assertEqual(self.text("#present-case"), "cases/7")

    def test_keys_and_the_bar(self):
        """Keys lead from section to section and save; the theme's button says what it will do; the bar wraps."""
        self.show()
        at = lambda: self.js("return document.activeElement.getAttribute('aria-label')")
        seen = []
        for _ in range(5):
            self.browser.press("ArrowDown", "ArrowDown", 1)
            seen.append(at())
        self.assertEqual(seen, ["Cases", "Runs", "Comparisons", "Pipelines", "Cases"])
        self.browser.press("ArrowUp", "ArrowUp", 1)
        self.assertEqual(at(), "Pipelines")
        self.browser.press("s", "KeyS", 2)
        self.says("#notices", "nothing to save")
        for label in ("Dark", "Light"):
            self.assertEqual(self.text("#theme"), label)
            self.assertIsNone(self.the("#theme", "one.getAttribute('aria-label')"))
            self.click("#theme")
        self.assertEqual(self.text("#theme"), "Dark")
        self.show("case=cases/7", width_px=400, height_px=800)
        boxes = self.all("#pages a", "one.getBoundingClientRect().toJSON()")
        self.assertTrue(all(box["left"] >= 0 and box["right"] <= 400 for box in boxes), boxes)
        bottom = lambda part: self.the(part, "one.getBoundingClientRect().bottom")
        self.assertLessEqual(bottom("#pages"), bottom("#bar") + 1)


if __name__ == "__main__":
    main()
