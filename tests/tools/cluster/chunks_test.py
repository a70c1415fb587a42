# SPDX-License-Identifier: Apache-2.0
"""Chunks of a comparison, run by one process after the other, by GNU parallel and by Snakemake: the same figures as
without chunks, also after tasks were killed and files damaged."""
import json
import shutil
import signal
import subprocess

from cluster_cases import CASES, MARROW, VARIANTS, Cluster, another_run_makes_all, main, wait_until

CELLS = CASES * VARIANTS
SIMULATION = """marrow: 1
nodes:
  chance: {uses: test.draw}
  letters: {uses: test.letters}
  s: {uses: test.add, in: {a: letters, b: chance}}
outputs: {case: s}
"""
SIMULATED = """experiment: 1
pipeline: p.yaml
cases: {simulate: {pipeline: s.yaml, seeds: 1..2}}
metrics: [number.value]
success: {number.value: 15}
timed_cells: 0
variants: {a: {m.value: 1}, b: {m.value: 2}}
"""


class Chunks(Cluster):
    def names(self, out):
        plan = self.plan(out)
        return [line for line in (plan.parent / (plan.stem + "-chunks.txt")).read_text().split("\n") if line]

    def chunk(self, out, name, code=0):
        return self.run_program(MARROW, "chunk", self.plan(out), name, "--quiet", code=code)

    def emit(self, out, program="parallel", cells=CELLS):
        said = self.compare(out, "--emit", program).stdout
        self.assertIn("%d cells are left, in " % cells, said)
        return said.split("run them by\n\n")[1].strip()

    tables = {}  # those of one machine, made once

    def setUp(self):
        super().setUp()
        names = ("cells.csv", "comparison.json")
        local = self.scratch / "local"
        if not self.tables:
            self.compare("local", "--quiet", "--shown", "0", MARROW_CACHE=str(self.scratch / "another"))
            self.tables.update({name: (local / name).read_text() for name in names})
            shutil.rmtree(local)
        local.mkdir()
        for name in names:
            (local / name).write_text(self.tables[name])

    def test_chunk_by_chunk(self):
        self.emit("out")
        names = self.names("out")
        # the nodes never ran, so a chunk is a case
        self.assertEqual(len(names), CASES)
        for name in names[:-1]:
            self.chunk("out", name)
        said = self.compare("out", "--gather", "--quiet", "--shown", "0", code=1).stderr
        self.assertIn("%d of %d cells are lost" % (VARIANTS, CELLS), said)
        figures = self.figures("out")
        lost = [cell for cell, row in figures.items() if row["status"] == "failed"]
        self.assertEqual(len(lost), VARIANTS)
        self.assertEqual({figures[cell]["reason"] for cell in lost}, {"no task left its row"})
        self.chunk("out", names[-1])
        said = self.compare("out", "--gather", "--quiet", "--shown", "0").stdout
        self.assertIn("%d were there already" % CELLS, said)
        self.expect_same("out", "local")
        self.assertIn("no cell is left", self.compare("out", "--emit", "parallel").stdout)
        # what a chunk wrote beside its rows is gone, and there are few files
        files = [path for path in (self.scratch / "out").rglob("*") if path.is_file()]
        self.assertEqual([path for path in files if "cells/" in str(path)], [])
        self.assertLess(len(files), 2 * CASES + 20)

    def test_without_gather_the_rest_runs_here(self):
        self.emit("out")
        self.chunk("out", self.names("out")[1])
        said = self.compare("out", "--quiet").stdout
        self.assertIn("%d were there already" % VARIANTS, said)
        self.expect_same("out", "local")

    def test_chunks_of_known_nodes_are_as_long_as_wished(self):
        self.compare("timed", "--quiet")  # into the same store
        shutil.rmtree(self.scratch / "cache")
        self.experiment("0.05")
        self.compare("timed", "--quiet", "--jobs", "2")
        self.experiment("0.051")
        said = self.compare("out", "--emit", "parallel", "--chunk-minutes", "1e6").stdout
        self.assertIn("%d cells are left, in 1 chunks" % CELLS, said)

    def test_parallel(self):
        self.run_program("sh", "-c", self.emit("out"))
        self.expect_same("out", "local")

    def test_snakemake(self):
        if not shutil.which("snakemake"):
            self.skipTest("there is no snakemake")
        home = self.scratch / "home"
        home.mkdir()
        self.run_program("sh", "-c", self.emit("out", "snakemake") + " --quiet", HOME=str(home), timeout=600)
        self.expect_same("out", "local")

    def test_a_killed_task_leaves_its_rows(self):
        self.experiment("0.3", variants=1, cases=1)
        self.compare("known", "--quiet", MARROW_CACHE=str(self.scratch / "other"))
        self.experiment("0.3", cases=1)
        self.emit("out", cells=VARIANTS)
        name = self.names("out")[0]
        rows = self.scratch / "out" / "rows"
        # Its store knows the first cell, and another run seems to make the others: the task waits until it is killed.
        with another_run_makes_all(self.scratch / "other"):
            process = subprocess.Popen(
                [MARROW, "chunk", self.plan("out"), name, "--quiet", "--jobs", "1"],
                env={**self.environment, "MARROW_CACHE": str(self.scratch / "other")},
            )
            self.addCleanup(process.wait)
            self.addCleanup(process.kill)  # where the test ends before
            wait_until(lambda: any("\n" in part.read_text() for part in rows.glob("*.part")), "no row came")
            process.send_signal(signal.SIGKILL)
            process.wait()
        (part,) = rows.glob("*.part")
        done = len(part.read_text().split("\n")) - 1
        part.write_text(part.read_text() + '{"half a li')  # the line that it was writing
        self.assertEqual(done, 1)
        self.chunk("out", name)
        lines = (rows / (name + ".jsonl")).read_text().split("\n")[:-1]
        self.assertEqual(len({json.loads(line)["id"] for line in lines}), VARIANTS)
        self.assertEqual(len(lines), VARIANTS)
        kept = [line for line in lines if line in part.read_text().split("\n")]
        self.assertGreaterEqual(len(kept), done)

    def test_simulated_cases_in_a_store_of_the_task(self):
        """The row of a task counts wherever its store is, because simulated cases are the same in each."""
        self.write("s.yaml", SIMULATION)
        self.file = self.write("e.yaml", SIMULATED)
        self.emit("out", cells=4)
        # "~" comes behind all other names, and "!" before: the order of paths must not count, either
        for name, store in zip(self.names("out"), ("~", "!")):
            self.run_program(MARROW, "chunk", self.plan("out"), name, "--quiet", MARROW_CACHE=str(self.scratch / store))
        said = self.compare("out", "--gather", "--quiet", "--shown", "0").stdout
        self.assertIn("4 were there already", said)

    def test_a_damaged_row_is_made_again(self):
        self.emit("out")
        for name in self.names("out"):
            self.chunk("out", name)
        file = self.scratch / "out" / "rows" / (self.names("out")[2] + ".jsonl")
        lines = file.read_text().split("\n")
        lines[5] = lines[5].replace('"values":[', '"values":[1')
        file.write_text("\n".join(lines))
        said = self.compare("out", "--quiet").stdout
        self.assertIn("%d were there already" % (CELLS - 1), said)
        self.expect_same("out", "local")

    def test_a_plugin_that_crashes_fails_its_cell_only(self):
        self.experiment(more=", crash: {m.how: crash}")
        self.compare("crashed", "--quiet", "--shown", "0", MARROW_CACHE=str(self.scratch / "another"))
        self.compare("out", "--emit", "parallel")
        for name in self.names("out"):
            self.chunk("out", name)
        self.compare("out", "--gather", "--quiet")
        figures = self.figures("out")
        self.assertEqual(len([1 for row in figures.values() if row["status"] == "failed"]), CASES)
        self.expect_same("out", "crashed")

    def refused(self, sentence, *command, code=2):
        result = self.run_program(*command, code=code)
        self.assertIn(sentence, result.stderr)

    def test_what_changed_since_the_plan(self):
        self.emit("out")
        name = self.names("out")[0]
        plan = self.plan("out")
        self.refused("the plan has no chunk 'x'; its chunks are " + name, MARROW, "chunk", plan, "x")
        again = "is not what it was when the plan was made; give the command that made the plan again"
        self.write("cases/0/data", "other")
        self.refused("cases/0 " + again, MARROW, "chunk", plan, name)
        self.write("cases/0/data", "case 0")
        self.chunk("out", name)
        self.experiment("0.02")
        self.refused("p.yaml " + again, MARROW, "chunk", plan, name)
        plan.write_text(plan.read_text().replace('"threads": 1', '"threads": 2'))
        self.refused("is no plan of a comparison: it was changed, or renamed", MARROW, "chunk", plan, name)
        plan.write_text("{")
        self.refused("is no plan of a comparison", MARROW, "chunk", plan, name)
        self.refused("is no plan of a comparison", MARROW, "chunk", self.scratch / "none.json", name)

    def test_words(self):
        missing = self.compare("new", "--status", code=2).stderr
        self.assertIn("there is no plan in", missing)
        self.emit("out")
        self.chunk("out", self.names("out")[0])
        said = self.compare("out", "--status").stdout
        self.assertIn("%d of %d cells in 1 of %d chunks" % (VARIANTS, CELLS, CASES), said)
        status = json.loads(self.compare("out", "--status", "--json").stdout)
        self.assertEqual(status["cells"], {"cells": CELLS, "cells_done": VARIANTS, "chunks": CASES, "chunks_done": 1})
        self.assertEqual((status["submitted"], status["cases_to_make"]["chunks"]), (False, 0))
        self.assertIn("requires --status", self.compare("out", "--json", code=2).stderr)
        self.assertIn("nothing was submitted from", self.compare("out", "--cancel", code=2).stderr)

    def test_profile(self):
        profile = self.write(
            "profile.yaml", "partition: a b\nminutes: 0\npartiton: x\nsetup: y\ntries: 2.5\nask_every_s: 0\n"
        )
        said = self.compare("out", "--emit", "snakemake", "--profile", profile, code=2).stderr
        for sentence in (
            "profile.yaml:1:1",
            "the profile lacks 'marrow-cluster: 1'",
            "'partition' may hold letters, digits and _ . , : / + @ - only, got 'a b'",
            "'minutes' must be from 1 to 1000000, got 0",
            "partiton",
            "'setup' must be a list of texts",
            "'tries'",
            "'ask_every_s' must be from 1 to 3600, got 0",
        ):
            self.assertIn(sentence, said)


if __name__ == "__main__":
    main()
