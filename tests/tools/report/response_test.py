#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The response curves of a sweep on the report's page, in headless Chromium: curves, bands, and the choice of both.

    tests/tools/report/response_test.py     exit code 77: skipped, with the reason
"""
import re
import sys

from harness import synthetic
from harness.page import PageTest, run_tests


def curve(variant, option, figure, scale="linear"):
    """Five points, of which the last has no runs and the one before has no interval."""
    points = [{"value": 10 + 10 * i, "runs": 8, "of": 8, "middle": i, "low": i - 1, "high": i + 1} for i in range(3)]
    points += [{"value": 40, "runs": 2, "of": 8, "middle": 3}, {"value": 50, "runs": 0, "of": 8}]
    return {"variant": variant, "option": option, "figure": figure, "scale": scale, "points": points}


class ResponseTest(PageTest):
    def page(self, variants):
        data = synthetic.comparison()
        figure = data["metrics"][0]["name"]
        data["curves"] = [
            curve(variant, option, name, "log" if option == "edges.low" else "linear")
            for variant in variants
            for option in ("edges.high", "edges.low")
            for name in (figure, "success")
        ]
        self.browser.open(self.write("response", data))

    def test_curves_have_bands(self):
        self.page(["canny", "sobel"])
        self.eventually(lambda: len(self.texts("#response path.band")), 2)
        self.assertEqual(len(self.texts("#response path.line")), 2)
        self.assertEqual(self.texts("#response .legend li"), ["canny", "sobel"])
        corners = lambda one: len(re.findall("[ML]", self.browser.js("return %s.getAttribute('d')" % one)))
        band, line = "document.querySelector('#response path.band')", "document.querySelector('#response path.line')"
        self.assertEqual(corners(band), 6, "only points with an interval have a band")
        self.assertEqual(corners(line), 4)

    def test_option_and_figure_are_chosen(self):
        self.page([""])
        title = lambda: self.texts("#response .title")
        self.eventually(lambda: title()[:1], ["edges.high"])
        self.choose("Option", "edges.low", "#response")
        self.eventually(lambda: title()[:1], ["edges.low"])
        self.choose("Figure", "success", "#response")
        self.eventually(lambda: title()[1:], ["success rate"])
        self.assertEqual(self.texts("#response .legend li"), [], "one curve needs no legend")

    def test_without_a_sweep_there_is_no_section(self):
        self.browser.open(self.comparison)
        self.assertEqual(self.texts("#response"), [])


if __name__ == "__main__":
    sys.exit(run_tests())
