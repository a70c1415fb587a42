#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the libraries in a report's page do there: its size and notices, axes that begin where the data begin, and the
layers of the graph.

    tests/tools/report/libraries_test.py     exit code 77: skipped, with the reason
"""
import re
import sys

from harness import synthetic
from harness.page import PageTest, bundle, page_without_data, run_tests


class LibrariesTest(PageTest):
    def test_the_script_is_small_and_names_the_libraries(self):
        page = page_without_data(bundle.THREE)
        script = re.search(r"<script>\n(.*)</script>", page, re.S)[1]
        self.assertLess(len(script.encode()), 900e3)
        for notice in ("2010-2021 Mike Bostock", "Chris Pettitt", "lodash", "three.js authors", "Permission is hereby"):
            self.assertIn(notice, script)

    def ticks(self, within):
        texts = self.texts(within + " .scale:first-of-type .tick text")
        return [float(text.replace("−", "-").replace("\u202f", "")) for text in texts]

    def test_axes_begin_where_the_data_begin(self):
        run = synthetic.run(with_cube=False)
        run["cells"][0]["convergence"] = [[20000 + 50 * i, 730 + 2**-i] for i in range(9)]
        self.browser.open(self.write("late", run))
        self.eventually(lambda: len(self.texts("#convergence .scale")), 2)
        ticks = self.ticks("#convergence")
        self.assertGreaterEqual(min(ticks), 19950, "a curve that starts late fills the plot")
        self.assertLessEqual(max(ticks), 20450)
        self.assertIn("20\u202f000", self.texts("#convergence .tick text"), "numbers as everywhere in the page")

    def test_ticks_have_no_more_digits_than_they_need(self):
        self.browser.open(self.comparison)
        self.eventually(lambda: bool(self.texts("#capture .tick text")), True)
        ticks = self.texts("#capture .tick text")
        self.assertIn("100 %", ticks)
        self.assertIn("20 %", ticks)
        self.assertEqual([tick for tick in ticks if "." in tick], [])

    def test_the_graph_has_layers(self):
        data = synthetic.run(with_cube=False)
        names = {"a": "", "b": "a", "c": "b", "d": "a c c"}
        data["graph"] = {
            "nodes": [{"id": name, "uses": "kind." + name, "options": {}, "differs": {}} for name in names],
            "edges": [
                {"from": source, "to": name, "port": "in%d" % i}
                for name, inputs in names.items()
                for i, source in enumerate(inputs.split())
            ],
        }
        self.browser.open(self.write("layers", data))
        boxes = self.browser.js(
            "return Object.fromEntries([...document.querySelectorAll('#graph .node')].map((node) =>"
            " [node.dataset.node, (({x, y, width, height}) => [x, y, width, height])(node.getBBox())]))"
        )
        tops = [boxes[name][1] for name in "abcd"]
        self.assertEqual(tops, sorted(tops))
        self.assertEqual(len(set(tops)), 4, "each below what it uses")
        lines = self.browser.js(
            "return Object.fromEntries([...document.querySelectorAll('#graph .edge')].map((line) =>"
            " [line.dataset.tip, Array.from({length: 200}, (_, i) => line.getPointAtLength(i / 199 *"
            " line.getTotalLength())).map(({x, y}) => [x, y])]))"
        )
        self.assertEqual(set(lines), {"a → b: in0", "b → c: in0", "c → d: in1, in2", "a → d: in0"})
        for name in "bc":
            x, y, width, height = boxes[name]
            crossed = [p for p in lines["a → d: in0"] if x < p[0] < x + width and y < p[1] < y + height]
            self.assertEqual(crossed, [], "the edge from a to d passes beside " + name)


if __name__ == "__main__":
    sys.exit(run_tests(sys.argv[1:]))
