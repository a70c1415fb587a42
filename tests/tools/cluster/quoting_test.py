# SPDX-License-Identifier: Apache-2.0
"""Comparisons whose folders, files, variants and cases have names that mean something to shells, GNU parallel,
Snakemake or Slurm. All of them give the same bytes as one machine, nothing in a name is executed, and lost cells are
named, with an exit code that is not 0."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

from cluster_cases import CAN_START_CLUSTER, IN_A_CLUSTER, MARROW, PIPELINE, TEST_PLUGINS, Cluster, is_idle, main
from cluster_cases import run_in_cluster, wait_until

NAMES = {
    "a blank": "a b",
    "quotes": 'it\'s "so"',
    "braces": "{x} {} {#} {{y}} {wildcards.chunk}",
    "percent signs": "100%A %%j %",
    "a command": "$(touch executed)",
    "an old command": "`touch executed`",
    "Perl": '{= system("touch executed") =}',
    "a list": ";touch executed;&touch executed&|touch executed|",
    "patterns": "[x]*?",
    "a home": "~",
    "an option": "--version",
    "redirection": ">executed",
    "a variable": "$HOME !$",
    "a comment": "#a",
    "a line break": "a\nb",
    "a line break at its end": "a\n",
}
EVERYTHING = '- it\'s "so" {x}{}{#} %A%%j $(touch executed) `touch executed` ;touch executed; [x]*? ~ $HOME !\nend'
CASES = ["0 $(touch executed)", '1 {x} it\'s %A "so" `touch executed`\n;*~']
VARIANTS = ["a b", "$(touch executed)", "`touch executed`", "{x} {} 100%A %%j", 'it\'s "so"; *~#', "-v"]
CELLS = len(CASES) * len(VARIANTS)
SSH = """#!/bin/sh
# Stands for ssh: a login on another host, which has the same files but neither this folder nor these settings.
host=$1
shift
[ "$1" = -- ] && shift
echo "$host" >> "%s"
cd / && exec env -i SHELL=/bin/bash HOME="%s" PATH="$PATH" sh -c "$*"
"""
LOST = "cells are lost: no task left a row of them, and they count as failed."
CHANGED = "is not what it was when the plan was made; give the command that made the plan again"


def needs(program):
    return unittest.skipUnless(shutil.which(program), "there is no " + program)


class Quoting(Cluster):
    def make(self, name):
        """An experiment in a folder of this name, with files of this name in it."""
        self.name = name
        self.folder = self.scratch / ("folder" + str(len(list(self.scratch.iterdir())))) / name
        home = self.scratch / "home"
        for part in (self.folder / ("tmp" + name), self.folder / ("programs" + name), home):
            part.mkdir(parents=True, exist_ok=True)
        for i, case in enumerate(CASES):
            self.write(self.data_of(case), "case %d" % i)
        self.write(self.folder / (name + ".yaml"), "name: p\n" + PIPELINE % "0.01")
        variants = ", ".join("%s: {m.value: %d}" % (json.dumps(one), i) for i, one in enumerate(VARIANTS))
        self.file = self.write(
            self.folder / ("e" + name),
            "experiment: 1\nname: x\npipeline: %s\ncases: {folders: [cases*/*]}\nmetrics: [number.value]\n"
            "timed_cells: 0\nsuccess: {number.value: 4}\nvariants: {%s}\n" % (json.dumps(name + ".yaml"), variants),
        )
        self.program = MARROW
        if name == EVERYTHING:  # the program, too, has a place of this name
            self.program = self.folder / ("programs" + name) / "marrow"
            shutil.copy(MARROW, self.program)
        # Switches of the processor's features are in a result's key, and another host has none of them.
        usual = {name: value for name, value in os.environ.items() if not name.startswith(("OPENBLAS_", "MKL_"))}
        self.environment = {
            **usual,
            "HOME": str(home),
            "TMPDIR": str(self.folder / ("tmp" + name)),  # but GNU parallel refuses such a place
            "MARROW_PLUGIN_PATH": str(self.linked_plugins()),
            "MARROW_CACHE": "cache" + name,  # it starts at the folder in which the plan is made
            "MARROW_$(touch executed)": "a name that no setting has",
        }
        self.out = self.folder / ("out" + name)

    def data_of(self, case):
        return self.folder / ("cases" + self.name) / case / "data"

    def linked_plugins(self):
        place = self.folder / ("plugins" + self.name)
        place.symlink_to(TEST_PLUGINS)
        return place

    def compare_here(self, *arguments, out=None, code=0, **environment):
        words = ("compare", self.file, "--out", out or self.out, *arguments)
        return self.run_program(self.program, *words, code=code, **environment)

    def command(self, program, *arguments):
        said = self.compare_here("--emit", program, *arguments).stdout
        self.assertIn("%d cells are left, in %d chunks" % (CELLS, len(CASES)), said)
        command = said.split("run them by\n\n    ")[1]
        self.assertEqual(command.count("\n"), 2, "it must be one line")
        return command.strip()

    def paste(self, command, code=0, **environment):
        """Runs a command like a person who copies it, not in the folder of the plan."""
        elsewhere = self.scratch / "elsewhere"
        elsewhere.mkdir(exist_ok=True)
        result = subprocess.run(
            ["bash", "-c", command],
            env={**self.environment, **environment},
            cwd=elsewhere,
            capture_output=True,
            text=True,
            timeout=600,
        )
        self.assertEqual(result.returncode, code, command + "\n" + result.stdout + result.stderr)
        return result

    def expect_same_as_here(self):
        here = self.folder / "here"
        self.compare_here("--quiet", "--shown", "0", out=here, MARROW_CACHE=str(self.scratch / "another"))
        for table in ("cells.csv", "comparison.json"):
            self.assertEqual((self.out / table).read_bytes(), (here / table).read_bytes(), table)
        self.assertIn(b"done", (here / "cells.csv").read_bytes())
        self.assertNotIn(b",failed,", (here / "cells.csv").read_bytes())
        self.assertTrue((self.out / "report.html").exists())
        self.expect_nothing_executed()

    def expect_nothing_executed(self):
        places = [self.scratch, pathlib.Path.cwd()]
        if IN_A_CLUSTER:
            places.append(pathlib.Path(os.environ["CLUSTER_FOLDER"]))
        self.assertEqual([one for place in places for one in place.rglob("executed*")], [])
        self.assertFalse(pathlib.Path("/executed").exists())

    def lose_a_case(self):
        """From now on, tasks refuse the second case."""
        self.write(self.data_of(CASES[1]), "other")

    def expect_lost(self, result, *reasons, where="stderr"):
        """Half of the cells are lost, and named with their reasons. Tables and report have the others."""
        said = getattr(result, where)
        count = len(VARIANTS)
        self.assertIn("%d of %d %s" % (count, CELLS, LOST), said)
        lines = said.split(LOST)[1].split("\n")[1 : count + 1]
        for line, variant in zip(lines, VARIANTS):
            self.assertTrue(line.startswith("  %s/1 {x} " % variant), line)
            for reason in reasons:
                self.assertIn(reason, line)
        rows = self.figures(self.out)
        self.assertEqual(sorted(row["status"] for row in rows.values()), ["done"] * count + ["failed"] * count)
        self.assertTrue((self.out / "report.html").exists())
        self.expect_nothing_executed()


class OneMachine(Quoting):
    def test_commands_in_messages(self):
        self.make(EVERYTHING)
        said = self.run_program(MARROW, "run", self.file, code=2).stderr
        command = said.split("look at it by: marrow compare ")[1].strip()
        self.assertIn("%d cells" % CELLS, self.paste('"$MARROW" compare ' + command, MARROW=str(MARROW)).stdout)
        for place, code, answer in (
            ("{}", 0, "{}: good"),
            ("-{} it's $(touch executed) `touch executed`.yaml", 0, "`touch executed`.yaml: good"),
            ("~ ;touch executed;\n.yaml", 2, "cannot name a folder"),  # the pipeline, by its file, which was found
        ):
            made = self.run_program(MARROW, "new", "pipeline", "p", "--out=" + place, timeout=60).stdout
            command = 'cd "$SCRATCH" && "$MARROW" ' + made.split("\nmarrow ")[1]
            checked = self.paste(command, code, MARROW=str(MARROW), SCRATCH=str(self.scratch))
            self.assertIn(answer, checked.stdout + checked.stderr)
        self.expect_nothing_executed()

    def test_lost_cells(self):
        """The first 20 are named, and how many more there are. It is no success, and tables and report are written."""
        self.make("a b")
        self.compare_here("--emit", "parallel")
        said = self.compare_here("--gather", "--quiet", code=1).stderr
        self.assertIn("%d of %d %s" % (CELLS, CELLS, LOST), said)
        self.assertEqual(said.count(": no task left its row\n"), CELLS)
        more = ", ".join("v%d: {m.value: 1}" % i for i in range(5))
        self.write(self.file, self.read(self.file).replace("variants: {", "variants: {%s, " % more))
        self.compare_here("--emit", "parallel")
        said = self.compare_here("--gather", "--quiet", code=1).stderr
        self.assertIn("22 of 22 " + LOST, said)
        self.assertEqual(said.count(": no task left its row\n"), 20)
        self.assertIn("  and 2 more, in cells.csv\n", said)
        self.assertTrue((self.out / "report.html").exists())

    def test_cells_that_were_tried_are_not_lost(self):
        """Every cell fails, and the command says so, but each was tried."""
        self.make("a b")
        self.write(self.file, self.read(self.file).replace("m.value: ", "m.how: error, m.value: "))
        said = self.compare_here("--quiet").stdout
        self.assertIn("\nfailed cells\n  a b/0 $(touch executed)/", said)
        self.assertNotIn("lost", said)

    def test_reasons(self):
        self.make("a b")
        self.compare_here("--emit", "parallel")
        names = self.names(self.out)
        self.chunk(self.out, names[0])
        file = self.out / "rows" / (names[0] + ".jsonl")
        lines = self.read(file).split("\n")
        self.write(file, "\n".join([lines[0][:-20], *lines[1:]]))
        self.write(self.out / "rows" / (names[1] + ".host.part"), "")
        said = self.compare_here("--gather", "--quiet", code=1).stderr
        lacks = "rows/%s.jsonl has no undamaged row of it with its case and plugins as they are now"
        self.assertIn(lacks % names[0], said)
        self.assertIn("its task ended before it left its row, or it runs still", said)
        self.assertIn("%d of %d %s" % (len(VARIANTS) + 1, CELLS, LOST), said)


@needs("parallel")
class Parallel(Quoting):
    def make(self, name):
        super().make(name)
        del self.environment["TMPDIR"]

    def test_a_place_for_temporary_files_is_refused_in_words(self):
        """GNU parallel itself gives it to a shell, once for each new home."""
        for name in ("a b", "$(touch executed)", "a\nb"):
            self.make(name)
            said = self.paste(self.command("parallel"), code=2, TMPDIR=str(self.folder)).stderr
            self.assertIn("GNU parallel gives TMPDIR, %s, to a shell and does not quote it." % self.folder, said)
            self.assertFalse((self.out / "rows").exists())
            self.expect_nothing_executed()

    def test_names(self):
        for what, name in {**NAMES, "everything": EVERYTHING}.items():
            with self.subTest(what):
                self.make(name)
                self.paste(self.command("parallel"))
                self.expect_same_as_here()

    def test_other_hosts(self):
        self.make(EVERYTHING)
        asked = self.scratch / "asked"
        ssh = self.write("ssh", SSH % (asked, self.scratch / "home"))
        ssh.chmod(0o755)
        self.paste(self.command("parallel") + " -S one,two", PARALLEL_SSH=str(ssh))
        self.assertEqual(set(asked.read_text().split()), {"one", "two"})
        self.expect_same_as_here()

    def test_lost_cells(self):
        self.make(EVERYTHING)
        command = self.command("parallel")
        self.lose_a_case()
        self.expect_lost(self.paste(command, code=1), "no task left its row: the case ", CHANGED)


@needs("snakemake")
class Snakemake(Quoting):
    def test_names(self):
        for what in ("a blank", "braces", "a line break at its end"):
            with self.subTest(what):
                self.make(NAMES[what])
                self.paste(self.command("snakemake") + " --quiet")
                self.expect_same_as_here()

    def test_everything(self):
        self.make(EVERYTHING)
        self.paste(self.command("snakemake") + " --quiet")
        self.expect_same_as_here()

    def test_lost_cells(self):
        self.make(EVERYTHING)
        command = self.command("snakemake")
        self.lose_a_case()
        self.expect_lost(self.paste(command, code=1), "no task left its row: the case ", CHANGED)

    def test_executors_refuse_in_words(self):
        """Snakemake itself puts the folder's name into shells when it submits jobs."""
        self.make("a b")
        said = self.paste(self.command("snakemake") + " --cluster sh --jobs 1", code=1).stderr
        self.assertIn("Snakemake gives the name of the folder '%s' to a shell when it submits jobs" % self.out, said)
        self.assertIn("choose another folder with --out, or let Snakemake run on this machine, by --cores", said)
        self.assertFalse((self.out / "rows").exists())


