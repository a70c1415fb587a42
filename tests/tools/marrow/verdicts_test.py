# SPDX-License-Identifier: Apache-2.0
"""What becomes of verdicts: in a run and its exit code, in its record, on its page, in a comparison."""
import json
import os

from diff_cases import Runs
from harness import BUILD, MARROW, TEST_PLUGINS
from harness.program import main
from harness.terminal import Terminal

PIPELINE = """marrow: 1
nodes:
  c: {uses: test.constant, with: {value: 3}}
  v: {uses: test.verdict, in: {percent: c}}
outputs: {c: c, verdict: v}
"""
BOTH = """marrow: 1
nodes:
  s: {uses: test.sides}
  v: {uses: test.verdict, in: {percent: s.both}, with: {doubtful_above: 15}}
outputs: {verdict: v}
"""
CELLS = """marrow: 1
inputs: {case: {type: path}}
nodes:
  c: {uses: test.constant, with: {value: 3}}
  e: {uses: test.constant, with: {value: 1, path: $case}}
  v: {uses: test.verdict, in: {percent: c}}
outputs: {error: e, verdict: v}
"""
EXPERIMENT = """experiment: 1
pipeline: p.yaml
cases: {folders: [cases/*]}
variants:
  sound: {}
  silent: {e.value: 9}
  caught: {e.value: 9, c.value: 60}
  false_alarm: {c.value: 6}
metrics: [error.value]
success: {error.value: 2}
timed_cells: 0
"""


