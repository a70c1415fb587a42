# SPDX-License-Identifier: Apache-2.0
"""The page of a comparison: which pictures it holds, and that the others are beside it."""
import base64
import json
import random
import shutil

from harness import shapes
from harness.program import Case, SharedCase, main

PICTURES = """marrow: 1
inputs: {case: {type: path}}
nodes:
  picture: {uses: read.image, with: {path: $case/picture.png}}
  m: {uses: test.constant}
outputs: {number: m, picture: picture}
"""
NUMBERS = """marrow: 1
nodes:
  drawn: {uses: test.draw}
  m: {uses: test.fail_above, in: {a: drawn}}
outputs: {number: m}
"""
EXPERIMENT = """experiment: 1
name: e
pipeline: p.yaml
cases: %s
metrics: [number.value]
pictures: [%s]
timed_cells: 0
variants: %s
"""


class Pages(Case):
    def compare(self, *arguments):
        self.expect(0, "compare", "e.yaml", "--out", "out", "--quiet", *arguments)
        return self.page_data()


class WithPictures(SharedCase, Pages):
    """Of four cases, under two variants: made once, and then only the page is."""

    def make(self):
        noise = random.Random(7)
        for case in "abcd":
            url = shapes.picture(200, 200, bytes(noise.randrange(256) for _ in range(40000)), 1)
            self.write("cases/%s/picture.png" % case, base64.b64decode(url.split(",")[1]))
        self.write("p.yaml", PICTURES)
        self.write("e.yaml", EXPERIMENT % ("{folders: [cases/*], input: case}", "picture", "{x: {}, y: {m.value: 2}}"))
        self.report = self.scratch / "out" / "report"

    def parts(self):
        return sorted(path.name for path in self.report.glob("*"))

    def test_all_fits(self):
        data = self.compare()
        self.assertEqual((data["parts"], len(data["materials"]), len(data["pictures"])), ([], 8, 4))
        self.assertFalse(self.report.exists())
        self.assertEqual(data["experiment"]["out"], "out")

    def test_nothing_fits_and_as_many_as_fit(self):
        data = self.compare("--page-mb", "0.001")
        self.assertEqual((data["materials"], data["pictures"]), ([], {}))
        self.assertEqual(sorted((part["case"], part["start"]) for part in data["parts"]), [(i, 0) for i in range(4)])
        self.assertEqual(self.parts(), sorted(part["file"] for part in data["parts"]))
        for part in data["parts"]:
            self.assertEqual(part["kinds"], ["pictures"])
            first, content, last = (self.report / part["file"]).read_text().splitlines()
            self.assertEqual((first, last), ('Parts.take("%s",' % part["file"], ");"))
            self.assertEqual(len(content), part["bytes"])
            content = json.loads(content)
            cells = [(cell["variant"], cell["case"], cell["start"]) for cell in content["materials"]]
            self.assertEqual(cells, [(0, part["case"], 0), (1, part["case"], 0)])
            named = {entry["picture"] for cell in content["materials"] for entry in cell["pictures"]}
            self.assertEqual(named, set(content["pictures"]))

        page = self.scratch / "out" / "report.html"
        limit = page.stat().st_size + 2.5 * data["parts"][0]["bytes"]
        notes = self.write("out/report/notes.txt", "mine")
        data = self.compare("--page-mb", str(limit / 1e6))
        self.assertLessEqual(page.stat().st_size, limit)
        inside = {cell["case"] for cell in data["materials"]}
        self.assertEqual((len(inside), {part["case"] for part in data["parts"]}), (2, set(range(4)) - inside))
        others = [name for name in self.parts() if name != notes.name]
        self.assertEqual(others, sorted(part["file"] for part in data["parts"]), "those of an earlier page go")
        self.compare()
        self.assertEqual(self.parts(), [notes.name])
        shutil.rmtree(self.report)

    def test_pictures_of_a_cell_that_has_none(self):
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        data = self.compare("--shown", "0")
        self.assertEqual((data["materials"], data["parts"], data["pictures"]), ([], [], {}))
        # The commands that the page gives for such a cell.
        self.expect(0, "cell", data["experiment"]["file"], "--out", data["experiment"]["out"], "y/b/0")
        self.expect(0, "show", data["experiment"]["folder"] + "/pictures/y/b/0")
        self.assertEqual(len(self.page_data("out/pictures/y/b/0/report.html")["pictures"]), 1)


class Shown(Pages):
    def test_worst_median_failed_and_best_are_shown(self):
        self.write("p.yaml", NUMBERS)
        self.write("e.yaml", EXPERIMENT % ("{seeds: 1..9}", "", "{x: {m.value: 1000003}}"))
        self.compare()
        values = sorted((float(row["number.value"]), number) for number, row in enumerate(self.rows().values()))
        limit = (values[6][0] + values[7][0]) / 2
        variants = "{x: {m.value: %r}, y: {m.value: %r}}" % (limit, values[-1][0] + 1)
        self.write("e.yaml", EXPERIMENT % ("{seeds: 1..9}", "", variants))
        failed = min((7, 8), key=lambda rank: values[rank][1])  # the first one in x
        for most, wanted in (("1", [6]), ("2", [6, 3]), ("3", [6, 3, failed]), ("4", [6, 3, failed, 0])):
            data = self.compare("--shown", most)
            shown = list(dict.fromkeys(cell["case"] for cell in data["materials"]))
            ranks = [next(rank for rank, value in enumerate(values) if value[1] == case) for case in shown]
            self.assertEqual(ranks, wanted)


if __name__ == "__main__":
    main()
