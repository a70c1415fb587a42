# SPDX-License-Identifier: Apache-2.0
"""What is said to a person who types a command wrong, or gives it another thing than it takes."""
import json

from compare_cases import Compared
from harness import SOURCE
from harness.program import main

PIPELINE = "p.yaml: this is a pipeline, not %s; run it by: marrow run p.yaml"
EXPERIMENT = "e.yaml: this is an experiment, not %s; look at it by: marrow compare e.yaml --dry-run"
RUN = "run: this is the folder of a run, not %s; look at it by: marrow show run; repeat it by: marrow rerun run"
COMPARISON = (
    "comparison: this is the folder of a comparison, not %s; its report is comparison/report.html, its cells are runs "
    "(cells/VARIANT/CASE/START), and this continues it: marrow compare EXPERIMENT --out comparison"
)
CASE = "cases/0: this is the folder of a case, not %s; give it to a pipeline: marrow run PIPELINE case=cases/0"
FILE = "run/run.json: this is a file of a run, not %s; give the folder: run"
WITHOUT_DASHES = "an input of the pipeline is given without dashes, as  "


class Mistakes(Compared):
    def said(self, *arguments):
        """The one sentence for which nothing is done."""
        result = self.expect(2, *arguments)
        self.assertEqual(result.stdout, "")
        (line,) = result.stderr.splitlines()
        self.assertTrue(line.startswith("marrow: error: "), line)
        return line[len("marrow: error: ") :]

    def test_commands_and_options(self):
        for words, said in (
            ("chek", "there is no command 'chek'; did you mean 'check'?"),
            ("rnu p.yaml --quiet", "there is no command 'rnu'; did you mean 'run'?"),
            ("chek --help", "there is no command 'chek'; did you mean 'check'?"),
            ("cache inof", "'cache' has no command 'inof'; did you mean 'info'?"),
            ("new nodes x", "'new' has no command 'nodes'; did you mean 'node'?"),
            ("run p.yaml --case=x", "'run' has no option '--case'; " + WITHOUT_DASHES + "case=x"),
            ("check p.yaml --case x", "'check' has no option '--case'; " + WITHOUT_DASHES + "case=VALUE"),
            ("plan -case=x p.yaml", "'plan' has no option '-case'; " + WITHOUT_DASHES + "case=x"),
            (
                "run p.yaml --thread=3",
                "'run' has no option '--thread'; did you mean '--threads'? An" + WITHOUT_DASHES[2:] + "thread=3",
            ),
            (
                "compare e.yaml --dryrun",
                "'compare' has no option '--dryrun'; did you mean '--dry-run'? An"
                + WITHOUT_DASHES[2:]
                + "dryrun=VALUE",
            ),
            ("cache gc --keep=3", "'gc' has no option '--keep'; did you mean '--keep-gb'?"),
            ("cache gc --everything", "'gc' has no option '--everything'; known: those that --help shows"),
            ("--quiet run p.yaml", "'marrow' has no option '--quiet'; options of a command stand after its name"),
        ):
            with self.subTest(words):
                self.assertEqual(self.said(*words.split()), said)
        self.assertRegex(self.said("p.yaml"), r"^there is no command 'p.yaml'; known: run, compare, ")
        self.assertNotIn("worker", self.said("workr"), "it is for the program itself")

    def test_other_things_than_the_command_takes(self):
        self.expect(0, "run", "p.yaml", "case=cases/0", "--out", "run")
        self.compare(out="comparison")
        self.write("cases/0/case.yaml", "marrow-case: 1\n")
        before = self.everything()
        for wanted, commands, others in (
            (
                *("a pipeline", (["run"], ["check"], ["plan"], ["graph"], ["watch"], ["list", "--fits"])),
                (EXPERIMENT, RUN, COMPARISON, CASE),
            ),
            ("an experiment", (["compare"], ["cell"]), (PIPELINE, RUN, COMPARISON, CASE)),
            (*("the folder of a run", (["show"], ["rerun"], ["diff"])), (PIPELINE, EXPERIMENT, COMPARISON, CASE, FILE)),
        ):
            for command in commands:
                more = {"cell": ["a/0/0"], "list": ["m"], "diff": ["run"]}.get(command[0], [])
                for other in others:
                    with self.subTest(command=command, other=other):
                        given = other[: other.index(":")]
                        self.assertEqual(self.said(*command, given, *more), other % wanted)
        self.assertEqual(self.said("open", "e.yaml"), EXPERIMENT % "a pipeline")
        self.assertEqual(self.everything(), before, "nothing is made")
        self.assertEqual(
            self.said("check", SOURCE / "pipelines" / "wrist" / "radius-0002.pose.yaml").split(": ", 1)[1],
            "this is a file of the format marrow-pose, not a pipeline; a pipeline names it in an option or an input",
        )

    def test_a_start_that_fails_leaves_no_folder(self):
        self.write("bad", "refuse")
        self.write(
            "mine.yaml",
            "marrow: 1\ninputs: {x: {type: path}}\nnodes:\n  f: {uses: parse.test_number, with: {path: $x}}\n"
            "  a: {uses: test.add, in: {a: f}}\noutputs: {a: a}\n",
        )
        bad = ["run", "mine.yaml", "x=bad"]
        before = {path.name for path in self.scratch.iterdir()}
        result = self.expect(1, *bad)
        self.assertIn("node 'f'", result.stderr)
        self.assertIn("nothing was made, so no folder of results is kept\n", result.stdout)
        self.assertEqual({path.name for path in self.scratch.iterdir()} - before, {"cache"})
        said = self.expect(1, *bad, "--json").stdout
        self.assertEqual(json.loads(said.splitlines()[-1])["folder"], "")
        self.write("good", "3")
        self.expect(0, "run", "mine.yaml", "x=good")
        self.expect(1, *bad)
        self.write("good", "refuse")
        self.expect(1, "rerun", "runs/mine")
        self.assertEqual([path.name for path in (self.scratch / "runs").iterdir()], ["mine"])
        self.expect(1, *bad, "--out", "asked")
        self.assertTrue((self.scratch / "asked" / "run.json").exists(), "it was asked for")

    def test_a_long_word_is_no_format(self):
        for text in ("marrow-" + 3_000_000 * "a" + ": 1\n", "marrow" + 3_000_000 * " " + ": 1\n"):
            self.write("long.yaml", text)
            self.assertIn("long.yaml", self.expect(2, "check", "long.yaml").stderr)

    def test_tabs(self):
        for text, line in (
            ("marrow: 1\nnodes:\n\tc: {uses: test.constant}\noutputs: {o: c}\n", 3),
            ("marrow: 1\nnodes:\n  c:\n\t\tuses: test.constant\noutputs: {o: c}\n", 4),
            ("marrow: 1\nnodes:\n  c:\n    uses: test.constant\n\twith: {value: 3}\noutputs: {o: c}\n", 5),
            ("marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs:\n\t- c\n", 5),
        ):
            for command, content in (("check", text), ("compare", text.replace("marrow: 1", "experiment: 1"))):
                self.write("tabs.yaml", content)
                said = "tabs.yaml:%d:1: error: not valid YAML: a tab indents this line; write spaces" % line
                self.assertIn(said, self.expect(2, command, "tabs.yaml").stderr)


if __name__ == "__main__":
    main()