class Verdicts(Runs):
    has_own_store = True

    def setUp(self):
        super().setUp()
        self.plugins = [TEST_PLUGINS, BUILD / "tests" / "verdict_plugins"]

    def run_it(self, text, *arguments, code=0, out="out"):
        return self.expect(code, "run", self.write("p.yaml", text), "--out", out, *arguments).stdout

    def recorded(self, out="out"):
        return self.json(out + "/run.json")["verdicts"]

    def experiment(self, *cases, pipeline=CELLS):
        self.write("p.yaml", pipeline)
        self.write("e.yaml", EXPERIMENT)
        for case in cases:
            (self.scratch / "cases" / case).mkdir(parents=True, exist_ok=True)

    def test_it_is_told_first_and_a_wrong_one_makes_the_exit_code_3(self):
        said = "    the number is %d\n    it was given so\n"
        third = "    would settle it: a third view\n"
        for number, (text, arguments, code, told) in enumerate(
            (
                (PIPELINE, [], 0, "verdict: TRUSTED (failure 3.0 %)\n" + said % 3 + "\nnode             uses"),
                (
                    *(BOTH, [], 0),
                    "verdict  a: TRUSTED (failure 10 %)\n"
                    + said % 10
                    + "verdict  b: DOUBTFUL (failure 20 %)\n"
                    + said % 20
                    + third
                    + "\nnode ",
                ),
                (PIPELINE, ["c.value=60"], 3, "verdict: WRONG (failure 60 %)\n"),
                (PIPELINE, ["c.value=-1"], 0, "verdict: DOUBTFUL (failure not known)\n"),
                (PIPELINE, ["c.value=6", 'v.remedy="\\e[2J"'], 0, "verdict: DOUBTFUL (failure 6.0 %)\n"),
            )
        ):
            with self.subTest(told):
                sets = [word for argument in arguments for word in ("--set", argument)]
                printed = self.run_it(text, *sets, code=code, out="out%d" % number)
                self.assertTrue(printed.startswith("\n" + told), printed)
        self.assertIn("would settle it: \\x1b[2J\n", printed, "no text commands the terminal")
        self.assertNotIn("\x1b", printed)
        self.assertEqual(self.json("out2/run.json")["status"], "done")
        self.expect(0, "rerun", "out2", "--quiet")  # it says whether it is the same, and not whether it is good
        self.assertIsNone(self.recorded("out3")[0]["failure_probability"])
        self.assertIn("failure_probability: .nan\n", self.read("out3/outputs/verdict.yaml"))
        failed = PIPELINE.replace("outputs: {", "  f: {uses: test.fail_above, in: {a: c}}\noutputs: {f: f, ")
        # A node failed, which is told first.
        self.run_it(failed, "--set", "c.value=60", "--quiet", code=1, out="failed")

    def test_the_record_the_file_and_the_page(self):
        self.run_it(BOTH, "--quiet")
        recorded = [
            {
                **{"output": "verdict", "item": item, "judgement": judgement, "failure_probability": number / 100},
                **{"reasons": ["the number is %d" % number, "it was given so"], "remedies": remedies},
            }
            for item, judgement, number, remedies in (("a", "trusted", 10, []), ("b", "doubtful", 20, ["a third view"]))
        ]
        self.assertEqual(self.recorded(), recorded)
        self.assertEqual(
            self.read("out/outputs/verdict/b.yaml"),
            "marrow-verdict: 1\njudgement: doubtful\nfailure_probability: 0.2\nreasons:\n"
            '  - "the number is 20"\n  - "it was given so"\nremedies:\n  - "a third view"\nfigures:\n'
            '  - {name: "number", value: 20, unit: "%"}\n',
        )
        # What somebody else may have written there is not believed.
        odd = [7, {"item": "a"}, dict(recorded[0], judgement="splendid"), recorded[1]]
        for written, believed in ((recorded, recorded), (odd, recorded[1:])):
            self.write("out/run.json", json.dumps({**self.json("out/run.json"), "verdicts": written}))
            self.expect(0, "show", "out")
            self.assertEqual(self.page_data()["cells"][0]["verdicts"], believed)

    def test_as_json(self):
        told = self.run_it(PIPELINE, "--json", "--set", "c.value=60", code=3)
        events = [json.loads(line) for line in told.splitlines()]
        verdicts = [event for event in events if event["event"] == "verdict"]
        self.assertEqual(verdicts, [dict(self.recorded()[0], event="verdict")])
        self.assertEqual([event["event"] for event in events[-2:]], ["verdict", "ended"])

    def test_a_terminal_shows_colours(self):
        self.write("p.yaml", PIPELINE)
        plugins = ":".join(map(str, self.plugins))
        environment = {**os.environ, "MARROW_PLUGIN_PATH": plugins, **self.variables()}
        for value, colour in ((3, "\x1b[32mTRUSTED"), (6, "\x1b[33mDOUBTFUL"), (60, "\x1b[31mWRONG")):
            command = [MARROW, "run", "p.yaml", "--out", "out%d" % value, "--set", "c.value=%d" % value]
            with Terminal(command, cwd=self.scratch, environment=environment) as terminal:
                told = terminal.to_the_end()
                self.assertEqual(terminal.process.returncode, 3 if value == 60 else 0)
            self.assertIn("verdict: " + colour + "\x1b[0m (failure", told)

    def test_the_difference_of_two_runs(self):
        self.run_into("a", PIPELINE, "--no-cache")
        for name, change, lines in (
            (
                *("b", "v.doubtful_above=1"),
                ("it is doubtful, was trusted", "would settle it now: a third view", "1 other figure is the same"),
            ),
            (
                *("c", "c.value=4"),
                (
                    "probability of a failure: 4.0 %, was 3.0 %",
                    "a reason now: the number is 4",
                    "a reason before: the number is 3",
                ),
            ),
        ):
            self.run_into(name, PIPELINE, "--no-cache", "--set", change)
            told = self.diff(1, "a", name)
            for line in lines:
                self.assertIn(line, told)

    def test_a_comparison_counts_silent_failures_and_false_alarms(self):
        self.experiment("0", "1")
        self.assertIn(
            "\nVerdicts: misses that are trusted, of all misses; successes that are not, of all successes\n"
            "             cells  silent failures        caught  false alarms\n"
            "sound            2  -                           0  0/2 (0.0 to 65.8 %)\n"
            "silent           2  2/2 (34.2 to 100.0 %)       0  -\n"
            "caught           2  0/2 (0.0 to 65.8 %)         2  -\n"
            "false_alarm      2  -                           0  2/2 (34.2 to 100.0 %)\n",
            self.printed("compare", "e.yaml", "--out", "c", "--quiet"),
        )
        judged = {"sound": ("trusted", "0.03"), "silent": ("trusted", "0.03"), "caught": ("wrong", "0.6")}
        judged["false_alarm"] = ("doubtful", "0.06")
        rows = self.rows("c").values()
        self.assertEqual({row["variant"]: (row["verdict"], row["failure_probability"]) for row in rows}, judged)
        variants = self.answer("c")["variants"]
        silent = variants[1]["verdicts"]
        self.assertEqual((silent["cells"], silent["caught"]), (2, 0))
        self.assertEqual({key: silent["silent_failures"][key] for key in ("count", "of")}, {"count": 2, "of": 2})
        self.assertAlmostEqual(silent["silent_failures"]["low"], 0.3424, 4)
        self.assertEqual(silent["false_alarms"], {"count": 0, "of": 0, "rate": None, "low": None, "high": None})
        self.assertEqual(variants[3]["verdicts"]["false_alarms"]["count"], 2)
        data = self.page_data("c/report.html")
        self.assertEqual(data["summary"][1]["verdicts"], silent)
        table = data["cell_table"]
        shown = {table["texts"][row[table["fields"].index("verdict")]] for row in table["rows"]}
        self.assertEqual(shown, {"trusted", "doubtful", "wrong"})

    def cell(self, name, out):
        return json.loads(self.printed("cell", "e.yaml", name, "--out", out))

    def test_a_cell_with_a_wrong_pose_is_done_and_has_the_figures_of_its_verdicts(self):
        """Of one that is a single file, and of each of a list."""
        self.experiment("0")
        row = self.cell("caught/0/0", "c")
        self.assertEqual((row["verdict"], row["failure_probability"]), ("wrong", 0.6))
        many = BOTH.replace("nodes:", "inputs: {case: {type: path}}\nnodes:\n  c: {uses: test.constant}")
        many = many.replace("  s: {", "  e: {uses: test.constant, with: {path: $case}}\n  s: {")
        many = many.replace("{verdict: v}", "{error: e, verdict: v}")
        for out, pipeline, figures in (
            ("single", CELLS, {"verdict": {"number": 3}}),
            ("many", many, {"verdict.a": {"number": 10}, "verdict.b": {"number": 20}}),
        ):
            self.experiment("0", pipeline=pipeline)
            self.assertEqual(self.cell("sound/0/0", out)["verdict_figures"], figures)
            self.assertEqual(self.json(out + "/cells/sound/0/0/cell.json")["verdict_figures"], figures)

    def test_without_verdicts_nothing_is_said_of_them(self):
        self.experiment("0", pipeline=CELLS.replace(", verdict: v", ""))
        self.assertNotIn("Verdicts", self.printed("compare", "e.yaml", "--out", "c", "--quiet"))
        self.assertNotIn("verdicts", self.answer("c")["variants"][0])
        row = next(iter(self.rows("c").values()))
        self.assertEqual((row["verdict"], row["failure_probability"]), ("", ""))


if __name__ == "__main__":
    main()
