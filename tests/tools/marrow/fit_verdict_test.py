# SPDX-License-Identifier: Apache-2.0
"""tools/studies/fit_verdict on comparisons that are made here, whose probabilities are known."""
import json
import math
import pathlib
import random
import subprocess
import tempfile
import unittest

import yaml

from harness import SOURCE


def row_of(cell, errors, figures):
    """A row as `marrow compare` writes it; `errors` are mTRE and axial rotation."""
    variant, case, start = cell.split("/")
    row = {"id": cell, "variant": variant, "case": case, "start": start, "status": "done", "verdict": "trusted"}
    row.update(zip(("errors.distal.final.mtre_mm", "errors.distal.final.axial_deg"), errors))
    return {**row, "verdict_figures": {"verdict.distal": figures}}


def write_rows(folder, rows):
    folder.mkdir(exist_ok=True)
    (folder / "cells.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))


def comparison(folder, cells, seed):
    """Poses that fail with log odds of 4 log(1 + doubt) - 4; the figure `noise` says nothing."""
    chance = random.Random(seed)
    rows = []
    for i in range(cells):
        doubt = chance.expovariate(0.5)
        failed = chance.random() < 1 / (1 + math.exp(4 - 4 * math.log1p(doubt)))
        # Every other failure is one of the axial rotation alone.
        errors = [3, 0] if failed and i % 2 else [1, -6] if failed else [0.9, 2]
        cell = "%s/seed-%d/0" % ("odd" if i % 2 else "even", i // 2)
        rows.append(row_of(cell, errors, {"doubt": doubt, "noise": chance.random()}))
    # Neither right nor failed: it is not fitted to.
    rows.append(row_of("odd/between/0", [1.5, 0], {"doubt": 1e6}))
    rows.append({"id": "odd/seed-0/1", "variant": "odd", "case": "seed-0", "start": "1", "status": "failed"})
    # A node failed that may fail, so the errors are not known; and one whose images say nothing.
    rows.append(row_of("odd/unknown/0", [None, None], {"doubt": 1e6}))
    rows.append(row_of("odd/nothing/0", [0, 0], {}))
    write_rows(folder, rows)


class FitVerdict(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        comparison(cls.folder / "seen", 800, 1)
        comparison(cls.folder / "unseen", 800, 2)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def run_tool(self, *arguments):
        return subprocess.run(
            [str(SOURCE / "tools/studies/fit_verdict"), *map(str, arguments)], capture_output=True, text=True
        )

    def test_fits_what_the_poses_were_drawn_from(self):
        model_file = self.folder / "model.yaml"
        done = self.run_tool(self.folder / "seen", "--write", model_file, "--ridge", "1e-6", "--record", "Drawn here.")
        self.assertEqual(done.returncode, 0, done.stderr)
        model = yaml.safe_load(model_file.read_text())
        self.assertIn("800 poses", model["record"])
        self.assertTrue(model["record"].endswith("from: seen. Drawn here."), model["record"])
        terms = {term["figure"]: term for term in model["terms"]}
        log_odds = lambda doubt: model["bias"] + terms["doubt"]["weight"] * math.log1p(doubt / terms["doubt"]["scale"])
        for doubt in (0.5, 1.7, 4):
            noise = terms.get("noise", {"weight": 0, "scale": 1})
            rest = noise["weight"] * math.log1p(0.5 / noise["scale"])
            self.assertLess(abs(log_odds(doubt) + rest - (4 * math.log1p(doubt) - 4)), 0.6, doubt)
        self.assertTrue(all(term["weight"] >= 0 for term in model["terms"]))

    def test_counts_what_a_model_is_worth(self):
        model_file = self.folder / "by_hand.yaml"
        model_file.write_text(
            yaml.safe_dump(
                {
                    "marrow-failure-model": 1,
                    "record": "",
                    "bias": -1,
                    "doubtful_above": 0.5,
                    "wrong_above": 0.9,
                    "terms": [{"figure": "doubt", "scale": 1, "weight": 1, "absent": 0}],
                }
            )
        )
        done = self.run_tool("--check", self.folder / "unseen", "--model", model_file, "--roc", self.folder / "roc.svg")
        self.assertEqual(done.returncode, 0, done.stderr)
        # Probability 0.5 is at a doubt of e - 1.
        bad, good, silent, alarms = 0, 0, 0, 0
        for row in map(json.loads, (self.folder / "unseen/cells.jsonl").read_text().splitlines()):
            if row["status"] != "done" or row["case"] in ("between", "unknown", "nothing"):
                continue
            doubt = row["verdict_figures"]["verdict.distal"]["doubt"]
            failed = row["errors.distal.final.mtre_mm"] > 2 or row["errors.distal.final.axial_deg"] < -5
            bad, good = bad + failed, good + (not failed)
            silent, alarms = silent + (failed and doubt <= math.e - 1), alarms + (not failed and doubt > math.e - 1)
        last = next(line for line in done.stdout.splitlines() if line.startswith("all "))
        self.assertEqual([int(word) for word in last.split()[1:]], [bad, silent, good, alarms, 1, 1])
        self.assertTrue((self.folder / "roc.svg").read_text().startswith("<svg"))

    def threshold(self, name, right, failed, *arguments, wrong_above=0.9):
        """The threshold that is chosen for poses with these log odds."""
        folder = self.folder / name
        errors = [(odds, 0.5) for odds in right] + [(odds, 3) for odds in failed]
        write_rows(
            folder,
            [row_of("v/%d/0" % i, [mm, 0], {"doubt": math.expm1(odds + 5)}) for i, (odds, mm) in enumerate(errors)],
        )
        model_file = folder / "model.yaml"
        terms = [{"figure": "doubt", "scale": 1, "weight": 1, "absent": 0}]
        before = {"record": "Before", "bias": -5, "doubtful_above": 0.5, "wrong_above": wrong_above, "terms": terms}
        model_file.write_text(yaml.safe_dump(before))
        done = self.run_tool("--threshold", folder, "--model", model_file, "--record", "And after.", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        model = yaml.safe_load(model_file.read_text())
        self.assertEqual((model["record"], model["terms"]), ("Before. And after.", terms))
        self.assertIn("doubtful_above: %s, before 0.5" % model["doubtful_above"], done.stdout)
        return model["doubtful_above"]

    def test_the_threshold_of_doubt_is_what_the_allowed_share_of_right_poses_exceeds(self):
        right = [-6 + 0.05 * i for i in range(101)]  # log odds
        chosen = self.threshold("some", right, [-3, 1], "--false-alarms", "0.05")
        self.assertAlmostEqual(chosen, 1 / (1 + math.exp(6 - 0.05 * 95)), places=3)
        self.assertEqual(self.threshold("high", [-3] * 10 + [9], [1], "--false-alarms", "0"), 0.9)
        self.assertEqual(self.threshold("low", [-3] * 10 + [9], [1], "--false-alarms", "0", wrong_above=0.7), 0.7)

    def test_no_more_right_poses_are_doubtful_than_allowed(self):
        """A pose above the threshold in the file is doubtful. The test computes the probabilities itself."""
        for name, right, share in (
            ("equal", [-3.5] * 10, 0.0),  # 0.029312...: with three digits it was 0.0293, and all ten were doubtful
            ("close", [-3.5 + 1e-7 * i for i in range(10)], 0.2),
            ("few", [-4.0, -3.9, -3.8, -3.7, -3.6, -3.5, -3.4, -3.3, -3.2, -3.1, -3.0], 0.05),  # none of 11, not one
        ):
            with self.subTest(name):
                chosen = self.threshold(name, right, [-3.5 + 2e-6, 1], "--false-alarms", share)
                doubtful = sum(1 / (1 + math.exp(-odds)) > chosen for odds in right)
                self.assertEqual(doubtful, int(share * len(right)))
                if name != "few":  # the failure beside them is still told from them
                    self.assertLess(chosen, 1 / (1 + math.exp(3.5 - 2e-6)))

    def test_the_threshold_is_that_of_the_model_as_it_is_written(self):
        """Right poses are all alike; the model's weights are rounded to four digits."""
        rows = [row_of("v/r%d/0" % i, [0.5, 0], {"doubt": 0.123456789, "more": 0.987654321}) for i in range(20)]
        rows += [row_of("v/f%d/0" % i, [3, 0], {"doubt": 1.1 + i / 7, "more": 3 + i / 3}) for i in range(20)]
        write_rows(self.folder / "alike", rows)
        model_file = self.folder / "alike.yaml"
        done = self.run_tool(self.folder / "alike", "--write", model_file, "--false-alarms", "0")
        self.assertEqual(done.returncode, 0, done.stderr)
        model = yaml.safe_load(model_file.read_text())
        figures = {"doubt": 0.123456789, "more": 0.987654321}
        log_odds = model["bias"] + sum(
            term["weight"] * math.log1p(figures[term["figure"]] / term["scale"]) for term in model["terms"]
        )
        self.assertLessEqual(1 / (1 + math.exp(-log_odds)), model["doubtful_above"])

    def test_outputs_of_cells_are_not_read(self):
        """They may be left of another run than the rows."""
        rows = [row_of("v/%d/0" % i, [0.5 if i % 2 else 3, 0], {"doubt": i % 2}) for i in range(20)]
        write_rows(self.folder / "mixed", rows)
        for i in range(20):
            outputs = self.folder / ("mixed/cells/v/%d/0/outputs/verdict" % i)
            outputs.mkdir(parents=True)
            (outputs / "distal.yaml").write_text(yaml.safe_dump({"figures": [{"name": "doubt", "value": 1e6}]}))
        model_file = self.folder / "one_term.yaml"
        terms = [{"figure": "doubt", "scale": 1, "weight": 1, "absent": 0}]
        model = {"record": "", "bias": -1, "doubtful_above": 0.5, "wrong_above": 0.9, "terms": terms}
        model_file.write_text(yaml.safe_dump(model))
        done = self.run_tool("--check", self.folder / "mixed", "--model", model_file)
        last = next(line for line in done.stdout.splitlines() if line.startswith("all "))
        # log odds are -1 + log 2 < 0 and -1: none is doubtful, so all ten failures are trusted
        self.assertEqual([int(word) for word in last.split()[1:]], [10, 10, 10, 0, 0, 0])

    def test_a_verdict_that_is_one_file(self):
        rows = [row_of("v/%d/0" % i, [0.5, 0], {}) for i in range(4)]
        for row in rows:
            row["verdict_figures"] = {"verdict": {"doubt": 1}, "other.distal": {"doubt": 2}}
        write_rows(self.folder / "single", rows)
        model_file = self.folder / "single.yaml"
        terms = [{"figure": "doubt", "scale": 1, "weight": 1, "absent": 0}]
        model = {"record": "", "bias": -1, "doubtful_above": 0.5, "wrong_above": 0.9, "terms": terms}
        model_file.write_text(yaml.safe_dump(model))
        for arguments in ([], ["--verdict", "other"], ["--verdict", "other.distal"]):
            done = self.run_tool("--check", self.folder / "single", "--model", model_file, *arguments)
            last = next(line for line in done.stdout.splitlines() if line.startswith("all "))
            self.assertEqual(last.split()[3:5], ["4", "4" if arguments else "0"], done.stdout)

    def test_what_cannot_be_told_apart_is_refused(self):
        row = row_of("v/1/0", [0.5, 0], {"doubt": 1})
        two = {**row, "verdict_figures": {"verdict.distal": {"doubt": 1}, "verdict.proximal": {"doubt": 2}}}
        older = {name: value for name, value in row.items() if name != "verdict_figures"}
        other = {name: value for name, value in row.items() if not name.endswith("axial_deg")}
        for name, one, sentence in (
            ("two", two, "the verdicts are verdict.distal, verdict.proximal; name one with --verdict"),
            ("older", older, "an older marrow wrote it, without the figures of verdicts; compare again"),
            ("other", other, "the metrics lack errors.distal.final.axial_deg; see --errors"),
        ):
            write_rows(self.folder / name, [one])
            done = self.run_tool(self.folder / name)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(done.stderr, "fit_verdict: %s: %s\n" % (self.folder / name / "cells.jsonl", sentence))
        done = self.run_tool(self.folder / "seen", self.folder / "seen/../seen")
        self.assertIn("seen/../seen is given twice, so its poses would count twice", done.stderr)
        done = self.run_tool(self.folder / "nowhere")
        self.assertIn("nowhere/cells.jsonl; give folders of marrow compare", done.stderr)

    def test_says_what_is_missing(self):
        done = self.run_tool(self.folder / "seen", "--verdict", "other")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("no cell with a verdict; give folders of marrow compare", done.stderr)


if __name__ == "__main__":
    unittest.main()
