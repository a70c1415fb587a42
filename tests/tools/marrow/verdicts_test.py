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


# A node that may fail: what a person is told, and what a run, a plan, a page and a comparison make of it.
PIPELINE_OF_FAIL = """marrow: 1
nodes:
  c: {uses: test.constant, with: {value: 5}}
  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}, may_fail: true}
  d: {uses: test.add, in: {a: c, b: f}}
outputs: {d: d, f: f}
"""
CELLS_OF_FAIL = """marrow: 1
inputs: {case: {type: path}}
nodes:
  c: {uses: test.work, with: {value: 0, path: $case}}
  m: {uses: test.misbehave, in: {a: c}, may_fail: true}
  d: {uses: test.add, in: {a: c, b: m}}
outputs: {m: m, d: d}
"""
EXPERIMENT_OF_FAIL = """experiment: 1
pipeline: p.yaml
cases: {folders: [cases/*]}
metrics: [m.value, d.value]
success: {m.value: 10}
timed_cells: 0
variants: {a: {}, b: {m.how: error}, strict: {m.how: error, m.may_fail: false}}
"""
FAILED = "node 'f' (test.fail_above) failed: the number is too large; give a smaller one"
GOES_ON = FAILED + " (its inputs: a = c); the run goes on without it"


class MayFail(Runs):
    has_own_store = True
    files = {"p.yaml": PIPELINE_OF_FAIL}

    def run_it(self, *arguments, code=0):
        return self.expect(code, "run", "p.yaml", "--no-cache", *arguments)

    def test_the_run_warns_and_ends_well(self):
        result = self.run_it("--out", "out")
        self.assertIn("marrow: warning: " + GOES_ON, result.stderr)
        self.assertRegex(result.stdout, r"\nf +test\.fail_above +\d+\.\d+ +1  failed alone\n")
        self.assertIn("\n  outputs/d.json\n  f: not there because node 'f' failed\n", result.stdout)
        self.assertRegex(self.read("out/log.txt"), r"\[warning\] node 'f' \(test\.fail_above\) failed: ")
        self.assertEqual(sorted(path.name for path in (self.scratch / "out/outputs").iterdir()), ["d.json"])
        self.assertEqual(self.json("out/run.json")["status"], "done")
        self.assertEqual(
            [(node["status"], node.get("reason")) for node in self.nodes().values()],
            [("done", None), ("failed alone", "the number is too large; give a smaller one"), ("done", None)],
        )
        self.expect(0, "show", "out")
        cell = self.page_data()["cells"][0]
        self.assertEqual((cell["status"], cell["absent"]), ("done", FAILED))

    def events(self, *arguments, code=0):
        """The failures, and the end."""
        events = [json.loads(line) for line in self.run_it("--json", *arguments, code=code).stdout.splitlines()]
        return [event for event in events if event["event"] == "failed"], events[-1]

    def test_as_json(self):
        failed, end = self.events("--out", "out")
        self.assertEqual(failed, [{"event": "failed", "node": "f", "level": "warning", "text": GOES_ON}])
        self.assertEqual((end["status"], end["absent"]), ("done", {"f": "node 'f' failed"}))
        failed, end = self.events("--out", "bad", "--set", "f.may_fail=false", code=1)
        self.assertEqual([event["level"] for event in failed], ["error"])
        self.assertEqual((end["status"], end["absent"]), ("failed", {}))

    def test_of_a_list_the_rest_is_there(self):
        self.write(
            "p.yaml",
            "marrow: 1\nnodes:\n  s: {uses: test.sides}\n"
            "  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 15}, may_fail: true}\noutputs: {f: f}\n",
        )
        told = self.run_it("--out", "out").stdout
        self.assertIn("\n  outputs/f/a.json\n  f: not there as a whole because node 'f' failed\n", told)

    def test_who_needs_it_is_refused_before_anything_runs(self):
        self.write("p.yaml", PIPELINE_OF_FAIL.replace("{a: c, b: f}", "{a: f}"))
        said = "p.yaml:5:28: error: node 'd' needs input 'a', but node 'f' may fail\n"
        self.refused(said, "check", "p.yaml")
        self.expect(0, "check", "p.yaml", "--set", "d.may_fail=true")

    def test_only_nodes_that_can_do_without_it_fit(self):
        fits = lambda file: {fit["node"]: fit for fit in self.json_of("list", "--fits", file, "d")}
        self.assertEqual(fits("p.yaml")["test.fail_above"]["fits"], "yes", "it has no input b")
        items = PIPELINE_OF_FAIL.replace("{a: c, b: f}", "{items: f, a: c}").replace("test.add", "test.any")
        one = fits(self.write("q.yaml", items))["test.sum"]
        self.assertEqual(one["fits"], "no")
        self.assertIn("node 'd' needs input 'items', but node 'f' may fail", one["faults"])

    def test_the_graph_says_which_may(self):
        self.assertIn("f  (test.fail_above)  [may fail]\n", self.printed("graph", "p.yaml"))
        self.assertIn('label="f\\ntest.fail_above\\nmay fail"', self.printed("graph", "p.yaml", "--dot"))

    def test_the_plan(self):
        self.run_into("out", PIPELINE_OF_FAIL)
        told = self.printed("plan", "p.yaml")
        self.assertRegex(told, r"\nf +test\.fail_above +runs: the store has no result of it: it failed, ")
        self.assertRegex(told, r"\nd +test\.add +runs unless 'f' comes out unchanged\n")
        self.assertIn("1 cached, 1 to run, 1 that may run", told)
        self.assertRegex(self.printed("run", "p.yaml", "--out", "again"), r"\nd +test\.add .* cached \(took")

    def test_the_same_again(self):
        self.run_it("--out", "a")
        self.assertIn(
            "identical: all 3 nodes came out the same\nnode 'f' failed alone in both: the number is too large; give a "
            "smaller one\n",
            self.printed("rerun", "a", "--out", "b", "--quiet"),
        )
        text = self.read("a/pipeline.yaml")
        self.assertIn("may_fail: true", text)
        self.assertEqual(self.read("b/pipeline.yaml"), text)
        self.run_it("--out", "c", "--set", "f.value=9")
        self.assertIn(
            "  in the first run it failed alone: the number is too large; give a smaller one\n"
            "  in the second run it was done\n",
            self.diff(1, "a", "c"),
        )

    def test_a_comparison_has_an_empty_figure(self):
        self.write("p.yaml", CELLS_OF_FAIL)
        self.write("e.yaml", EXPERIMENT_OF_FAIL)
        for case in "01":
            self.write("cases/%s/data" % case, case)
        compare = ["compare", "e.yaml", "--out", "out"]
        why = "'m.value' is not there because node 'm' failed"
        self.assertIn(
            "\ncells in which a node failed that may fail\n  b/0/0: %s\n  b/1/0: %s\n" % (why, why),
            self.printed(*compare),
        )
        rows = self.rows()
        shown = [rows["b/0/0"][name] for name in ("status", "reason", "success", "m.value", "d.value")]
        self.assertEqual(shown, ["done", why, "0", "", "0"])
        self.assertEqual(rows["a/0/0"]["d.value"], "1")
        self.assertEqual(rows["strict/0/0"]["status"], "failed")
        table = self.page_data()["cell_table"]
        row = dict(zip(table["fields"], table["rows"][4]))  # of case 1, variant b
        self.assertEqual((row["variant"], row["case"], row["start"], table["texts"][row["absent"]]), (1, 1, 0, why))
        self.assertIn("4 were there already", self.printed(*compare))
        self.expect(0, "cell", "e.yaml", "b/0/0", "--out", "out")


if __name__ == "__main__":
    main()