@unittest.skipUnless(
    IN_A_CLUSTER, "a Slurm cluster needs root, and the packages slurmctld, slurmd, slurm-client, munge"
)
class Slurm(Quoting):
    def tearDown(self):
        subprocess.run(["scancel", "--user=root"], check=True)
        wait_until(is_idle, "the cluster goes on")
        super().tearDown()

    def submit(self, more="", code=0):
        profile = self.folder / ("profile" + self.name)
        profile.write_text("marrow-cluster: 1\nprocessors: 1\ntries: 1\nask_every_s: 2\n" + more)
        return self.compare_here("--on", "slurm", "--profile", profile, "--wait", code=code)

    def test_everything(self):
        self.make(EVERYTHING)
        self.submit()
        self.expect_same_as_here()
        self.assertEqual(len(list((self.out / "log").iterdir())), len(CASES) + 1)  # and that of the gathering job

    def test_lost_cells(self):
        """The second task prints why it cannot go on, and ends. The job that gathers has failed, too."""
        self.make(NAMES["percent signs"])
        setup = 'setup: [\'case "$1" in *-1) echo "no disk here" >&2; exit 3;; esac\']\n'
        result = self.submit(setup, code=1)
        self.expect_lost(result, "left no row: it ended with an error (FAILED): no disk here; see log/")
        self.assertIn("tables and report are made", self.compare_here("--status").stdout)
        self.expect_lost(self.compare_here("--status"), "no disk here", where="stdout")
        job = json.loads((self.out / "slurm.json").read_text())["gather"]
        self.assertIn(LOST, (self.out / "log" / (job + ".txt")).read_text())
        wait_until(is_idle, "the job that gathers goes on")  # the command ends once tables and report are made
        shown = subprocess.run(["scontrol", "show", "job", job], capture_output=True, text=True).stdout
        self.assertIn("ExitCode=1:0", shown)

    def test_a_fault_of_marrow_is_the_reason(self):
        self.make("a b")
        setup = "setup: ['case \"$1\" in *-1) echo other > %s;; esac']\n"
        link = self.scratch / "data"
        link.symlink_to(self.data_of(CASES[1]))
        self.expect_lost(self.submit(setup % link, code=1), "(FAILED): the case ", CHANGED)

    def test_a_backslash_is_refused_in_words(self):
        self.make("a\\b")
        said = self.submit(code=2).stderr
        self.assertIn("Slurm writes no logs into a folder with '\\' in its name, ", said)
        self.assertIn("choose another with --out", said)
        self.assertFalse((self.out / "slurm.json").exists())
        self.assertTrue(is_idle())


if __name__ == "__main__":
    if IN_A_CLUSTER or not CAN_START_CLUSTER:
        main()
    else:
        code = run_in_cluster()
        sys.exit(code) if code != 77 else main()  # 77: there is no cluster, but perhaps the other programs
