# SPDX-License-Identifier: Apache-2.0
"""tools/studies/fit_verdict on comparisons that are made here, whose probabilities are known."""
import json
import math
import random
import subprocess

import yaml

from harness import SOURCE
from harness.program import SharedCase, main

TERMS = [{"figure": "doubt", "scale": 1, "weight": 1, "absent": 0}]


def row_of(cell, errors, figures):
    """A row as `marrow compare` writes it; `errors` are mTRE and axial rotation."""
    variant, case, start = cell.split("/")
    row = {"id": cell, "variant": variant, "case": case, "start": start, "status": "done", "verdict": "trusted"}
    row.update(zip(("errors.distal.final.mtre_mm", "errors.distal.final.axial_deg"), errors))
    return {**row, "verdict_figures": {"verdict.distal": figures}}


def drawn_rows(cells, seed):
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
    return rows


def log_odds(model, **figures):
    terms = {term["figure"]: term for term in model["terms"]}
    used = {name: value for name, value in figures.items() if name in terms}
    return model["bias"] + sum(
        terms[name]["weight"] * math.log1p(value / terms[name]["scale"]) for name, value in used.items()
    )


class FitVerdict(SharedCase):
    def make(self):
        self.comparison("seen", drawn_rows(800, 1))
        self.comparison("unseen", drawn_rows(800, 2))

    def comparison(self, name, rows):
        self.write(name + "/cells.jsonl", "".join(json.dumps(row) + "\n" for row in rows))

    def model(self, name, **values):
        model = {"record": "", "bias": -1, "doubtful_above": 0.5, "wrong_above": 0.9, "terms": TERMS, **values}
        self.write(name, yaml.safe_dump(model))
        return name

    def tool(self, *arguments, code=0):
        """What it prints, or why it refuses."""
        command = [str(SOURCE / "tools/studies/fit_verdict"), *map(str, arguments)]
        done = subprocess.run(command, cwd=self.scratch, capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr if code else done.stdout

    def counted(self, folder, *arguments):
        """The numbers in the line of all variants: failures, silent ones, right poses, alarms, ..."""
        said = self.tool("--check", folder, "--model", self.model(folder + ".yaml"), *arguments)
        return [int(word) for line in said.splitlines() if line.startswith("all ") for word in line.split()[1:]]

    def test_fits_what_the_poses_were_drawn_from(self):
        self.tool("seen", "--write", "model.yaml", "--ridge", "1e-6", "--record", "Drawn here.")
        model = yaml.safe_load(self.read("model.yaml"))
        self.assertIn("800 poses", model["record"])
        self.assertTrue(model["record"].endswith("from: seen. Drawn here."), model["record"])
        for doubt in (0.5, 1.7, 4):
            fitted = log_odds(model, doubt=doubt, noise=0.5)
            self.assertLess(abs(fitted - (4 * math.log1p(doubt) - 4)), 0.6, doubt)
        self.assertTrue(all(term["weight"] >= 0 for term in model["terms"]))

    def test_counts_what_a_model_is_worth(self):
        counted = self.counted("unseen")
        # Probability 0.5 is at a doubt of e - 1.
        bad, good, silent, alarms = 0, 0, 0, 0
        for row in self.json_lines("unseen/cells.jsonl"):
            if row["status"] != "done" or row["case"] in ("between", "unknown", "nothing"):
                continue
            doubt = row["verdict_figures"]["verdict.distal"]["doubt"]
            failed = row["errors.distal.final.mtre_mm"] > 2 or row["errors.distal.final.axial_deg"] < -5
            bad, good = bad + failed, good + (not failed)
            silent, alarms = silent + (failed and doubt <= math.e - 1), alarms + (not failed and doubt > math.e - 1)
        self.assertEqual(counted, [bad, silent, good, alarms, 1, 1])

    def threshold(self, name, right, failed, share, wrong_above=0.9):
        """The threshold that is chosen for poses with these log odds."""
        errors = [(odds, 0.5) for odds in right] + [(odds, 3) for odds in failed]
        rows = [row_of("v/%d/0" % i, [mm, 0], {"doubt": math.expm1(odds + 5)}) for i, (odds, mm) in enumerate(errors)]
        self.comparison(name, rows)
        file = self.model(name + "/model.yaml", record="Before", bias=-5, wrong_above=wrong_above)
        said = self.tool("--threshold", name, "--model", file, "--record", "And after.", "--false-alarms", share)
        model = yaml.safe_load(self.read(file))
        self.assertEqual((model["record"], model["terms"]), ("Before. And after.", TERMS))
        self.assertIn("doubtful_above: %s, before 0.5" % model["doubtful_above"], said)
        return model["doubtful_above"]

    def test_the_threshold_of_doubt_is_what_the_allowed_share_of_right_poses_exceeds(self):
        right = [-6 + 0.05 * i for i in range(101)]  # log odds
        chosen = self.threshold("some", right, [-3, 1], 0.05)
        self.assertAlmostEqual(chosen, 1 / (1 + math.exp(6 - 0.05 * 95)), places=3)
        self.assertEqual(self.threshold("high", [-3] * 10 + [9], [1], 0), 0.9)
        self.assertEqual(self.threshold("low", [-3] * 10 + [9], [1], 0, wrong_above=0.7), 0.7)

    def test_no_more_right_poses_are_doubtful_than_allowed(self):
        """A pose above the threshold in the file is doubtful. The test computes the probabilities itself."""
        for name, right, share in (
            ("equal", [-3.5] * 10, 0.0),  # 0.029312...: with three digits it was 0.0293, and all ten were doubtful
            ("close", [-3.5 + 1e-7 * i for i in range(10)], 0.2),
            ("few", [-4.0, -3.9, -3.8, -3.7, -3.6, -3.5, -3.4, -3.3, -3.2, -3.1, -3.0], 0.05),  # none of 11, not one
        ):
            with self.subTest(name):
                chosen = self.threshold(name, right, [-3.5 + 2e-6, 1], share)
                doubtful = sum(1 / (1 + math.exp(-odds)) > chosen for odds in right)
                self.assertEqual(doubtful, int(share * len(right)))
                if name != "few":  # the failure beside them is still told from them
                    self.assertLess(chosen, 1 / (1 + math.exp(3.5 - 2e-6)))

    def test_the_threshold_is_that_of_the_model_as_it_is_written(self):
        """Right poses are all alike; the model's weights are rounded to four digits."""
        figures = {"doubt": 0.123456789, "more": 0.987654321}
        rows = [row_of("v/r%d/0" % i, [0.5, 0], figures) for i in range(20)]
        rows += [row_of("v/f%d/0" % i, [3, 0], {"doubt": 1.1 + i / 7, "more": 3 + i / 3}) for i in range(20)]
        self.comparison("alike", rows)
        self.tool("alike", "--write", "alike.yaml", "--false-alarms", "0")
        model = yaml.safe_load(self.read("alike.yaml"))
        self.assertLessEqual(1 / (1 + math.exp(-log_odds(model, **figures))), model["doubtful_above"])

    def test_outputs_of_cells_are_not_read(self):
        """They may be left of another run than the rows."""
        rows = [row_of("v/%d/0" % i, [0.5 if i % 2 else 3, 0], {"doubt": i % 2}) for i in range(20)]
        self.comparison("mixed", rows)
        verdict = yaml.safe_dump({"figures": [{"name": "doubt", "value": 1e6}]})
        for i in range(20):
            self.write("mixed/cells/v/%d/0/outputs/verdict/distal.yaml" % i, verdict)
        # log odds are -1 + log 2 < 0 and -1: none is doubtful, so all ten failures are trusted
        self.assertEqual(self.counted("mixed"), [10, 10, 10, 0, 0, 0])

    def test_a_verdict_that_is_one_file(self):
        figures = {"verdict": {"doubt": 1}, "other.distal": {"doubt": 2}}
        self.comparison(
            "single", [{**row_of("v/%d/0" % i, [0.5, 0], {}), "verdict_figures": figures} for i in range(4)]
        )
        for arguments, alarms in ([], 0), (["--verdict", "other"], 4), (["--verdict", "other.distal"], 4):
            self.assertEqual(self.counted("single", *arguments)[2:4], [4, alarms])

    def test_what_is_refused(self):
        row = row_of("v/1/0", [0.5, 0], {"doubt": 1})
        two = {**row, "verdict_figures": {"verdict.distal": {"doubt": 1}, "verdict.proximal": {"doubt": 2}}}
        older = {name: value for name, value in row.items() if name != "verdict_figures"}
        other = {name: value for name, value in row.items() if not name.endswith("axial_deg")}
        for name, one, sentence in (
            ("two", two, "the verdicts are verdict.distal, verdict.proximal; name one with --verdict"),
            ("older", older, "an older marrow wrote it, without the figures of verdicts; compare again"),
            ("other", other, "the metrics lack errors.distal.final.axial_deg; see --errors"),
        ):
            self.comparison(name, [one])
            self.assertEqual(self.tool(name, code=1), "fit_verdict: %s/cells.jsonl: %s\n" % (name, sentence))
        for arguments, sentence in (
            (["seen", "seen/../seen"], "seen/../seen is given twice, so its poses would count twice"),
            (["nowhere"], "nowhere/cells.jsonl; give folders of marrow compare"),
            (["seen", "--verdict", "other"], "no cell with a verdict; give folders of marrow compare"),
        ):
            self.assertIn(sentence, self.tool(*arguments, code=1))


if __name__ == "__main__":
    main()
