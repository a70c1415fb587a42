# SPDX-License-Identifier: Apache-2.0
"""What a comparison writes for other programs: tables that a spreadsheet does not compute, commands that a shell does
not misread; and how much there is to do, said of large experiments too."""
import base64
import csv
import json
import random
import resource
import shlex
import shutil
import subprocess

from compare_cases import HEAD, Compared
from harness import shapes
from harness.modules import modules
from harness.program import IS_SANITIZED, Case, SharedCase, main

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  m: {uses: test.constant, with: {value: 1, path: $case}}
  k: {uses: test.misbehave, in: {a: m}}
outputs: {number: k}
"""
WARNING = """marrow: 1
inputs: {case: {type: path}}
nodes:
  m: {uses: test.constant, with: {value: 1, path: $case}}
  w: {uses: test.warn}
  n: {uses: test.add, in: {a: m, b: w}}
outputs: {number: n}
"""
SIMULATION = """marrow: 1
inputs: {x: {type: number}, shape: {type: integer}}
nodes:
  c: {uses: test.constant, with: {value: $x, count: $shape}}
outputs: {case: c}
"""
DRAWN = "simulate: {pipeline: s.yaml, seeds: 1..%d, seed_input: [shape], draw: {x: [0, 1]}}"
WORDS = ["plain/a-b_c.yaml", "it's", "$(x)", "`x`", "a b", "a;b", "", "*", "~", "=ls", "new\nline", "\\", "é", "-x"]


def printed(command, **more):
    return subprocess.run(command, capture_output=True, text=True, **more).stdout


class Tables(Compared):
    pipeline, cases = PIPELINE, ("a",)

    def test_no_field_is_a_formula_and_no_terminal_obeys_it(self):
        cases = ["=1+1", "+1", "-x", "@SUM(A1)", 'a "quoted", one', "plain", "-5"]
        shutil.rmtree(self.scratch / "cases")
        for name in cases:
            self.add_case(name)
        variants = (
            '{"=cmd|x": {}, b: {m.word: two, m.value: -5}, broken: {k.how: error, k.text: "\\e[31mred\\nnext line"}}'
        )
        self.experiment("e", variants, HEAD.replace("[number.value]", "[number.twice, number.value]"))
        self.compare()
        text = self.read("out/cells.csv")
        rows = list(csv.reader(open(self.out / "cells.csv", newline="")))
        for field in (field for row in rows for field in row):
            if field[:1] in ("=", "+", "-", "@"):
                float(field)  # a number is none
        names = {row[2] for row in rows[1:]}
        self.assertEqual(names, {"'=1+1", "+1", "'-x", "'@SUM(A1)", 'a "quoted", one', "plain", "-5"})
        self.assertIn('"a ""quoted"", one"', text)
        self.assertEqual({row[rows[0].index("m.value")] for row in rows[1:]}, {"", "-5"})
        self.assertEqual({len(row) for row in rows}, {len(rows[0])})
        self.assertNotIn("\x1b", text)
        self.assertIn("\\x1b[31mred\nnext line", text)
        # Each figure is that of its name.
        row = self.rows()["'=cmd|x/plain/0"]
        self.assertEqual((row["number.twice"], row["number.value"]), ("4", "2"))

    def test_the_commands_of_a_report_are_quoted(self):
        file = self.experiment("it's $(touch hurt) ; x", "{one: {}}")
        out = self.scratch / "out `touch hurt` & y"
        self.expect(0, "compare", file.name, "--out", out)
        command = self.page_data(out / "report.html")["experiment"]["command"]
        self.assertEqual(shlex.split(command), ["marrow", "compare", file.name, "--out", str(out)])
        said = printed(["/bin/sh", "-c", command.replace("marrow compare", "printf '%s\\n'", 1)], cwd=self.scratch)
        self.assertEqual(said.splitlines(), [file.name, "--out", str(out)])
        run = self.scratch / "-run $x"
        self.expect(0, "run", "p.yaml", "case=cases/a", "--out", run)
        self.expect(0, "show", "--", run.name)
        command = self.page_data(run / "report.html")["experiment"]["command"]
        self.assertEqual(shlex.split(command), ["marrow", "rerun", "./-run $x"])
        self.assertFalse((self.scratch / "hurt").exists())

    def test_the_page_quotes_as_well(self):
        if not (shutil.which("node") and shutil.which("esbuild")):
            self.skipTest("needs node and esbuild")
        quoted = "%s.map((word) => [Dom.shellWord(word), Dom.shellPath(word)])" % json.dumps(WORDS)
        script = modules(Dom="report/page/dom.js") + "\nconsole.log(JSON.stringify(%s));" % quoted
        pairs = json.loads(printed(["node", "-e", script], check=True))
        shown = "; ".join("printf '%%s|%%s\\0' %s %s" % tuple(pair) for pair in pairs)
        said = printed(["/bin/sh", "-c", shown]).split("\0")
        for word, (quoted, _), text in zip(WORDS, pairs, said):
            self.assertEqual(text, "%s|%s" % (word, "./-x" if word == "-x" else word))
            self.assertEqual(quoted == word, word in ("plain/a-b_c.yaml", "-x"))

    def test_a_dry_run_of_many_cases(self):
        self.write("p.yaml", WARNING)
        self.write("s.yaml", SIMULATION)

        def said(count, lines):
            head = HEAD.replace("folders: [cases/*]", DRAWN % count).replace("timed_cells: 0\n", "")
            file = self.experiment("n%d" % count, "{a: {}, b: {m.value: 2}}", head)
            return self.printed("compare", file, "--dry-run").splitlines()[:lines]

        takes = "1 comparison with the baseline, for which a difference takes at least 6 cases"
        self.assertEqual(
            said(500, 4),
            [
                "1000 cells: 2 variants, 500 cases, 1 starts",
                takes,
                "500 cases to simulate",
                "3000 evaluations of nodes: 999 shared, 0 cached, 2001 to make",
            ],
        )
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assertEqual(
            said(100000, 5),
            [
                "200000 cells: 2 variants, 100000 cases, 1 starts",
                takes,
                "looked at: 500 cases and 1 starts, evenly spread; by them there are about",
                "100000 cases to simulate",
                "600000 evaluations of nodes: 199999 shared, 0 cached, 400001 to make",
            ],
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assertLess(after.ru_utime - before.ru_utime, 100, "seconds")  # once more than 200
        if not IS_SANITIZED:
            self.assertLess(after.ru_maxrss, max(before.ru_maxrss, 200000), "kilobytes")

    def test_a_fault_comes_before_anything_runs(self):
        self.write("e.yaml", HEAD + "variants:\n  good: {}\n  %s: {}\n" % ("n" * 260))
        told = self.compare(status=2).stderr
        self.assertIn("e.yaml:8:3: error: a variant's name becomes a file name", told)
        self.assertIn("it has 260 bytes", told)
        self.assertFalse(self.out.exists())

    def test_cells_that_are_none(self):
        self.add_case("b")
        file = self.experiment("e", "{one: {}, two: {}}")
        for name, fault in {
            "one": "write it as VARIANT/CASE/START, for example one/a/0",
            "tow/a/0": "there is no variant 'tow'; did you mean 'two'?",
            "one/c/0": "there is no case 'c'; did you mean 'a'?",
            "one/a/7": "there is no start '7'; did you mean '0'?",
            "one/a/0/0": "there is no start '0/0'; did you mean '0'?",
            "/": "write it as",
            "//": "there is no variant ''",
        }.items():
            self.refused("the experiment has no cell '%s': %s" % (name, fault), "cell", file, name, "--out", "out")


# The page of a comparison: which pictures it holds, and that the others are beside it.
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
