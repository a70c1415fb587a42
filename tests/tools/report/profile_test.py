#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The profile of a run on its page, in headless Chromium.

    tests/tools/report/profile_test.py     exit code 77: skipped, with the reason
"""
import sys

from harness import synthetic
from harness.page import PageTest, run_tests

NAMES = [
    {"title": "pose", "kind": "node", "node": "pose"},
    {"title": "drr: radiograph", "kind": "function", "node": "drr"},
    {"title": "case", "kind": "cached", "node": "case"},
]
# [row, name, begin, length, processor time]: a node of 4 s with a call of 1 s and 500 very short ones in it.
BARS = [[0, 0, 1e6, 4e6, 3e6], [0, 1, 2e6, 1e6, 1e6]] + [[0, 1, 4e6 + 20 * i, 10, 10] for i in range(500)]
SUMS = [
    {"kind": "node", "node": "pose", "what": "", "calls": 1, "us": 4e6, "own_us": 2.995e6, "own_thread_us": 2e6},
    {"kind": "function", "node": "drr", "what": "radiograph", "calls": 501, "us": 1.005e6, "own_us": 1.005e6},
]


class ProfileTest(PageTest):
    def setUp(self):
        data = synthetic.comparison()
        data["kind"] = "run"
        for one in SUMS:
            one.setdefault("own_thread_us", one["own_us"])
            one["process_us"] = 1.5 * one["us"]
        data["profile"] = {
            "us": 6e6,
            "rows": ["thread 1", "main thread"],
            "names": NAMES,
            "bars": BARS + [[1, 2, 0, 1e6, 0]],
            "busy": [[0, {"thread 1": 1.0}], [3e6, {"thread 1": 0.5, "main thread": 1.0}]],
            "sums": SUMS,
            "left_out": 12,
        }
        self.browser.open(self.write("profile", data))
        self.eventually(lambda: len(self.texts("#profile .span-name")) > 0, True)

    def boxes(self):
        """[tip, x, y, width] of each bar."""
        found = self.browser.js(
            "return [...document.querySelectorAll('#profile .span')].map((bar) => [bar.dataset.tip,"
            " Number(bar.getAttribute('x')), Number(bar.getAttribute('y')), Number(bar.getAttribute('width'))])"
        )
        return {tip.replace("\u00a0", " "): at for tip, *at in found}

    def test_bars_lie_in_what_called_them(self):
        boxes = self.boxes()
        pose = boxes["pose\n4.00 s\nprocessor time of this thread 3.00 s"]
        call = boxes["drr: radiograph\n1.00 s\nprocessor time of this thread 1.00 s"]
        kept = boxes["case\n1.00 s, its result was kept\nprocessor time of this thread 0.000 s"]
        self.assertAlmostEqual(call[2] / pose[2], 1 / 4, delta=0.01, msg="a quarter of its time")
        self.assertAlmostEqual((call[0] - pose[0]) / pose[2], 1 / 4, delta=0.01, msg="it begins after a quarter")
        self.assertGreater(call[1], pose[1], "beneath it")
        self.assertLess(kept[1], pose[1], "the main thread is the first row")

    def test_very_short_bars_are_drawn_as_one(self):
        self.assertIn("500 short calls\nwithin 0.010 s", self.boxes())
        self.assertIn("12 short calls have no bar here; the table counts them.", self.texts("#profile .note"))

    def test_a_click_shows_its_time_alone(self):
        width = self.boxes()["pose\n4.00 s\nprocessor time of this thread 3.00 s"][2]
        self.browser.js(
            "[...document.querySelectorAll('#profile .span.function')].find((bar) => bar.dataset.tip.includes('1.00'))"
            ".dispatchEvent(new MouseEvent('click', {bubbles: true}))"
        )
        call = "drr: radiograph\n1.00 s\nprocessor time of this thread 1.00 s"
        self.eventually(lambda: self.boxes()[call][2] > width, True)
        self.press("Whole run", "#profile")
        self.eventually(lambda: self.boxes()[call][2] < width, True)

    def test_the_table_of_the_slowest_steps(self):
        rows = [text.replace("\u00a0", " ") for text in self.texts("#profile .slowest tbody tr td")]
        self.assertEqual(rows[:5], ["1", "3.00 s", "75 %", "2.00 s", "1.50"])
        self.assertEqual(rows[5:], ["501", "1.00 s", "25 %", "1.00 s", "1.50"])
        self.assertEqual(self.texts("#profile .slowest tbody th"), ["pose", "drr: radiograph"])


if __name__ == "__main__":
    sys.exit(run_tests())
