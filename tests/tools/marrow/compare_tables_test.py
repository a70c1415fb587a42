# SPDX-License-Identifier: Apache-2.0
"""What a comparison writes for other programs: tables that a spreadsheet does not compute, commands that a shell does
not misread; and how much there is to do, said of large experiments too."""
import csv
import json
import resource
import shlex
import shutil
import subprocess

from harness.program import IS_SANITIZED, Case, main

from harness.modules import modules

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  m: {uses: test.constant, with: {value: 1, path: $case}}
  k: {uses: test.misbehave, in: {a: m}}
outputs: {number: k}
"""


class Tables(Case):
    def experiment(self, name, cases, rest):
        self.write("p.yaml", PIPELINE)
        for case in cases:
            (self.scratch / "cases" / case).mkdir(parents=True, exist_ok=True)
        return self.write(
            name,
            "experiment: 1\nname: e\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics:"
            " [number.value]\ntimed_cells: 0\n" + rest,
        )

    def test_no_field_is_a_formula(self):
        cases = ["=1+1", "+1", "-x", "@SUM(A1)", 'a "quoted", one', "plain", "-5"]
        file = self.experiment(
            "e.yaml", cases, "variants: {'=cmd|x': {}, b: {m.word: two, m.value: -5}, broken: {k.how: error}}\n"
        )
        result = self.marrow("compare", file, "--out", "out")
        self.assertEqual(result.returncode, 0, result.stderr)
        text = (self.scratch / "out" / "cells.csv").read_text()
        rows = list(csv.reader(text.splitlines()))
        for field in (field for row in rows for field in row):
            if field[:1] in ("=", "+", "-", "@"):
                float(field)  # a number is none
        names = {row[2] for row in rows[1:]}
        self.assertEqual(names, {"'=1+1", "+1", "'-x", "'@SUM(A1)", 'a "quoted", one', "plain", "-5"})
        self.assertIn('"a ""quoted"", one"', text)
        self.assertEqual({row[rows[0].index("m.value")] for row in rows[1:]}, {"", "-5"})
        self.assertEqual({len(row) for row in rows}, {len(rows[0])})

    def test_each_figure_is_that_of_its_name(self):
        file = self.experiment("e.yaml", ["a"], "variants: {a: {}}\n")
        file.write_text(file.read_text().replace("metrics: [number.value]", "metrics: [number.twice, number.value]"))
        self.assertEqual(self.marrow("compare", file, "--out", "out").returncode, 0)
        (row,) = self.rows().values()
        self.assertEqual((row["number.twice"], row["number.value"]), ("4", "2"))

    def test_no_terminal_obeys_a_field(self):
        file = self.experiment(
            "e.yaml", ["a"], 'variants: {a: {}, b: {k.how: error, k.text: "\\e[31mred\\nnext line"}}\n'
        )
        self.assertEqual(self.marrow("compare", file, "--out", "out").returncode, 0)
        text = (self.scratch / "out" / "cells.csv").read_text()
        self.assertNotIn("\x1b", text)
        self.assertIn("\\x1b[31mred\nnext line", text)

    def test_the_commands_of_a_report_are_quoted(self):
        file = self.experiment("it's $(touch hurt) ; x.yaml", ["a"], "variants: {one: {}}\n")
        out = self.scratch / "out `touch hurt` & y"
        self.assertEqual(self.marrow("compare", file.name, "--out", out).returncode, 0)
        command = self.page_data(out / "report.html")["experiment"]["command"]
        self.assertEqual(shlex.split(command), ["marrow", "compare", file.name, "--out", str(out)])
        said = subprocess.run(
            ["/bin/sh", "-c", command.replace("marrow compare", "printf '%s\\n'", 1)],
            capture_output=True,
            text=True,
            cwd=self.scratch,
        ).stdout
        self.assertEqual(said.splitlines(), [file.name, "--out", str(out)])
        run = self.scratch / "-run $x"
        self.assertEqual(self.marrow("run", "p.yaml", "case=cases/a", "--out", run).returncode, 0)
        self.assertEqual(self.marrow("show", "--", run.name).returncode, 0)
        self.assertEqual(
            shlex.split(self.page_data(run / "report.html")["experiment"]["command"]), ["marrow", "rerun", "./-run $x"]
        )
        self.assertFalse((self.scratch / "hurt").exists())

    def test_the_page_quotes_as_well(self):
        if not (shutil.which("node") and shutil.which("esbuild")):
            self.skipTest("needs node and esbuild")
        words = [
            "plain/a-b_c.yaml",
            "it's",
            "$(x)",
            "`x`",
            "a b",
            "a;b",
            "",
            "*",
            "~",
            "=ls",
            "new\nline",
            "\\",
            "\u00e9",
            "-x",
        ]
        quoted = "\nconsole.log(JSON.stringify(%s.map((w) => [Dom.shellWord(w), Dom.shellPath(w)])));" % json.dumps(
            words
        )
        script = modules(Dom="report/page/dom.js") + quoted
        pairs = json.loads(subprocess.run(["node", "-e", script], capture_output=True, text=True, check=True).stdout)
        for word, (quoted, path) in zip(words, pairs):
            said = subprocess.run(
                ["/bin/sh", "-c", "printf '%%s|' %s %s" % (quoted, path)], capture_output=True, text=True
            ).stdout
            self.assertEqual(said, "%s|%s|" % (word, "./-x" if word == "-x" else word))
            self.assertEqual(quoted == word, word in ("plain/a-b_c.yaml", "-x"))

    def test_a_dry_run_of_many_cases(self):
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  m: {uses: test.constant, with: {value: 1, path:"
                " $case}}\n  w: {uses: test.warn}\n  n: {uses: test.add, in: {a: m, b: w}}\noutputs: {number: n}\n"
            ),
        )
        self.write(
            "s.yaml",
            (
                "marrow: 1\ninputs: {x: {type: number}, shape: {type: integer}}\nnodes:\n  c: {uses: test.constant,"
                " with: {value: $x, count: $shape}}\noutputs: {case: c}\n"
            ),
        )
        head = "experiment: 1\npipeline: p.yaml\nmetrics: [number.value]\nvariants: {a: {}, b: {m.value: 2}}\n"
        cases = "cases: {simulate: {pipeline: s.yaml, seeds: 1..%d, seed_input: [shape], draw: {x: [0, 1]}}}\n"
        few = self.marrow("compare", self.write("few.yaml", head + cases % 500), "--dry-run")
        self.assertEqual(
            few.stdout.splitlines()[:4],
            [
                "1000 cells: 2 variants, 500 cases, 1 starts",
                "1 comparison with the baseline, for which a difference takes at least 6 cases",
                "500 cases to simulate",
                "3000 evaluations of nodes: 999 shared, 0 cached, 2001 to make",
            ],
        )
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        many = self.marrow("compare", self.write("many.yaml", head + cases % 100000), "--dry-run")
        self.assertEqual(
            many.stdout.splitlines()[:5],
            [
                "200000 cells: 2 variants, 100000 cases, 1 starts",
                "1 comparison with the baseline, for which a difference takes at least 6 cases",
                "looked at: 500 cases and 1 starts, evenly spread; by them there are about",
                "100000 cases to simulate",
                "600000 evaluations of nodes: 199999 shared, 0 cached, 400001 to make",
            ],
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assertLess(after.ru_utime - before.ru_utime, 100, "seconds")  # once more than 200
        if not IS_SANITIZED:
            self.assertLess(after.ru_maxrss, max(before.ru_maxrss, 200000), "kilobytes")

    def test_a_matrix_that_cannot_be_run(self):
        axes = "".join("  m.o%d: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]\n" % i for i in range(8))
        file = self.experiment("e.yaml", ["a"], "matrix:\n" + axes)
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        result = self.marrow("compare", file, "--dry-run")
        self.assertEqual(result.returncode, 2)
        self.assertIn(
            "e.yaml:7:1: error: the matrix makes 100000000 variants, at most 1000 can be compared", result.stderr
        )
        self.assertLess(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, 20)

    def test_a_name_that_is_too_long(self):
        file = self.experiment("e.yaml", ["a"], "variants:\n  good: {}\n  %s: {}\n" % ("n" * 260))
        result = self.marrow("compare", file, "--out", "out")
        self.assertEqual(result.returncode, 2)
        self.assertIn("e.yaml:9:3: error: a variant's name becomes a file name", result.stderr)
        self.assertIn("it has 260 bytes", result.stderr)
        self.assertFalse((self.scratch / "out").exists())

    def test_cells_that_are_none(self):
        file = self.experiment("e.yaml", ["a", "b"], "variants: {one: {}, two: {}}\n")
        for name, fault in {
            "one": "write it as VARIANT/CASE/START, for example one/a/0",
            "tow/a/0": "there is no variant 'tow'; did you mean 'two'?",
            "one/c/0": "there is no case 'c'; did you mean 'a'?",
            "one/a/7": "there is no start '7'; did you mean '0'?",
            "one/a/0/0": "there is no start '0/0'; did you mean '0'?",
            "/": "write it as",
            "//": "there is no variant ''",
        }.items():
            result = self.marrow("cell", file, name, "--out", "out")
            self.assertEqual(result.returncode, 2)
            self.assertIn("the experiment has no cell '%s': %s" % (name, fault), result.stderr)


if __name__ == "__main__":
    main()
