# SPDX-License-Identifier: Apache-2.0
"""A dry run says which differences the cases show, and how many cases a difference takes."""
import re
import statistics

from harness.given_cases import GivenCase
from harness.program import main

NORMAL = statistics.NormalDist()
PLAIN = [1 + 0.1 * i for i in range(8)]
DIFFERENCES = [0.1, 0.3, 0.2, 0.4, 0.2, 0.1, 0.3, 0.2]
SPREAD = statistics.stdev(DIFFERENCES)  # 0.1035
OTHERS = [one + more for one, more in zip(PLAIN, DIFFERENCES)]
DRY = ["compare", "e.yaml", "--out", "out", "--dry-run"]


class Needed(GivenCase):
    def test_what_the_cases_show_and_how_many_others_take(self):
        self.write_cases({name: ["%.3f mm" % value for value in ones] for name, ones in (("a", PLAIN), ("b", OTHERS))})
        self.experiment(["a", "b"])
        self.assertIn(
            "which differences these cases show is known when three cases are done with two variants\n"
            "a difference of 0.1 in figures.err: how many cases it takes is known when three cases are done with two"
            " variants\n",
            self.printed(*DRY, "--difference", "0.1"),
        )
        first = self.expect(0, "compare", "e.yaml", "--out", "out").stderr.splitlines()[0]
        self.assertEqual(first, "  0 of 16 cells", "before the first cell ends")
        said = self.printed(*DRY, "--difference", "0.05", "--difference", "figures.err=0.2")
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
        self.write_cases({"a": ["1 mm"], "b": ["2 mm"]})
        self.experiment(["a", "b"])
        said = "--difference: '%s' is no difference; write an amount above 0 in the figure's unit"
        unknown = "--difference: the experiment has no figure 'figures.er'; did you mean 'figures.err'?"
        wants_dry = "--difference says how many cases a difference takes, without running any; add --dry-run"
        self.refusals(
            (unknown, *DRY, "--difference", "figures.er=0.1"),
            *((said % text, *DRY, "--difference", text) for text in ("much", "0", "-1", "figures.err=", "nan")),
            (wants_dry, "compare", "e.yaml", "--difference", "1"),
        )


if __name__ == "__main__":
    main()
