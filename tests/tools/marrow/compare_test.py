# SPDX-License-Identifier: Apache-2.0
"""Comparisons as a person runs them: a fault in one cell stays there, and an interrupted comparison can continue."""
import json
import os
import random
import shutil
import signal
import subprocess
import time

from harness import MARROW, TEST_PLUGINS
from harness.program import IS_SANITIZED, Case, main, marrow

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  shared: {uses: test.work, with: {value: 0.05, path: $case}}
  m: {uses: test.misbehave, in: {a: shared}}
outputs: {number: m}
"""
HEAD = """experiment: 1
pipeline: p.yaml
cases: {folders: [cases/*]}
metrics: [number.value]
success: {number.value: 10}
"""


class Compare(Case):
    def experiment(self, variants, cases=3):
        self.write("p.yaml", PIPELINE)
        for i in range(cases):
            (self.scratch / "cases" / str(i)).mkdir(parents=True)
            self.write("cases/%d/data" % i, "case %d" % i)
        return self.write("e.yaml", HEAD + "variants:\n" + "".join("  %s: %s\n" % item for item in variants.items()))

    def compare(self, *arguments, cache="cache", **more):
        environment = {"MARROW_CACHE": str(self.scratch / cache)}
        return self.marrow("compare", *arguments, extra_environment=environment, cwd=None, **more)

    def results(self, out):
        """Of each cell all but times and how often it was tried."""
        return {
            name: {key: value for key, value in row.items() if key not in ("seconds", "tries")}
            for name, row in self.rows(out).items()
        }

    def test_capture_range(self):
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  m: {uses: test.constant, with: {value: 1, path:"
                " $case}}\noutputs: {number: m}\n"
            ),
        )
        for i in range(3):
            (self.scratch / "cases" / str(i)).mkdir(parents=True)
        experiment = self.write(
            "e.yaml",
            HEAD.replace("value: 10", "value: 2")
            + "initial_error: number.value\nvariants: {near: {m.value: 1.5}, far: {m.value: 4}}\n",
        )
        result = self.compare(experiment, "--out", self.scratch / "out")
        self.assertEqual(result.returncode, 0, result.stderr)
        # 3 of 3: Wilson's interval begins at 3 / (3 + 1.96^2) = 0.438
        rows = [line.split() for line in result.stdout[result.stdout.index("Capture range") :].splitlines()]
        self.assertEqual(
            rows[:6],
            [
                "Capture range: success over number.value, in bins of 2, with 95 % intervals".split(),
                ["start", "near", "far"],
                "0 to 2 3/3 (44 to 100 %) -".split(),
                "2 to 4 - -".split(),
                "4 to 6 - 0/3 (0 to 56 %)".split(),
                "95 % or more to at least 1.5 0".split(),
            ],
        )
        near, far = (variant["capture"] for variant in self.answer()["variants"])
        self.assertEqual((near["range"], near["is_open"], far["range"], far["is_open"]), (1.5, True, 0, False))
        self.assertEqual([bin["of"] for bin in far["bins"]], [0, 0, 3])

    def test_which_values_are_better(self):
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  m: {uses: test.constant, with: {value: 1, path:"
                " $case}}\noutputs: {number: m}\n"
            ),
        )
        for i in range(8):
            (self.scratch / "cases" / str(i)).mkdir(parents=True)
        variants = "variants: {one: {m.value: -1}, four: {m.value: 4}}\n"
        better = {
            "lower": ("5.0 worse", "1", "0"),
            "higher": ("5.0 better", "0", "1"),
            "nearest_zero": ("3.0 worse", "1", "0"),
        }
        for name, (sentence, one, four) in better.items():
            with self.subTest(name):
                head = (
                    "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [{figure: number.value,"
                    " label: sum, better: %s}]\nsuccess: {number.value: 2}\n" % name
                )
                result = self.compare(self.write("e.yaml", head + variants), "--out", self.scratch / name)
                self.assertIn("four, sum: %s" % sentence, result.stdout)
                rows = self.rows(name)
                self.assertEqual((rows["one/0/0"]["success"], rows["four/0/0"]["success"]), (one, four))

    def test_what_goes_wrong_in_a_cell_stays_there(self):
        path = self.experiment(
            {
                "good": "{}",
                "crash": "{m.how: crash}",
                "memory": "{m.how: memory}",
                "nan": "{m.how: nan}",
                "error": "{m.how: error}",
                "exit": "{m.how: exit}",
            },
            cases=1,
        )
        # A limit that none of them reaches: a slow machine takes seconds to fill the memory.
        result = self.compare(path, "--out", self.scratch / "out", "--time-limit", 250, "--memory-limit", 1000)
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = self.rows("out")
        self.assertEqual(len(rows), 6)
        reasons = {
            "crash": "crashed in node 'm': Segmentation fault",
            "memory": "its process in node 'm' used more than 1000 MB of memory",
            "nan": "'number.value' is nan, not a finite number",
            "error": "node 'm' (test.misbehave) failed: it will not do",
            "exit": "ended in node 'm' with exit code 3",
        }
        for name, row in rows.items():
            variant = name.split("/")[0]
            self.assertEqual(row["status"], "done" if variant == "good" else "failed", row)
            self.assertEqual(row["reason"], reasons.get(variant, ""))
            self.assertEqual(row["tries"], "2" if variant in ("crash", "memory", "exit") else "1", row)
            self.assertEqual(row["success"], "1" if variant == "good" else "0")
        self.assertIn("crash/0/0: crashed in node 'm'", result.stdout)
        self.assertRegex(result.stdout, r"good \*\s+1\s+0\s+0\s+100.0 %")
        self.assertRegex(result.stdout, r"crash\s+1\s+1\s+0\s+0.0 %")

    def test_a_cell_that_hangs_is_ended(self):
        path = self.experiment({"good": "{}", "hang": "{m.how: hang}"}, cases=1)
        limit = 40 if IS_SANITIZED else 6  # it takes this twice, and a good cell far less on a busy machine
        result = self.compare(path, "--out", self.scratch / "out", "--time-limit", limit)
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = self.rows("out")
        self.assertEqual((rows["good/0/0"]["status"], rows["hang/0/0"]["status"]), ("done", "failed"))
        self.assertEqual(rows["hang/0/0"]["reason"], "its process in node 'm' took longer than %d s" % limit)
        self.assertEqual((rows["hang/0/0"]["tries"], rows["hang/0/0"]["success"]), ("2", "0"))

    def test_what_variants_share_is_computed_once_and_read_back_the_second_time(self):
        path = self.experiment({name: "{m.value: %d}" % i for i, name in enumerate("abcd")}, cases=5)
        first = self.compare(path, "--out", self.scratch / "one")
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertIn("20 cells: 4 variants, 5 cases, 1 starts; 0 were there already", first.stdout)
        rows = [json.loads(line) for line in (self.scratch / "one" / "cells.jsonl").read_text().splitlines()]
        self.assertEqual(sum(row["nodes"]["shared"]["made"] for row in rows), 5, "once a case")
        self.assertEqual(sum(row["nodes"]["shared"]["cached"] for row in rows), 15)
        second = self.compare(path, "--out", self.scratch / "two")
        self.assertIn("calls of nodes: 0 made", second.stdout)
        self.assertEqual(self.results("one"), self.results("two"))
        again = self.compare(path, "--out", self.scratch / "one")
        self.assertIn("20 were there already", again.stdout)

    def test_killed_at_any_moment_and_continued(self):
        path = self.experiment({name: "{m.value: %d}" % i for i, name in enumerate("abc")}, cases=6)
        whole = self.compare(path, "--out", self.scratch / "whole", cache="other")
        self.assertEqual(whole.returncode, 0, whole.stderr)
        chance = random.Random(3)
        environment = dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS), MARROW_CACHE=str(self.scratch / "cache"))
        killed = 0
        for _ in range(20):
            process = subprocess.Popen(
                [str(MARROW), "compare", str(path), "--out", str(self.scratch / "out"), "--quiet"],
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
            )
            time.sleep(chance.uniform(0.01, 0.3))
            process.send_signal(signal.SIGKILL)
            process.communicate()  # to the end of what its workers could say: none of them writes any more
            killed += process.returncode == -signal.SIGKILL
            if chance.random() < 0.3:  # begin anew, so that every moment is met
                shutil.rmtree(self.scratch / "out", ignore_errors=True)
                shutil.rmtree(self.scratch / "cache", ignore_errors=True)
        self.assertGreater(killed, 5)
        continued = self.compare(path, "--out", self.scratch / "out")
        self.assertEqual(continued.returncode, 0, continued.stderr)
        self.assertEqual(self.results("out"), self.results("whole"))

    def test_two_at_once_on_one_cache(self):
        path = self.experiment({name: "{m.value: %d}" % i for i, name in enumerate("abc")}, cases=5)
        environment = dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS), MARROW_CACHE=str(self.scratch / "cache"))
        both = [
            subprocess.Popen(
                [str(MARROW), "compare", str(path), "--out", str(self.scratch / name), "--quiet"],
                env=environment,
                stdout=subprocess.DEVNULL,
            )
            for name in ("one", "two")
        ]
        self.assertEqual([process.wait() for process in both], [0, 0])
        self.assertEqual(self.results("one"), self.results("two"))

    def test_a_time_counts_what_the_variants_of_its_own_experiment_do_not_share(self):
        self.experiment({"a": "{}"}, cases=1)
        self.write("p.yaml", PIPELINE.replace("0.05", "1"))
        seconds = {"one": 1}
        for attempt in range(5):  # what both share takes a second each time; the rest may, on a busy machine
            if seconds["one"] < 1:
                break
            for name, variant in (("one", "{m.value: 5}"), ("two", "{shared.value: 0.1}")):
                path = self.write(name + ".yaml", HEAD + "variants:\n  a: {}\n  b: %s\n" % variant)
                out = "%s-%d" % (name, attempt)
                result = self.compare(path, "--out", self.scratch / out, cache="cache-%d" % attempt)
                self.assertEqual(result.returncode, 0, result.stderr)
                seconds[name] = float(self.rows(out)["a/0/0"]["seconds"])
        self.assertLess(seconds["one"], 1, "both share it")
        self.assertGreater(seconds["two"], 1, "the same cell, and the other variant makes another one")

    def test_a_simulated_case_that_is_not_whole_is_made_again(self):
        self.write("p.yaml", PIPELINE.replace("0.05", "0"))
        self.write("s.yaml", "marrow: 1\nnodes:\n  s: {uses: test.sides}\noutputs: {case: s.both}\n")
        path = self.write(
            "e.yaml",
            HEAD.replace("folders: [cases/*]", "simulate: {pipeline: s.yaml, seeds: 1..3}") + "variants: {a: {}}\n",
        )
        self.assertEqual(self.compare(path, "--out", self.scratch / "one").returncode, 0)
        files = sorted((self.scratch / "cache" / "cases").glob("*/outputs/case/a.json"))
        self.assertEqual(len(files), 3)
        whole = files[0].read_text()
        files[0].write_text(whole[:-5])
        files[1].unlink()
        shutil.rmtree(files[2].parent)
        result = self.compare(path, "--out", self.scratch / "two")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual([file.read_text() for file in files], [whole] * 3)
        self.assertEqual([name for name in os.listdir(self.scratch / "cache" / "cases") if "tmp" in name], [])
        self.assertEqual(self.results("two"), self.results("one"))

    def test_a_simulated_case_is_what_a_run_with_its_seed_makes(self):
        self.write("p.yaml", PIPELINE.replace("0.05", "0"))
        self.write("s.yaml", "marrow: 1\nnodes:\n  s: {uses: test.draw}\noutputs: {case: s}\n")
        path = self.write(
            "e.yaml",
            HEAD.replace("folders: [cases/*]", "simulate: {pipeline: s.yaml, seeds: [4, 9]}") + "variants: {a: {}}\n",
        )
        self.assertEqual(self.compare(path, "--out", self.scratch / "out").returncode, 0)
        made = []
        for seed in (4, 9):
            out = self.scratch / ("seed-%d" % seed)
            result = marrow("run", self.scratch / "s.yaml", "--seed", seed, "--out", out, plugins=[TEST_PLUGINS])
            self.assertEqual(result.returncode, 0, result.stderr)
            made.append((out / "outputs" / "case.json").read_text())
        cases = [file.read_text() for file in (self.scratch / "cache" / "cases").glob("*/outputs/case.json")]
        self.assertEqual(sorted(cases), sorted(made))
        self.assertNotEqual(*made)

    def test_a_store_that_cannot_be_used_is_one_sentence(self):
        path = self.experiment({"a": "{}"}, cases=1)
        (self.scratch / "cache").mkdir()
        self.write("cache/mine", "")
        result = self.compare(path, "--out", self.scratch / "out")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(
            result.stderr.count(
                "marrow: note: results are not kept: the folder %s holds other things" % (self.scratch / "cache")
            ),
            1,
            result.stderr,
        )
        self.assertEqual(os.listdir(self.scratch / "cache"), ["mine"])

    def test_limits_of_reading_come_to_the_workers_as_they_are(self):
        result = self.compare(
            self.experiment({"a": "{}"}, cases=1),
            "--out",
            self.scratch / "out",
            "--file-seconds",
            "0.001",
            "--file-memory",
            "1e9",
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.rows("out")["a/0/0"]["reason"], "")

    def test_one_cell_by_itself(self):
        path = self.experiment({"a": "{}", "b": "{m.value: 5}"})
        environment = {"MARROW_CACHE": str(self.scratch / "cache")}
        result = marrow(
            "cell", path, "b/1/0", "--out", self.scratch / "out", plugins=[TEST_PLUGINS], extra_environment=environment
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(result.stdout)["values"], [6])
        self.assertTrue((self.scratch / "out" / "cells" / "b" / "1" / "0" / "run.json").exists())
        whole = self.compare(path, "--out", self.scratch / "out")
        self.assertIn("1 were there already", whole.stdout)
        wrong = marrow(
            "cell", path, "b/l/0", "--out", self.scratch / "out", plugins=[TEST_PLUGINS], extra_environment=environment
        )
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("the experiment has no cell 'b/l/0': there is no case 'l'; did you mean", wrong.stderr)

    def test_dry_run_says_what_there_is_to_do(self):
        path = self.experiment({"a": "{}", "b": "{m.value: 5}"})
        before = self.compare(path, "--dry-run")
        self.assertEqual(before.returncode, 0, before.stderr)
        self.assertIn("6 cells: 2 variants, 3 cases, 1 starts", before.stdout)
        self.assertIn("12 evaluations of nodes: 3 shared, 0 cached, 9 to make", before.stdout)
        self.assertFalse((self.scratch / "runs").exists())
        self.compare(path, "--out", self.scratch / "out")
        after = self.compare(path, "--dry-run")
        self.assertIn("12 evaluations of nodes: 3 shared, 9 cached, 0 to make", after.stdout)

    def test_faults_come_before_anything_runs(self):
        path = self.experiment({"a": "{m.vlaue: 1}"})
        result = self.compare(path, "--out", self.scratch / "out")
        self.assertEqual(result.returncode, 2)
        self.assertIn("e.yaml:7:7: error: 'test.misbehave' has no option 'vlaue'", result.stderr)
        self.assertFalse((self.scratch / "out").exists())

    def test_another_folder_is_not_touched(self):
        path = self.experiment({"a": "{}"})
        (self.scratch / "mine").mkdir()
        self.write("mine/file", "keep")
        result = self.compare(path, "--out", self.scratch / "mine")
        self.assertEqual(result.returncode, 2)
        self.assertIn("holds something else than a comparison", result.stderr)
        self.assertEqual([entry.name for entry in (self.scratch / "mine").iterdir()], ["file"])


if __name__ == "__main__":
    main()
