# SPDX-License-Identifier: Apache-2.0
"""What becomes of verdicts: in a run and its exit code, in its record, on its page, in a comparison."""
import json
import os
import pty
import subprocess

from diff_cases import Runs
from harness import BUILD, MARROW, TEST_PLUGINS
from harness.program import main

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
    def setUp(self):
        super().setUp()
        self.plugins = [TEST_PLUGINS, BUILD / "tests" / "verdict_plugins"]
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}

    def run_it(self, text, *arguments, code=0):
        result = self.marrow("run", self.write("p.yaml", text), "--out", "out", *arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout

    def record(self):
        return json.loads((self.scratch / "out" / "run.json").read_text())

    def test_a_trusted_pose_is_told_first(self):
        told = self.run_it(PIPELINE)
        self.assertTrue(
            told.startswith(
                "\nverdict: TRUSTED (failure 3.0 %)\n    the number is 3\n    it was given so\n\nnode             uses"
            ),
            told,
        )

    def test_of_a_doubtful_one_it_says_what_would_settle_it(self):
        told = self.run_it(BOTH)
        self.assertTrue(
            told.startswith(
                "\nverdict  a: TRUSTED (failure 10 %)\n    the number is 10\n    it was given so\n"
                "verdict  b: DOUBTFUL (failure 20 %)\n    the number is 20\n    it was given so\n"
                "    would settle it: a third view\n\nnode "
            ),
            told,
        )

    def test_a_wrong_one_makes_the_exit_code_3(self):
        self.assertIn("\nverdict: WRONG (failure 60 %)\n", self.run_it(PIPELINE, "--set", "c.value=60", code=3))
        self.assertEqual(self.record()["status"], "done")
        failed = PIPELINE.replace("outputs: {", "  f: {uses: test.fail_above, in: {a: c}}\noutputs: {f: f, ")
        result = self.marrow("run", self.write("p.yaml", failed), "--out", "failed", "--set", "c.value=60", "--quiet")
        self.assertEqual(result.returncode, 1, "a node failed, which is told first")

    def test_a_probability_that_is_not_known(self):
        told = self.run_it(PIPELINE, "--set", "c.value=-1")
        self.assertTrue(told.startswith("\nverdict: DOUBTFUL (failure not known)\n"), told)
        self.assertIsNone(self.record()["verdicts"][0]["failure_probability"])
        self.assertIn("failure_probability: .nan\n", (self.scratch / "out" / "outputs" / "verdict.yaml").read_text())

    def test_the_record_and_the_file(self):
        self.run_it(BOTH, "--quiet")
        self.assertEqual(
            self.record()["verdicts"],
            [
                {
                    "output": "verdict",
                    "item": item,
                    "judgement": judgement,
                    "failure_probability": number / 100,
                    "reasons": ["the number is %d" % number, "it was given so"],
                    "remedies": remedies,
                }
                for item, judgement, number, remedies in (
                    ("a", "trusted", 10, []),
                    ("b", "doubtful", 20, ["a third view"]),
                )
            ],
        )
        self.assertEqual(
            (self.scratch / "out" / "outputs" / "verdict" / "b.yaml").read_text(),
            "marrow-verdict: 1\njudgement: doubtful\nfailure_probability: 0.2\nreasons:\n"
            '  - "the number is 20"\n  - "it was given so"\nremedies:\n  - "a third view"\nfigures:\n'
            '  - {name: "number", value: 20, unit: "%"}\n',
        )

    def test_as_json(self):
        events = [
            json.loads(line) for line in self.run_it(PIPELINE, "--json", "--set", "c.value=60", code=3).split("\n")[:-1]
        ]
        self.assertEqual(
            [event for event in events if event["event"] == "verdict"],
            [dict(self.record()["verdicts"][0], event="verdict")],
        )
        self.assertEqual([event["event"] for event in events[-2:]], ["verdict", "ended"])

    def test_no_text_commands_the_terminal(self):
        told = self.run_it(PIPELINE, "--set", "c.value=6", "--set", 'v.remedy="\\e[2J"')
        self.assertIn("would settle it: \\x1b[2J\n", told)
        self.assertNotIn("\x1b", told)

    def test_a_terminal_shows_colours(self):
        self.write("p.yaml", PIPELINE)
        for value, colour in ((3, b"\x1b[32mTRUSTED"), (6, b"\x1b[33mDOUBTFUL"), (60, b"\x1b[31mWRONG")):
            main_end, other_end = pty.openpty()
            process = subprocess.Popen(
                [str(MARROW), "run", "p.yaml", "--out", "out%d" % value, "--set", "c.value=%d" % value],
                stdout=other_end,
                stderr=subprocess.DEVNULL,
                cwd=self.scratch,
                env=dict(os.environ, MARROW_PLUGIN_PATH=":".join(map(str, self.plugins)), **self.environment),
            )
            os.close(other_end)
            told = b""
            while True:
                try:
                    piece = os.read(main_end, 4096)
                except OSError:  # the program has ended
                    break
                told += piece
            os.close(main_end)
            self.assertEqual(process.wait(), 3 if value == 60 else 0)
            self.assertIn(b"verdict: " + colour + b"\x1b[0m (failure", told)

    def test_rerun_says_whether_it_is_the_same_and_not_whether_it_is_good(self):
        self.run_it(PIPELINE, "--set", "c.value=60", "--quiet", code=3)
        result = self.marrow("rerun", "out", "--quiet")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_the_difference_of_two_runs(self):
        self.run_into("a", PIPELINE, "--no-cache")
        self.run_into("b", PIPELINE, "--no-cache", "--set", "v.doubtful_above=1")
        told = self.diff(1, "a", "b")
        for line in ("it is doubtful, was trusted", "would settle it now: a third view", "1 other figure is the same"):
            self.assertIn(line, told)
        self.run_into("c", PIPELINE, "--no-cache", "--set", "c.value=4")
        told = self.diff(1, "a", "c")
        self.assertIn("probability of a failure: 4.0 %, was 3.0 %", told)
        self.assertIn("a reason now: the number is 4", told)
        self.assertIn("a reason before: the number is 3", told)

    def test_the_page_has_it(self):
        self.run_it(BOTH, "--quiet")
        self.assertEqual(self.marrow("show", "out").returncode, 0)
        shown = self.page_data()["cells"][0]["verdicts"]
        self.assertEqual(shown, self.record()["verdicts"])
        # What somebody else may have written there is not believed.
        record = self.record()
        record["verdicts"] = [
            7,
            {"item": "a"},
            dict(record["verdicts"][0], judgement="splendid"),
            record["verdicts"][1],
        ]
        (self.scratch / "out" / "run.json").write_text(json.dumps(record))
        self.assertEqual(self.marrow("show", "out").returncode, 0)
        shown = self.page_data()["cells"][0]["verdicts"]
        self.assertEqual([one["item"] for one in shown], ["b"])

    def test_a_comparison_counts_silent_failures_and_false_alarms(self):
        self.write("p.yaml", CELLS)
        for name in ("0", "1"):
            (self.scratch / "cases" / name).mkdir(parents=True)
        result = self.marrow("compare", self.write("e.yaml", EXPERIMENT), "--out", "c", "--quiet")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn(
            "\nVerdicts: misses that are trusted, of all misses; successes that are not, of all successes\n"
            "             cells  silent failures        caught  false alarms\n"
            "sound            2  -                           0  0/2 (0.0 to 65.8 %)\n"
            "silent           2  2/2 (34.2 to 100.0 %)       0  -\n"
            "caught           2  0/2 (0.0 to 65.8 %)         2  -\n"
            "false_alarm      2  -                           0  2/2 (34.2 to 100.0 %)\n",
            result.stdout,
        )
        rows = self.rows("c").values()
        self.assertEqual(
            {row["variant"]: (row["verdict"], row["failure_probability"]) for row in rows},
            {
                "sound": ("trusted", "0.03"),
                "silent": ("trusted", "0.03"),
                "caught": ("wrong", "0.6"),
                "false_alarm": ("doubtful", "0.06"),
            },
        )
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
        judged = {table["texts"][row[table["fields"].index("verdict")]] for row in table["rows"]}
        self.assertEqual(judged, {"trusted", "doubtful", "wrong"})

    def test_a_cell_with_a_wrong_pose_is_done(self):
        self.write("p.yaml", CELLS)
        (self.scratch / "cases" / "0").mkdir(parents=True)
        result = self.marrow("cell", self.write("e.yaml", EXPERIMENT), "caught/0/0", "--out", "c")
        self.assertEqual(result.returncode, 0, result.stderr)
        row = json.loads(result.stdout)
        self.assertEqual((row["verdict"], row["failure_probability"]), ("wrong", 0.6))

    def test_a_row_has_the_figures_of_its_verdicts(self):
        """Of one that is a single file, and of each of a list."""
        single, many = CELLS, BOTH.replace("nodes:", "inputs: {case: {type: path}}\nnodes:\n  c: {uses: test.constant}")
        (self.scratch / "cases" / "0").mkdir(parents=True)
        for number, (text, figures) in enumerate(
            (
                (single, {"verdict": {"number": 3}}),
                (
                    many.replace("{verdict: v}", "{error: e, verdict: v}").replace(
                        "  s: {", "  e: {uses: test.constant, with: {path: $case}}\n  s: {"
                    ),
                    {"verdict.a": {"number": 10}, "verdict.b": {"number": 20}},
                ),
            )
        ):
            self.write("p.yaml", text)
            out = "c%d" % number
            result = self.marrow("cell", self.write("e.yaml", EXPERIMENT), "sound/0/0", "--out", out)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            self.assertEqual(json.loads(result.stdout)["verdict_figures"], figures)
            kept = json.loads((self.scratch / out / "cells/sound/0/0/cell.json").read_text())
            self.assertEqual(kept["verdict_figures"], figures)

    def test_without_verdicts_nothing_is_said_of_them(self):
        self.write("p.yaml", CELLS.replace(", verdict: v", ""))
        (self.scratch / "cases" / "0").mkdir(parents=True)
        result = self.marrow("compare", self.write("e.yaml", EXPERIMENT), "--out", "c", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("Verdicts", result.stdout)
        self.assertNotIn("verdicts", self.answer("c")["variants"][0])
        row = next(iter(self.rows("c").values()))
        self.assertEqual((row["verdict"], row["failure_probability"]), ("", ""))


if __name__ == "__main__":
    main()
