# SPDX-License-Identifier: Apache-2.0
"""Options that take a number take no other text for one."""
import json

from harness import TEST_PLUGINS
from harness.program import Case, main, marrow

PIPELINE = "marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs: {number: c}\n"
LARGEST_SEED = 2**64 - 1
NO_WHOLE_NUMBERS = (
    "-1",
    "-0",
    "+1",
    str(2**64),
    "1" + 23 * "0",
    "010",
    "0x10",
    "1e3",
    "1.5",
    "1 ",
    " 1",
    "1,000",
    "abc",
    "nan",
    "",
)
NO_AMOUNTS = ("nan", "inf", "-inf", "1e30", "1e400", "-5", "0", "1e-9", "0x10", "0,5", "5 MB", "+5", "abc", "")
AMOUNT = "but must be a number of %s from 0.001 to 1000000000"
EMPTY = "a word after '%s' is empty"


class Numbers(Case):
    def marrow(self, *arguments):
        return marrow(*arguments, plugins=[TEST_PLUGINS], cwd=self.scratch)

    def refuse(self, sentence, *arguments):
        result = self.marrow(*arguments)
        self.assertEqual(result.returncode, 2, arguments)
        self.assertIn(sentence, result.stderr, arguments)
        self.assertEqual(sorted(path.name for path in self.scratch.iterdir()), ["p.yaml"], "nothing is made")

    def test_a_seed_is_the_number_that_was_written(self):
        self.write("p.yaml", PIPELINE)
        for command in ("run", "plan"):
            for wrong in NO_WHOLE_NUMBERS:
                self.refuse(
                    EMPTY % "--seed"
                    if not wrong
                    else "--seed is '%s', but must be a whole number from 0 to %d" % (wrong, LARGEST_SEED),
                    command,
                    "p.yaml",
                    "--seed",
                    wrong,
                )
        for good in (0, 8, LARGEST_SEED):
            out = self.scratch / ("out-%d" % good)
            self.assertEqual(self.marrow("run", "p.yaml", "--seed", good, "--out", out, "--quiet").returncode, 0)
            self.assertEqual(json.loads((out / "run.json").read_text())["seed"], good)

    def test_counts_have_bounds(self):
        self.write("p.yaml", PIPELINE)
        for command, option, least, most in (
            ("run", "--threads", 1, 1024),
            ("compare", "--threads", 1, 1024),
            ("cell", "--threads", 1, 1024),
            ("compare", "--jobs", 1, 1024),
            ("compare", "--shown", 0, 10000),
        ):
            for wrong in (least - 1, most + 1, 2**32 + 1, "08", "0x8", "1.5"):
                self.refuse(
                    "%s is '%s', but must be a whole number from %d to %d" % (option, wrong, least, most),
                    command,
                    "p.yaml",
                    option,
                    wrong,
                )

    def test_limits_are_finite_and_more_than_nothing(self):
        self.write("p.yaml", PIPELINE)
        for command, option, unit in (
            ("run", "--file-memory", "megabytes"),
            ("run", "--file-seconds", "seconds"),
            ("compare", "--file-memory", "megabytes"),
            ("compare", "--time-limit", "seconds"),
            ("compare", "--memory-limit", "megabytes"),
        ):
            for wrong in NO_AMOUNTS:
                sentence = "%s is '%s', %s" % (option, wrong, AMOUNT % unit) if wrong else EMPTY % option
                self.refuse(sentence, command, "p.yaml", option, wrong)
        self.assertEqual(
            self.marrow(
                "run", "p.yaml", "--file-memory", "1e3", "--file-seconds", "2.5", "--out", "out", "--quiet"
            ).returncode,
            0,
        )

    def test_the_help_says_what_holds_without_them(self):
        self.assertRegex(self.marrow("run", "--help").stdout, r"--seed WHOLE NUMBER[= ]\[?1\b")
        self.assertRegex(self.marrow("compare", "--help").stdout, r"--time-limit NUMBER[= ]\[?600\b")
        self.assertRegex(self.marrow("cache", "gc", "--help").stdout, r"--keep-gb NUMBER[= ]\[?10\b")


if __name__ == "__main__":
    main()
