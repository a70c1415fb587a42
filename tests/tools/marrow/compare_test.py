# SPDX-License-Identifier: Apache-2.0
"""Comparisons as a person runs them: a fault in one cell stays there, and an interrupted comparison can continue."""
import json
import os
import random
import shutil
import signal
import subprocess
import time

from compare_cases import PIPELINE, Compared
from harness.program import IS_SANITIZED, main

LIMITED = "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\n"
SUCCESS = "success: {number.value: %d}\n"
CONSTANT = """marrow: 1
inputs: {case: {type: path}}
nodes:
  m: {uses: test.constant, with: {value: 1, path: $case}}
outputs: {number: m}
"""


class Compare(Compared):
    cases = "012"
    pipeline = PIPELINE.replace("0.02", "0.05")

    def experiment(self, name, variants, head=LIMITED + SUCCESS % 10):
        return super().experiment(name, variants, head)

    def with_cases(self, count):
        for i in range(count):
            self.add_case(str(i))

    def several(self, names, cases):
        """A variant of each name, all of them done."""
        self.with_cases(cases)
        self.experiment("e", "{%s}" % ", ".join("%s: {m.value: %d}" % (name, i) for i, name in enumerate(names)))

    def results(self, out):
        """Of each cell all but times and how often it was tried."""
        return {
            cell: {key: value for key, value in row.items() if key not in ("seconds", "tries")}
            for cell, row in self.rows(out).items()
        }

    def test_capture_range(self):
        self.write("p.yaml", CONSTANT)
        head = LIMITED + SUCCESS % 2 + "initial_error: number.value\n"
        self.experiment("e", "{near: {m.value: 1.5}, far: {m.value: 4}}", head)
        told = self.compare().stdout
        # 3 of 3: Wilson's interval begins at 3 / (3 + 1.96^2) = 0.438
        self.assertEqual(
            [line.split() for line in told[told.index("Capture range") :].splitlines()][:6],
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
        self.write("p.yaml", CONSTANT)
        self.with_cases(8)
        for better, sentence, one, four in (
            ("lower", "5.0 worse", "1", "0"),
            ("higher", "5.0 better", "0", "1"),
            ("nearest_zero", "3.0 worse", "1", "0"),
        ):
            with self.subTest(better):
                figure = "[{figure: number.value, label: sum, better: %s}]" % better
                head = LIMITED.replace("[number.value]", figure) + SUCCESS % 2
                self.experiment("e", "{one: {m.value: -1}, four: {m.value: 4}}", head)
                self.assertIn("four, sum: %s" % sentence, self.compare(out=better).stdout)
                success = self.figures(better, "success")
                self.assertEqual((success["one/0/0"], success["four/0/0"]), (one, four))

    def test_what_goes_wrong_in_a_cell_stays_there(self):
        reasons = {
            "good": "",
            "crash": "crashed in node 'm': Segmentation fault",
            "memory": "its process in node 'm' used more than 1000 MB of memory",
            "nan": "'number.value' is nan, not a finite number",
            "error": "node 'm' (test.misbehave) failed: it will not do",
            "exit": "ended in node 'm' with exit code 3",
        }
        hows = ", ".join("%s: {m.how: %s}" % (how, how) for how in list(reasons)[1:])
        self.experiment("e", "{good: {}, %s}" % hows, LIMITED.replace("cases/*", "cases/0") + SUCCESS % 10)
        # A limit that none of them reaches: a slow machine takes seconds to fill the memory.
        told = self.compare("--time-limit", 250, "--memory-limit", 1000).stdout
        rows = self.rows()
        self.assertEqual(len(rows), 6)
        for name, row in rows.items():
            variant = name.split("/")[0]
            self.assertEqual(row["status"], "done" if variant == "good" else "failed", row)
            self.assertEqual(row["reason"], reasons[variant])
            self.assertEqual(row["tries"], "2" if variant in ("crash", "memory", "exit") else "1", row)
            self.assertEqual(row["success"], "1" if variant == "good" else "0")
        self.assertIn("crash/0/0: crashed in node 'm'", told)
        self.assertRegex(told, r"good \*\s+1\s+0\s+0\s+100.0 %")
        self.assertRegex(told, r"crash\s+1\s+1\s+0\s+0.0 %")

    def test_a_cell_that_hangs_is_ended(self):
        head = LIMITED.replace("cases/*", "cases/0") + SUCCESS % 10
        self.experiment("e", "{good: {}, hang: {m.how: hang}}", head)
        limit = 40 if IS_SANITIZED else 6  # it takes this twice, and a good cell far less on a busy machine
        self.compare("--time-limit", limit)
        rows = self.rows()
        self.assertEqual((rows["good/0/0"]["status"], rows["hang/0/0"]["status"]), ("done", "failed"))
        self.assertEqual(rows["hang/0/0"]["reason"], "its process in node 'm' took longer than %d s" % limit)
        self.assertEqual((rows["hang/0/0"]["tries"], rows["hang/0/0"]["success"]), ("2", "0"))

    def test_what_variants_share_is_computed_once_and_read_back_the_second_time(self):
        self.several("abcd", cases=5)
        said = "20 cells: 4 variants, 5 cases, 1 starts; 0 were there already"
        self.assertIn(said, self.compare(out="one").stdout)
        shared = [row["nodes"]["shared"] for row in self.json_lines("one/cells.jsonl")]
        self.assertEqual(sum(one["made"] for one in shared), 5, "once a case")
        self.assertEqual(sum(one["cached"] for one in shared), 15)
        self.assertIn("calls of nodes: 0 made", self.compare(out="two").stdout)
        self.assertEqual(self.results("one"), self.results("two"))
        self.assertIn("20 were there already", self.compare(out="one").stdout)

    def test_killed_at_any_moment_and_continued(self):
        self.several("abc", cases=6)
        self.compare(out="whole", extra_environment={"MARROW_CACHE": str(self.scratch / "other")})
        chance = random.Random(3)
        killed = 0
        for _ in range(20):
            process = self.start("compare", self.file, "--out", "out", "--quiet", stdout=subprocess.DEVNULL)
            time.sleep(chance.uniform(0.01, 0.3))
            process.send_signal(signal.SIGKILL)
            process.communicate()  # to the end of what its workers could say: none of them writes any more
            killed += process.returncode == -signal.SIGKILL
            if chance.random() < 0.3:  # begin anew, so that every moment is met
                shutil.rmtree(self.out, ignore_errors=True)
                shutil.rmtree(self.scratch / "cache", ignore_errors=True)
        self.assertGreater(killed, 5)
        self.compare()
        self.assertEqual(self.results("out"), self.results("whole"))

    def test_two_at_once_on_one_cache(self):
        self.several("abc", cases=5)
        arguments = ["compare", self.file, "--quiet", "--out"]
        both = [self.start(*arguments, name, stdout=subprocess.DEVNULL) for name in ("one", "two")]
        for process in both:
            process.communicate()
        self.assertEqual([process.returncode for process in both], [0, 0])
        self.assertEqual(self.results("one"), self.results("two"))

    def test_a_time_counts_what_the_variants_of_its_own_experiment_do_not_share(self):
        self.write("p.yaml", PIPELINE.replace("0.02", "1"))
        seconds = {"one": 1}
        for attempt in range(5):  # what both share takes a second each time; the rest may, on a busy machine
            if seconds["one"] < 1:
                break
            store = {"MARROW_CACHE": str(self.scratch / ("cache-%d" % attempt))}
            for name, variant in (("one", "{m.value: 5}"), ("two", "{shared.value: 0.1}")):
                head = LIMITED.replace("cases/*", "cases/0")
                file = self.experiment(name, "{a: {}, b: %s}" % variant, head)
                out = "%s-%d" % (name, attempt)
                self.compare(file=file, out=out, extra_environment=store)
                seconds[name] = float(self.figures(out, "seconds")["a/0/0"])
        self.assertLess(seconds["one"], 1, "both share it")
        self.assertGreater(seconds["two"], 1, "the same cell, and the other variant makes another one")

    def simulated(self, node, seeds):
        self.write("p.yaml", PIPELINE.replace("0.02", "0"))
        self.write("s.yaml", "marrow: 1\nnodes:\n  s: {uses: %s}\noutputs: {case: %s}\n" % node)
        cases = "simulate: {pipeline: s.yaml, seeds: %s}" % seeds
        self.experiment("e", "{a: {}}", LIMITED.replace("folders: [cases/*]", cases))

    def test_a_simulated_case_that_is_not_whole_is_made_again(self):
        self.simulated(("test.sides", "s.both"), "1..3")
        self.compare(out="one")
        cases = self.scratch / "cache" / "cases"
        files = sorted(cases.glob("*/outputs/case/a.json"))
        self.assertEqual(len(files), 3)
        whole = files[0].read_text()
        files[0].write_text(whole[:-5])
        files[1].unlink()
        shutil.rmtree(files[2].parent)
        self.compare(out="two")
        self.assertEqual([file.read_text() for file in files], [whole] * 3)
        self.assertEqual([name for name in os.listdir(cases) if "tmp" in name], [])
        self.assertEqual(self.results("two"), self.results("one"))

    def test_a_simulated_case_is_what_a_run_with_its_seed_makes(self):
        self.simulated(("test.draw", "s"), "[4, 9]")
        self.compare()
        made = []
        for seed in ("4", "9"):
            self.expect(0, "run", "s.yaml", "--seed", seed, "--out", seed)
            made.append(self.read(seed + "/outputs/case.json"))
        cases = [file.read_text() for file in (self.scratch / "cache" / "cases").glob("*/outputs/case.json")]
        self.assertEqual(sorted(cases), sorted(made))
        self.assertNotEqual(*made)

    def test_a_store_that_cannot_be_used_is_one_sentence(self):
        self.write("cache/mine", "")
        said = self.compare().stderr
        note = "marrow: note: results are not kept: the folder %s holds other things" % (self.scratch / "cache")
        self.assertEqual(said.count(note), 1, said)
        self.assertEqual(os.listdir(self.scratch / "cache"), ["mine"])

    def test_limits_of_reading_come_to_the_workers_as_they_are(self):
        self.compare("--file-seconds", "0.001", "--file-memory", "1e9")
        self.assertEqual(self.figures(column="reason")["a/0/0"], "")

    def test_a_dry_run_and_one_cell_by_itself(self):
        told = self.printed("compare", self.file, "--dry-run")
        self.assertIn("6 cells: 2 variants, 3 cases, 1 starts", told)
        self.assertIn("12 evaluations of nodes: 3 shared, 0 cached, 9 to make", told)
        self.assertFalse((self.scratch / "runs").exists())
        cell = self.printed("cell", self.file, "b/1/0", "--out", "out")
        self.assertEqual(json.loads(cell)["values"], [6])
        self.assertTrue((self.out / "cells/b/1/0/run.json").exists())
        said = "the experiment has no cell 'b/l/0': there is no case 'l'; did you mean"
        self.refused(said, "cell", self.file, "b/l/0", "--out", "out")
        self.assertIn("1 were there already", self.compare().stdout)
        told = self.printed("compare", self.file, "--dry-run")
        self.assertIn("12 evaluations of nodes: 3 shared, 9 cached, 0 to make", told)

    def test_faults_come_before_anything_runs(self):
        self.experiment("e", "{a: {m.vlaue: 1}}")
        said = "e.yaml:6:16: error: 'test.misbehave' has no option 'vlaue'"
        self.assertIn(said, self.compare(status=2).stderr)
        self.assertFalse(self.out.exists())


if __name__ == "__main__":
    main()
