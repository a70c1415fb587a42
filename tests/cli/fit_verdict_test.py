# SPDX-License-Identifier: Apache-2.0
"""tools/fit_verdict on comparisons that are made here, whose probabilities are known."""
import csv
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

import yaml

ROOT = pathlib.Path(sys.argv[1])


def comparison(folder, cells, seed):
    """Poses that fail with log odds of 4 log(1 + doubt) - 4; the figure `noise` says nothing."""
    chance = random.Random(seed)
    folder.mkdir()
    with open(folder / "cells.csv", "w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(
            ["cell", "variant", "case", "status", "errors.distal.final.mtre_mm", "errors.distal.final.axial_deg"]
        )
        for i in range(cells):
            doubt = chance.expovariate(0.5)
            failed = chance.random() < 1 / (1 + math.exp(4 - 4 * math.log1p(doubt)))
            # Every other failure is one of the axial rotation alone.
            errors = [3, 0] if failed and i % 2 else [1, -6] if failed else [0.9, 2]
            cell = "%s/seed-%d/0" % ("odd" if i % 2 else "even", i // 2)
            table.writerow([cell, cell.split("/")[0], cell.split("/")[1], "done", *errors])
            outputs = folder / "cells" / cell / "outputs/verdict"
            outputs.mkdir(parents=True)
            figures = [{"name": "doubt", "value": doubt}, {"name": "noise", "value": chance.random()}]
            (outputs / "distal.yaml").write_text(yaml.safe_dump({"figures": figures}))
        # Neither right nor failed: it is not fitted to.
        between = folder / "cells/odd/between/0/outputs/verdict"
        between.mkdir(parents=True)
        (between / "distal.yaml").write_text(yaml.safe_dump({"figures": [{"name": "doubt", "value": 1e6}]}))
        table.writerow(["odd/between/0", "odd", "between", "done", 1.5, 0])
        table.writerow(["odd/seed-0/1", "odd", "seed-0", "failed", "", ""])


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
        return subprocess.run([str(ROOT / "tools/fit_verdict"), *map(str, arguments)], capture_output=True, text=True)

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
        with open(self.folder / "unseen/cells.csv", newline="") as stream:
            for row in csv.DictReader(stream):
                if row["status"] != "done" or row["case"] == "between":
                    continue
                verdict = self.folder / "unseen/cells" / row["cell"] / "outputs/verdict/distal.yaml"
                doubt = yaml.safe_load(verdict.read_text())["figures"][0]["value"]
                failed = (
                    float(row["errors.distal.final.mtre_mm"]) > 2 or float(row["errors.distal.final.axial_deg"]) < -5
                )
                bad, good = bad + failed, good + (not failed)
                silent, alarms = silent + (failed and doubt <= math.e - 1), alarms + (not failed and doubt > math.e - 1)
        last = next(line for line in done.stdout.splitlines() if line.startswith("all "))
        self.assertEqual([int(word) for word in last.split()[1:]], [bad, silent, good, alarms, 1, 1])
        self.assertTrue((self.folder / "roc.svg").read_text().startswith("<svg"))

    def threshold(self, name, right, failed, *arguments):
        """The threshold that is chosen for poses with these log odds."""
        folder = self.folder / name
        folder.mkdir()
        rows = [(odds, 0.5) for odds in right] + [(odds, 3) for odds in failed]
        with open(folder / "cells.csv", "w", newline="") as stream:
            table = csv.writer(stream)
            table.writerow(
                ["cell", "variant", "case", "status", "errors.distal.final.mtre_mm", "errors.distal.final.axial_deg"]
            )
            for i, (odds, error_mm) in enumerate(rows):
                table.writerow(["v/%d/0" % i, "v", "%d" % i, "done", error_mm, 0])
                outputs = folder / ("cells/v/%d/0/outputs/verdict" % i)
                outputs.mkdir(parents=True)
                doubt = {"name": "doubt", "value": math.expm1(odds + 5)}
                (outputs / "distal.yaml").write_text(yaml.safe_dump({"figures": [doubt]}))
        model_file = folder / "model.yaml"
        terms = [{"figure": "doubt", "scale": 1, "weight": 1, "absent": 0}]
        model_file.write_text(
            yaml.safe_dump({"record": "Before", "bias": -5, "doubtful_above": 0.5, "wrong_above": 0.9, "terms": terms})
        )
        done = self.run_tool("--threshold", folder, "--model", model_file, "--record", "And after.", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        model = yaml.safe_load(model_file.read_text())
        self.assertEqual((model["record"], model["terms"]), ("Before. And after.", terms))
        self.assertIn("doubtful_above: %g, before 0.5" % model["doubtful_above"], done.stdout)
        return model["doubtful_above"]

    def test_the_threshold_of_doubt_is_what_the_allowed_share_of_right_poses_exceeds(self):
        right = [-6 + 0.05 * i for i in range(101)]  # log odds
        chosen = self.threshold("some", right, [-3, 1], "--false-alarms", "0.05")
        self.assertAlmostEqual(chosen, 1 / (1 + math.exp(6 - 0.05 * 95)), places=3)
        self.assertEqual(self.threshold("high", [-3] * 10 + [9], [1], "--false-alarms", "0"), 0.9)

    def test_says_what_is_missing(self):
        done = self.run_tool(self.folder / "seen", "--verdict", "other")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("no cell with a verdict; give folders of marrow compare", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
