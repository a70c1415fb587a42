#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The words of a report have the meanings of docs/glossary.md: each head of a table, each judgement and outcome, and
what a verdict says. They are shown to those who point at them, and to those who go there by the Tab key."""
import re
import sys

from harness import SOURCE, synthetic, synthetic_verdicts
from harness.modules import modules
from harness.page import PageTest, run_tests

# What a word and its meaning are in the page: the word without its unit, and the box that says more.
HEADS = """return [...document.querySelectorAll(arguments[0] + ' thead th')].map((head) => {
  const title = head.querySelector('button').firstChild.textContent;
  return [title, head.dataset.tip || null];
})"""
POINT = """const word = document.querySelector(arguments[0]), box = word.getBoundingClientRect();
word.dispatchEvent(new PointerEvent('pointermove', {clientX: box.x + 2, clientY: box.y + 2, bubbles: true}));
const tip = document.getElementById('tooltip');
return tip.hidden ? null : tip.textContent"""


def glossary():
    """{name in small letters: meaning} of the document."""
    text = (SOURCE / "docs" / "glossary.md").read_text()
    found = {}
    for item in re.findall(r"^- (\*\*(?:.|\n)*?)(?=\n- |\n\n|\Z)", text, re.M):
        names, meaning = re.fullmatch(r"(\*\*.+?\*\*): (.+)", " ".join(item.split())).groups()
        for name in re.findall(r"\*\*(.+?)\*\*", names):
            assert name.lower() not in found, name + " is explained twice"
            found[name.lower()] = meaning
    return found


class GlossaryTest(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.entries = glossary()
        data = synthetic.comparison()
        synthetic_verdicts.add_verdicts(data)
        cls.judged = cls.write("judged", data)
        cls.metrics = [metric["label"] for metric in data["metrics"]]

    def test_every_head_of_a_table_is_explained(self):
        self.browser.open(self.judged)
        count = 0
        for place in ("#summary", "#paired", "#cells"):
            for title, tip in self.browser.js(HEADS, place):
                if title in self.metrics and title.lower() not in self.entries:
                    continue  # an experiment names its figures as it likes
                count += 1
                self.assertEqual(tip, self.entries.get(title.lower()), title)
                self.assertIsNotNone(tip, title + ": docs/glossary.md does not explain it")
        self.assertGreater(count, 25)

    def test_judgements_and_outcomes_are_explained(self):
        self.browser.open(self.judged)
        shown = self.browser.js(
            "return [...document.querySelectorAll('#cells .outcome')].map((item) => [item.textContent,"
            " item.dataset.tip])"
        )
        self.assertTrue({"trusted", "doubtful", "wrong"} & {word for word, _ in shown}, shown)
        for word, tip in shown:
            self.assertEqual(tip, self.entries[word], word)

    def test_a_verdict_says_what_its_words_mean(self):
        data = synthetic.run()
        cell = data["cells"][0]
        cell["verdicts"] = []
        synthetic_verdicts.add_verdict(cell, "doubtful")
        cell["verdicts"][0]["reasons"].append("a random pose nearby explains the images 0.72 times as well")
        self.browser.open(self.write("doubtful", data))
        terms = self.browser.js(
            "return [...document.querySelectorAll('#verdict .term')].map((item) => [item.textContent,"
            " item.dataset.tip, item.tabIndex])"
        )
        words = {word: (tip, place) for word, tip, place in terms}
        for word in ("doubtful", "long axis", "random pose nearby", "times as well"):
            self.assertEqual(words[word], (self.entries[word], 0), word)
        reasons = self.texts("#verdict .verdict-list li")
        self.assertIn("a random pose nearby explains the images 0.72 times as well", reasons)

    def test_the_meaning_is_shown_where_one_points(self):
        self.browser.open(self.judged)
        self.browser.show("capture")
        self.assertEqual(self.browser.js(POINT, "#capture h2 .term"), self.entries["capture range"])

    def test_the_figures_of_a_run_are_explained(self):
        data = synthetic.run()
        names = ["rotation_deg", "mtre_mm", "matched_percent", "unheard_of_mm", "frontal_median_px"]
        rows = [{"name": name, "unit": "", "values": [1]} for name in names]
        data["figures"] = [{"name": "errors", "columns": ["final"], "rows": rows}]
        self.browser.open(self.write("figures", data))
        tips = self.browser.js(
            "return [...document.querySelectorAll('table.figures tbody th')].map((head) =>"
            " [head.textContent, (head.querySelector('.term') || {dataset: {}}).dataset.tip || null])"
        )
        wanted = [self.entries["rotation"], self.entries["mtre"], self.entries["matched"], None]
        wanted.append("In “frontal” alone: " + self.entries["median"])
        self.assertEqual(tips, [list(pair) for pair in zip(names, wanted)])

    def test_every_entry_is_found_by_its_name(self):
        script = modules(Glossary="report/page/glossary.js")
        found = self.browser.js(script + "return arguments[0].map(Glossary.meaning)", list(self.entries))
        self.assertEqual(dict(zip(self.entries, found)), self.entries)


if __name__ == "__main__":
    sys.exit(run_tests())
