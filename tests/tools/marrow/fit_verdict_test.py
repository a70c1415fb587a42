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

    def run_tool(self, *arguments, said=None):
        """What it prints, or, if something is `said`, how it refuses."""
        command = [str(SOURCE / "tools/studies/fit_verdict"), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True)
        if said is None:
            self.assertEqual(done.returncode, 0, done.stderr)
            return done.stdout
        self.assertEqual((done.returncode, done.stderr), (1, "fit_verdict: %s\n" % said))

    def model(self, name, **more):
        """The file of a model whose log odds are those of the bias and log(1 + doubt)."""
        terms = [{"figure": "doubt", "scale": 1, "weight": 1, "absent": 0}]
        model = {"record": "", "bias": -1, "doubtful_above": 0.5, "wrong_above": 0.9, "terms": terms, **more}
        path = self.folder / (name + ".yaml")
        path.write_text(yaml.safe_dump(model))
        return path

    def counts(self, folder, model, *more):
        """Failed, trusted, right, not trusted, between, not trusted: of all poses."""
        printed = self.run_tool("--check", folder, "--model", model, *more)
        last = next(line for line in printed.splitlines() if line.startswith("all "))
        return [int(word) for word in last.split()[1:]]

    def test_fits_what_the_poses_were_drawn_from(self):
        model_file = self.folder / "model.yaml"
        self.run_tool(self.folder / "seen", "--write", model_file, "--ridge", "1e-6", "--record", "Drawn here.")
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
        # Probability 0.5 is at a doubt of e - 1.
        bad, good, silent, alarms = 0, 0, 0, 0
        for row in map(json.loads, (self.folder / "unseen/cells.jsonl").read_text().splitlines()):
            if row["status"] != "done" or row["case"] in ("between", "unknown", "nothing"):
                continue
            doubt = row["verdict_figures"]["verdict.distal"]["doubt"]
            failed = row["errors.distal.final.mtre_mm"] > 2 or row["errors.distal.final.axial_deg"] < -5
            bad, good = bad + failed, good + (not failed)
            silent, alarms = silent + (failed and doubt <= math.e - 1), alarms + (not failed and doubt > math.e - 1)
        counts = self.counts(self.folder / "unseen", self.model("by_hand", **{"marrow-failure-model": 1}))
        self.assertEqual(counts, [bad, silent, good, alarms, 1, 1])

    def threshold(self, name, right, failed, *arguments, wrong_above=0.9):
        """The threshold that is chosen for poses with these log odds."""
        folder = self.folder / name
        errors = [(odds, 0.5) for odds in right] + [(odds, 3) for odds in failed]
        write_rows(
            folder,
            [row_of("v/%d/0" % i, [mm, 0], {"doubt": math.expm1(odds + 5)}) for i, (odds, mm) in enumerate(errors)],
        )
        model_file = self.model(name, record="Before", bias=-5, wrong_above=wrong_above)
        terms = yaml.safe_load(model_file.read_text())["terms"]
        printed = self.run_tool("--threshold", folder, "--model", model_file, "--record", "And after.", *arguments)
        model = yaml.safe_load(model_file.read_text())
        self.assertEqual((model["record"], model["terms"]), ("Before. And after.", terms))
        self.assertIn("doubtful_above: %s, before 0.5" % model["doubtful_above"], printed)
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
        self.run_tool(self.folder / "alike", "--write", model_file, "--false-alarms", "0")
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
        # log odds are -1 + log 2 < 0 and -1: none is doubtful, so all ten failures are trusted
        self.assertEqual(self.counts(self.folder / "mixed", self.model("one_term")), [10, 10, 10, 0, 0, 0])

    def test_a_verdict_that_is_one_file(self):
        rows = [row_of("v/%d/0" % i, [0.5, 0], {}) for i in range(4)]
        for row in rows:
            row["verdict_figures"] = {"verdict": {"doubt": 1}, "other.distal": {"doubt": 2}}
        write_rows(self.folder / "single", rows)
        for arguments in ([], ["--verdict", "other"], ["--verdict", "other.distal"]):
            counts = self.counts(self.folder / "single", self.model("single"), *arguments)
            self.assertEqual(counts[2:4], [4, 4 if arguments else 0])

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
            self.run_tool(self.folder / name, said="%s: %s" % (self.folder / name / "cells.jsonl", sentence))
        twice, nowhere = self.folder / "seen/../seen", self.folder / "nowhere"
        for folders, sentence in (
            ([self.folder / "seen", twice], "%s is given twice, so its poses would count twice" % twice),
            ([nowhere], "there is no %s/cells.jsonl; give folders of marrow compare" % nowhere),
            ([self.folder / "seen", "--verdict", "other"], "no cell with a verdict; give folders of marrow compare"),
        ):
            self.run_tool(*folders, said=sentence)


if __name__ == "__main__":
    unittest.main()
