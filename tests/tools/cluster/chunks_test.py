# SPDX-License-Identifier: Apache-2.0
"""Chunks of a comparison, run by one process after the other, by GNU parallel and by Snakemake: the same figures as
without chunks, also after tasks were killed and files damaged."""
import json
import shutil
import signal

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
    tables = {}  # those of one machine, made once

    def setUp(self):
        super().setUp()
        names = ("cells.csv", "comparison.json")
        if not self.tables:
            self.compare("local", "--quiet", "--shown", "0", MARROW_CACHE=str(self.scratch / "another"))
            self.tables.update({name: self.read("local/" + name) for name in names})
            shutil.rmtree(self.scratch / "local")
        for name in names:
            self.write("local/" + name, self.tables[name])

    def emit(self, out, program="parallel", cells=CELLS):
        said = self.compare(out, "--emit", program).stdout
        self.assertIn("%d cells are left, in " % cells, said)
        return said.split("run them by\n\n")[1].strip()

    def emit_and_run(self, count=None):
        """Emits, and runs these many of the chunks, or all."""
        self.compare("out", "--emit", "parallel")
        for name in self.names("out")[:count]:
            self.chunk("out", name)

    def test_chunk_by_chunk(self):
        self.emit("out")
        names = self.names("out")
        # the nodes never ran, so a chunk is a case
        self.assertEqual(len(names), CASES)
        for name in names[:-1]:
            self.chunk("out", name)
        self.assertIn("%d of %d cells are lost" % (VARIANTS, CELLS), self.gather("out", code=1).stderr)
        self.assertEqual(self.count("out", "failed"), VARIANTS)
        reasons = {row["reason"] for row in self.figures("out").values() if row["status"] == "failed"}
        self.assertEqual(reasons, {"no task left its row"})
        self.chunk("out", names[-1])
        self.assertIn("%d were there already" % CELLS, self.gather("out").stdout)
        self.expect_same("out", "local")
        self.assertIn("no cell is left", self.compare("out", "--emit", "parallel").stdout)
        # what a chunk wrote beside its rows is gone, and there are few files
        files = [path for path in (self.scratch / "out").rglob("*") if path.is_file()]
        self.assertEqual([path for path in files if "cells/" in str(path)], [])
        self.assertLess(len(files), 2 * CASES + 20)

    def test_without_gather_the_rest_runs_here(self):
        self.emit("out")
        self.chunk("out", self.names("out")[1])
        self.assertIn("%d were there already" % VARIANTS, self.compare("out", "--quiet").stdout)
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
        other = str(self.scratch / "other")
        self.compare("known", "--quiet", MARROW_CACHE=other)
        self.experiment("0.3", cases=1)
        self.emit("out", cells=VARIANTS)
        name = self.names("out")[0]
        rows = self.scratch / "out" / "rows"
        # Its store knows the first cell, and another run seems to make the others: the task waits until it is killed.
        with another_run_makes_all(self.scratch / "other"):
            self.environment["MARROW_CACHE"] = other
            process = self.start("chunk", self.plan("out"), name, "--quiet", "--jobs", "1")
            wait_until(lambda: any("\n" in part.read_text() for part in rows.glob("*.part")), "no row came")
            process.send_signal(signal.SIGKILL)
            process.wait()
        self.environment["MARROW_CACHE"] = str(self.scratch / "cache")
        (part,) = rows.glob("*.part")
        left = part.read_text()
        self.assertEqual(left.count("\n"), 1)
        part.write_text(left + '{"half a li')  # the line that it was writing
        self.chunk("out", name)
        lines = (rows / (name + ".jsonl")).read_text().split("\n")[:-1]
        self.assertEqual(len({json.loads(line)["id"] for line in lines}), VARIANTS)
        self.assertEqual(len(lines), VARIANTS)
        self.assertIn(left.strip(), lines)

    def test_simulated_cases_in_a_store_of_the_task(self):
        """The row of a task counts wherever its store is, because simulated cases are the same in each."""
        self.write("s.yaml", SIMULATION)
        self.file = self.write("e.yaml", SIMULATED)
        self.emit("out", cells=4)
        # "~" comes behind all other names, and "!" before: the order of paths must not count, either
        for name, store in zip(self.names("out"), ("~", "!")):
            self.chunk("out", name, MARROW_CACHE=str(self.scratch / store))
        self.assertIn("4 were there already", self.gather("out").stdout)

    def test_a_damaged_row_is_made_again(self):
        self.emit_and_run()
        file = "out/rows/%s.jsonl" % self.names("out")[2]
        lines = self.read(file).split("\n")
        lines[5] = lines[5].replace('"values":[', '"values":[1')
        self.write(file, "\n".join(lines))
        self.assertIn("%d were there already" % (CELLS - 1), self.compare("out", "--quiet").stdout)
        self.expect_same("out", "local")

    def test_a_plugin_that_crashes_fails_its_cell_only(self):
        self.experiment(more=", crash: {m.how: crash}")
        self.compare("crashed", "--quiet", "--shown", "0", MARROW_CACHE=str(self.scratch / "another"))
        self.emit_and_run()
        self.gather("out")
        self.assertEqual(self.count("out", "failed"), CASES)
        self.expect_same("out", "crashed")

    def refused_chunk(self, said, plan, name):
        self.assertIn(said, self.run_program(MARROW, "chunk", plan, name, code=2).stderr)

    def test_what_changed_since_the_plan(self):
        self.emit("out")
        name, plan = self.names("out")[0], self.plan("out")
        self.refused_chunk("the plan has no chunk 'x'; its chunks are " + name, plan, "x")
        again = "is not what it was when the plan was made; give the command that made the plan again"
        self.write("cases/0/data", "other")
        self.refused_chunk("cases/0 " + again, plan, name)
        self.write("cases/0/data", "case 0")
        self.chunk("out", name)
        self.experiment("0.02")
        self.refused_chunk("p.yaml " + again, plan, name)
        plan.write_text(plan.read_text().replace('"threads": 1', '"threads": 2'))
        self.refused_chunk("is no plan of a comparison: it was changed, or renamed", plan, name)
        plan.write_text("{")
        for other in (plan, self.scratch / "none.json"):
            self.refused_chunk("is no plan of a comparison", other, name)

    def test_words(self):
        self.assertIn("there is no plan in", self.compare("new", "--status", code=2).stderr)
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
        text = "partition: a b\nminutes: 0\npartiton: x\nsetup: y\ntries: 2.5\nask_every_s: 0\n"
        profile = self.write("profile.yaml", text)
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

    def cells_kept(self):
        return sorted((self.scratch / "out" / "cells").glob("*/*/*/cell.json"))

    def cells_rows(self):
        return {row["id"]: row for row in self.json_lines("out/cells.jsonl")}

    def test_old_outputs_of_cells_that_tasks_made_again_are_gone(self):
        """Also those of cells that were lost. Those that still hold stay."""
        for chunks, lost in ((CASES, 0), (1, CASES - 1)):
            with self.subTest(lost=lost):
                shutil.rmtree(self.scratch / "out", ignore_errors=True)
                self.experiment("0.01")
                self.compare("out", "--quiet", "--shown", "0")
                old = self.cells_rows()
                self.experiment("0.02")  # what all cells depend on
                shutil.rmtree(self.scratch / "cache")  # without known times, each case is a chunk
                self.emit_and_run(chunks)
                self.assertEqual(len(self.cells_kept()), CELLS)
                self.gather("out", code=1 if lost else 0)  # lost cells are no success of the command
                rows = self.cells_rows()
                if not lost:
                    self.assertFalse({row["key"] for row in rows.values()} & {row["key"] for row in old.values()})
                self.assertEqual(sum(row["status"] == "failed" for row in rows.values()), lost * VARIANTS)
                self.assertEqual(list((self.scratch / "out" / "cells").glob("*/*/*/*")), [])

    def test_old_outputs_that_still_hold_stay(self):
        self.compare("out", "--quiet", "--shown", "0")
        self.experiment(variants=VARIANTS + 1)
        shutil.rmtree(self.scratch / "cache")
        self.emit_and_run()
        self.gather("out")
        self.assertEqual(len(self.cells_kept()), CELLS)


if __name__ == "__main__":
    main()
