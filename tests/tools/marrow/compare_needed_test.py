# SPDX-License-Identifier: Apache-2.0
"""A dry run says which differences the cases show, and how many cases a difference takes."""
import re
import statistics

from harness.given_cases import GivenCase
from harness.program import main

NORMAL = statistics.NormalDist()
DIFFERENCES = [0.1, 0.3, 0.2, 0.4, 0.2, 0.1, 0.3, 0.2]
SPREAD = statistics.stdev(DIFFERENCES)  # 0.1035


class Needed(GivenCase):
    def values(self):
        plain = [1 + 0.1 * i for i in range(8)]
        pairs = zip(plain, DIFFERENCES)
        return {"a": ["%.3f mm" % one for one in plain], "b": ["%.3f mm" % (one + more) for one, more in pairs]}

    def dry_run(self, *arguments, code=0):
        result = self.marrow("compare", self.scratch / "e.yaml", "--out", "out", "--dry-run", *arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        return result

    def test_nothing_is_known_before_cells_are_done(self):
        self.write_cases(self.values())
        self.experiment(["a", "b"])
        self.assertIn(
            "which differences these cases show is known when three cases are done with two variants\n"
            "a difference of 0.1 in figures.err: how many cases it takes is known when three cases are done with two"
            " variants\n",
            self.dry_run("--difference", "0.1").stdout,
        )

    def test_what_the_cases_show_and_how_many_others_take(self):
        self.compare(self.values())
        said = self.dry_run("--difference", "0.05", "--difference", "figures.err=0.2").stdout
        self.assertIn(
            "differences that 8 cases show with a probability of about 80 %, by the cells that are done:\n", said
        )
        found = re.search(r"  figures.err: (\S+) mm; differences scatter by 0.1 mm over 8 cases, b against a\n", said)
        self.assertIsNotNone(found, said)
        # Eight cases must all agree, so it is Phi(d / spread)^8 = 0.8; 1000 experiments know that to a few percent.
        self.assertAlmostEqual(float(found[1]), SPREAD * NORMAL.inv_cdf(0.8 ** (1 / 8)), delta=0.012)
        # 0.483 spreads: Noether's formula (J Am Stat Assoc 1987) says 58 cases
        takes = re.search(
            r"a difference of 0.05 mm in figures.err takes about (\d+) cases, \S+ s of work in all\n", said
        )
        self.assertLess(abs(int(takes[1]) - 58), 12, said)
        takes = re.search(r"a difference of 0.2 mm in figures.err takes about (\d+) cases, ", said)
        self.assertIn(int(takes[1]), range(6, 13), said)

    def test_what_is_no_difference(self):
        self.write_cases(self.values())
        self.experiment(["a", "b"])
        told = self.dry_run("--difference", "figures.er=0.1", code=2).stderr
        self.assertIn("--difference: the experiment has no figure 'figures.er'; did you mean 'figures.err'?", told)
        for text in ("much", "0", "-1", "figures.err=", "nan"):
            told = self.dry_run("--difference", text, code=2).stderr
            self.assertIn(
                "--difference: '%s' is no difference; write an amount above 0 in the figure's unit" % text, told
            )
        result = self.marrow("compare", self.scratch / "e.yaml", "--difference", "1")
        self.assertEqual(result.returncode, 2)
        self.assertIn(
            "--difference says how many cases a difference takes, without running any; add --dry-run", result.stderr
        )

    def test_the_first_line_comes_before_the_first_cell_ends(self):
        self.write_cases(self.values())
        result = self.marrow("compare", self.experiment(["a", "b"]), "--out", "out")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr.splitlines()[0], "  0 of 16 cells")


if __name__ == "__main__":
    main()
