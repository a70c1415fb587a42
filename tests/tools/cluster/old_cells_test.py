# SPDX-License-Identifier: Apache-2.0
"""Old outputs of cells that tasks of a cluster made again."""
import json
import shutil

from cluster_cases import CASES, MARROW, VARIANTS, Cluster, main


class OldCells(Cluster):
    def rows(self):
        lines = (self.scratch / "out" / "cells.jsonl").read_text().splitlines()
        return {row["id"]: row for row in map(json.loads, lines)}

    def make_anew(self, chunks):
        """Runs here, then changes what all cells depend on, and lets tasks make the first chunks."""
        self.compare("out", "--quiet", "--shown", "0")
        self.old = self.rows()
        self.experiment("0.02")
        self.run_chunks(chunks)

    def run_chunks(self, chunks):
        shutil.rmtree(self.scratch / "cache")  # without known times, each case is a chunk
        self.compare("out", "--emit", "parallel")
        plan = self.plan("out")
        for name in (plan.parent / (plan.stem + "-chunks.txt")).read_text().split()[:chunks]:
            self.run_program(MARROW, "chunk", plan, name, "--quiet")

    def test_outputs_of_an_earlier_run_do_not_pass_for_those_of_the_rows(self):
        self.make_anew(CASES)
        kept = sorted((self.scratch / "out" / "cells").glob("*/*/*/cell.json"))
        self.assertEqual(len(kept), CASES * VARIANTS)
        self.compare("out", "--gather", "--quiet", "--shown", "0")
        rows = self.rows()
        self.assertEqual(len({row["key"] for row in rows.values()} & {row["key"] for row in self.old.values()}), 0)
        self.assertEqual(list((self.scratch / "out" / "cells").glob("*/*/*/*")), [])

    def test_nor_for_those_of_cells_that_were_lost(self):
        self.make_anew(1)
        # Lost cells are no success of the command.
        self.compare("out", "--gather", "--quiet", "--shown", "0", code=1)
        self.assertEqual(sum(row["status"] == "failed" for row in self.rows().values()), (CASES - 1) * VARIANTS)
        self.assertEqual(list((self.scratch / "out" / "cells").glob("*/*/*/*")), [])

    def test_those_that_still_hold_stay(self):
        self.compare("out", "--quiet", "--shown", "0")
        self.experiment(variants=VARIANTS + 1)
        self.run_chunks(CASES)
        self.compare("out", "--gather", "--quiet", "--shown", "0")
        self.assertEqual(len(list((self.scratch / "out" / "cells").glob("*/*/*/cell.json"))), CASES * VARIANTS)


if __name__ == "__main__":
    main()
