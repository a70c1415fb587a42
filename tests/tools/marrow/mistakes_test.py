# SPDX-License-Identifier: Apache-2.0
"""What is said to a person who types a command wrong, or gives it another thing than it takes."""
import json
import re

from compare_cases import Comparison
from harness import SOURCE
from harness.program import main, marrow

NUMBER = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"


class Mistakes(Comparison):
    def said(self, *arguments):
        """The one sentence for which nothing is done."""
        result = self.marrow(2, *arguments)
        self.assertEqual(result.stdout, "")
        lines = result.stderr.splitlines()
        self.assertEqual(len(lines), 1, result.stderr)
        self.assertTrue(lines[0].startswith("marrow: error: "), result.stderr)
        return lines[0][len("marrow: error: ") :]

    def test_version(self):
        version = re.search(r"project\(marrow VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
        result = marrow("--version")
        self.assertEqual((result.returncode, result.stdout), (0, "marrow %s\n" % version))

    def test_commands_at_all_levels(self):
        self.assertEqual(self.said("chek"), "there is no command 'chek'; did you mean 'check'?")
        self.assertEqual(self.said("rnu", "p.yaml", "--quiet"), "there is no command 'rnu'; did you mean 'run'?")
        self.assertEqual(self.said("chek", "--help"), "there is no command 'chek'; did you mean 'check'?")
        self.assertEqual(self.said("cache", "inof"), "'cache' has no command 'inof'; did you mean 'info'?")
        self.assertEqual(self.said("new", "nodes", "x"), "'new' has no command 'nodes'; did you mean 'node'?")
        self.assertRegex(self.said("p.yaml"), r"^there is no command 'p.yaml'; known: run, compare, ")
        self.assertNotIn("worker", self.said("workr"), "it is for the program itself")

    def test_options(self):
        self.assertEqual(
            self.said("run", "p.yaml", "--case=x"),
            "'run' has no option '--case'; an input of the pipeline is given without dashes, as  case=x",
        )
        self.assertEqual(
            self.said("check", "p.yaml", "--case", "x"),
            "'check' has no option '--case'; an input of the pipeline is given without dashes, as  case=VALUE",
        )
        self.assertEqual(
            self.said("plan", "-case=x", "p.yaml"),
            "'plan' has no option '-case'; an input of the pipeline is given without dashes, as  case=x",
        )
        self.assertEqual(
            self.said("run", "p.yaml", "--thread=3"),
            "'run' has no option '--thread'; did you mean '--threads'? An input of the pipeline is given without "
            "dashes, as  thread=3",
        )
        self.assertEqual(
            self.said("compare", "e.yaml", "--dryrun"),
            "'compare' has no option '--dryrun'; did you mean '--dry-run'? An input of the pipeline is given without "
            "dashes, as  dryrun=VALUE",
        )
        self.assertEqual(self.said("cache", "gc", "--keep=3"), "'gc' has no option '--keep'; did you mean '--keep-gb'?")
        self.assertEqual(
            self.said("cache", "gc", "--everything"),
            "'gc' has no option '--everything'; known: those that --help shows",
        )
        self.assertEqual(
            self.said("--quiet", "run", "p.yaml"),
            "'marrow' has no option '--quiet'; options of a command stand after its name",
        )

    def test_other_things_than_the_command_takes(self):
        self.marrow(0, "run", "p.yaml", "case=cases/0", "--out", "run")
        self.marrow(0, "compare", "e.yaml", "--out", "comparison")
        self.write("cases/0/case.yaml", "marrow-case: 1\n")
        before = sorted(self.scratch.rglob("*"))
        a_pipeline = "p.yaml: this is a pipeline, not %s; run it by: marrow run p.yaml"
        an_experiment = "e.yaml: this is an experiment, not %s; look at it by: marrow compare e.yaml --dry-run"
        a_run = (
            "run: this is the folder of a run, not %s; look at it by: marrow show run; repeat it by: marrow rerun run"
        )
        a_comparison = (
            "comparison: this is the folder of a comparison, not %s; its report is comparison/report.html, its cells "
            "are runs (cells/VARIANT/CASE/START), and this continues it: marrow compare EXPERIMENT --out comparison"
        )
        a_case = (
            "cases/0: this is the folder of a case, not %s; give it to a pipeline: marrow run PIPELINE case=cases/0"
        )
        a_file = "run/run.json: this is a file of a run, not %s; give the folder: run"
        for wanted, commands, others in (
            (
                "a pipeline",
                (["run"], ["check"], ["plan"], ["graph"], ["watch"], ["list", "--fits"]),
                (an_experiment, a_run, a_comparison, a_case),
            ),
            ("an experiment", (["compare"], ["cell"]), (a_pipeline, a_run, a_comparison, a_case)),
            (
                "the folder of a run",
                (["show"], ["rerun"], ["diff"]),
                (a_pipeline, an_experiment, a_comparison, a_case, a_file),
            ),
        ):
            for command in commands:
                more = {"cell": ["a/0/0"], "list": ["m"], "diff": ["run"]}.get(command[0], [])
                for other in others:
                    with self.subTest(command=command, other=other):
                        given = other[: other.index(":")]
                        self.assertEqual(self.said(*command, given, *more), other % wanted)
        self.assertEqual(self.said("open", "e.yaml"), an_experiment % "a pipeline")
        self.assertEqual(sorted(self.scratch.rglob("*")), before, "nothing is made")
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
        before = sorted(self.scratch.glob("*"))
        result = self.marrow(1, "run", "mine.yaml", "x=bad")
        self.assertIn("node 'f'", result.stderr)
        self.assertIn("nothing was made, so no folder of results is kept\n", result.stdout)
        self.assertEqual([path.name for path in sorted(self.scratch.glob("*")) if path not in before], ["cache"])
        said = self.marrow(1, "run", "mine.yaml", "x=bad", "--json").stdout
        self.assertEqual(json.loads(said.splitlines()[-1])["folder"], "")
        self.write("good", "3")
        self.marrow(0, "run", "mine.yaml", "x=good")
        self.marrow(1, "run", "mine.yaml", "x=bad")
        self.assertEqual([path.name for path in (self.scratch / "runs").iterdir()], ["mine"])
        self.write("good", "refuse")
        self.marrow(1, "rerun", "runs/mine")
        self.assertEqual([path.name for path in (self.scratch / "runs").iterdir()], ["mine"])
        self.marrow(1, "run", "mine.yaml", "x=bad", "--out", "asked")
        self.assertTrue((self.scratch / "asked" / "run.json").exists(), "it was asked for")

    def test_a_long_word_is_no_format(self):
        for text in ("marrow-" + 3_000_000 * "a" + ": 1\n", "marrow" + 3_000_000 * " " + ": 1\n"):
            self.write("long.yaml", text)
            self.assertIn("long.yaml", self.marrow(2, "check", "long.yaml").stderr)

    def test_tabs(self):
        for text, line in (
            ("marrow: 1\nnodes:\n\tc: {uses: test.constant}\noutputs: {o: c}\n", 3),
            ("marrow: 1\nnodes:\n  c:\n\t\tuses: test.constant\noutputs: {o: c}\n", 4),
            ("marrow: 1\nnodes:\n  c:\n    uses: test.constant\n\twith: {value: 3}\noutputs: {o: c}\n", 5),
            ("marrow: 1\nnodes:\n  c: {uses: test.constant}\noutputs:\n\t- c\n", 5),
        ):
            path = self.write("tabs.yaml", text)
            for command in ("check", "compare"):
                self.write("tabs.yaml", text if command == "check" else text.replace("marrow: 1", "experiment: 1"))
                result = self.marrow(2, command, path)
                self.assertRegex(
                    result.stderr,
                    r"tabs\.yaml:%d:1: error: not valid YAML: a tab indents this line; write spaces" % line,
                )


if __name__ == "__main__":
    main()
