# SPDX-License-Identifier: Apache-2.0
"""What a comparison writes for other programs: tables that a spreadsheet does not compute, commands that a shell does
not misread; and how much there is to do, said of large experiments too."""
import csv
import json
import resource
import shlex
import shutil
import subprocess

from compare_cases import HEAD, Compared
from harness.modules import modules
from harness.program import IS_SANITIZED, main

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

    def test_experiments_that_cannot_be_run(self):
        axes = "".join("  m.o%d: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]\n" % i for i in range(8))
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        self.write("e.yaml", HEAD + "matrix:\n" + axes)
        told = self.expect(2, "compare", "e.yaml", "--dry-run").stderr
        self.assertIn("e.yaml:6:1: error: the matrix makes 100000000 variants, at most 1000 can be compared", told)
        self.assertLess(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, 20)
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


if __name__ == "__main__":
    main()
