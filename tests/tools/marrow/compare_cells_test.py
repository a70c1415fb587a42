# SPDX-License-Identifier: Apache-2.0
"""The cells in the folder of a comparison: which are kept and which run again, by one process or several at once."""
import json
import shutil
import signal

from compare_cases import DRAWN, PIPELINE, Comparison
from harness.program import IS_SANITIZED, main


class Cells(Comparison):
    def test_two_at_once_in_one_folder(self):
        first = self.start("compare", self.slow(), "--out", "out", "--time-limit", 300)
        self.wait_for(self.scratch / "out" / "experiment.yaml")
        self.refused(
            "another comparison or cell is running in out; wait for it, or choose another folder with --out",
            "compare",
            self.slow(),
            "--out",
            "out",
        )
        self.refused(
            "another comparison is running in out; wait for it", "cell", self.slow(), "hang/0/0", "--out", "out"
        )
        first.send_signal(signal.SIGKILL)
        first.communicate()
        self.marrow(0, "compare", self.slow(), "--out", "out", "--time-limit", 0.5)  # killed, it gave the folder back

    def test_many_cells_at_once(self):
        names = "abcdef"
        file = self.experiment(
            "many", "{%s}" % ", ".join("%s: {m.value: %d}" % (name, i) for i, name in enumerate(names))
        )
        processes = [
            self.start("cell", file, "%s/%d/0" % (name, case), "--out", "out") for name in names for case in range(2)
        ]
        ends = [(process.communicate(), process.returncode) for process in processes]
        self.assertEqual([code for _, code in ends], [0] * 12, ends)
        self.assertIn("12 were there already", self.marrow(0, "compare", file, "--out", "out").stdout)

    def test_a_cell_that_another_process_is_at(self):
        first = self.start("cell", self.slow(), "hang/0/0", "--out", "out")
        self.wait_for(self.scratch / "out" / "cells" / "hang" / "0" / "0" / "pipeline.yaml")
        self.refused(
            "the cell hang/0/0 is being run by another process", "cell", self.slow(), "hang/0/0", "--out", "out"
        )
        self.refused("another comparison or cell is running in out", "compare", self.slow(), "--out", "out")
        first.kill()
        first.communicate()

    def test_a_cell_whose_folder_cannot_be_written_costs_that_cell(self):
        (self.scratch / "out" / "cells" / "b").mkdir(parents=True)
        self.write("out/cells/b/1", "in the way")
        (self.scratch / "out" / "marrow-comparison").write_text(
            "This folder is a comparison of marrow, which changes and removes what is in it.\nexperiment: e\n"
        )
        result = self.marrow(0, "compare", self.file, "--out", "out")
        self.assertRegex(result.stdout, r"b/1/0: .*out/cells/b/1/0.*: Not a directory")
        rows = {
            row["id"]: row for row in map(json.loads, (self.scratch / "out" / "cells.jsonl").read_text().splitlines())
        }
        self.assertEqual(
            {name: row["status"] for name, row in rows.items()},
            {"a/0/0": "done", "b/0/0": "done", "a/1/0": "done", "b/1/0": "failed"},
        )

    def test_a_row_that_was_changed_is_run_again_or_stays_where_it_is(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        file = self.scratch / "out" / "cells" / "b" / "1" / "0" / "cell.json"
        good = json.loads(file.read_text())
        forged = {
            "a name": ({"id": "../../../evil", "variant": "a", "case": "0"}, "3 were there"),
            "no values": ({"values": []}, "3 were there"),
            "no number": ({"values": ["x"]}, "3 were there"),
            "counts": ({"evaluations": -1}, "3 were there"),
            "no JSON": (None, "3 were there"),
        }
        for what, (change, found) in forged.items():
            with self.subTest(what):
                file.write_text(json.dumps(dict(good, **change)) if change else "{")
                self.assertIn(found, self.marrow(0, "compare", self.file, "--out", "out").stdout)
                rows = {
                    row["id"]: row
                    for row in map(json.loads, (self.scratch / "out" / "cells.jsonl").read_text().splitlines())
                }
                self.assertEqual(sorted(rows), ["a/0/0", "a/1/0", "b/0/0", "b/1/0"])
                self.assertEqual(
                    (rows["b/1/0"]["variant"], rows["b/1/0"]["case"], rows["b/1/0"]["values"]),
                    ("b", "1", good["values"]),
                )
        self.assertFalse(list(self.scratch.rglob("evil")))

    def test_changed_comments_run_and_draw_nothing_again(self):
        self.write("p.yaml", PIPELINE.replace("outputs: {", DRAWN % "shared" + "outputs: {picture: drawn, "))
        self.write("e.yaml", self.file.read_text() + "pictures: [picture]\n")
        self.marrow(0, "compare", self.file, "--out", "out")
        drawn = {path: path.stat().st_mtime_ns for path in (self.scratch / "out" / "pictures").rglob("key.txt")}
        self.assertEqual(len(drawn), 4)
        for name in ("p.yaml", "e.yaml"):
            self.write(name, "# another comment\n" + (self.scratch / name).read_text())
        self.assertIn("4 were there already", self.marrow(0, "compare", self.file, "--out", "out").stdout)
        self.assertEqual({path: path.stat().st_mtime_ns for path in drawn}, drawn)

    def test_a_case_that_changed_is_run_again_and_a_failed_cell_too(self):
        file = self.experiment("e", "{a: {}, b: {m.how: error}}")
        self.assertIn("0 were there already", self.marrow(0, "compare", file, "--out", "out").stdout)
        self.assertIn("2 were there already", self.marrow(0, "compare", file, "--out", "out").stdout)
        self.write("cases/1/data", "changed")
        self.assertIn("1 were there already", self.marrow(0, "compare", file, "--out", "out").stdout)

    def test_files_that_change_while_it_runs(self):
        # A cell that hangs and is tried twice: it takes two more time limits.
        shutil.rmtree(self.scratch / "cases" / "1")
        file = self.experiment("e", "{a: {}, hang: {m.how: hang}}")
        limit = 10 if IS_SANITIZED else 3
        for name in ("e.yaml", "p.yaml"):
            with self.subTest(name):
                self.write("p.yaml", PIPELINE)
                process = self.start("compare", file, "--out", "out", "--no-cache", "--jobs", 1, "--time-limit", limit)
                self.wait_for(self.scratch / "out" / "cells" / "a" / "0" / "0" / "cell.json")
                self.write(name, (self.scratch / name).read_text() + "# changed\n")
                _, said = process.communicate(timeout=240)
                self.assertEqual(process.returncode, 2, said)
                self.assertIn(
                    "%s was changed while the comparison ran: its tables may mix the old with the new; give the same"
                    " command again" % (self.scratch / name),
                    said,
                )
                shutil.rmtree(self.scratch / "out")

    def test_the_evaluations_of_all_poses_are_counted(self):
        pose = """marrow-pose: 1
target: world
source: ct
rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
translation_mm: [0, 0, 0]
evaluations: %d
"""
        nodes = "".join("  p%d: {uses: read.pose, with: {path: %d.yaml}}\n" % (n, n) for n in (70, 8))
        self.write(
            "p.yaml",
            PIPELINE.replace("outputs:", nodes + "outputs:").replace("number: m", "number: m, first: p70, second: p8"),
        )
        for count in (70, 8):
            self.write("%d.yaml" % count, pose % count)
        self.marrow(0, "compare", self.file, "--out", "out")
        rows = map(json.loads, (self.scratch / "out" / "cells.jsonl").read_text().splitlines())
        self.assertEqual([row["evaluations"] for row in rows], [78] * 4)

    def test_no_half_file_is_left(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        names = {path.name for path in (self.scratch / "out").rglob("*") if path.is_file()}
        self.assertTrue(
            {
                "marrow-comparison",
                "experiment.yaml",
                "cells.csv",
                "cells.jsonl",
                "comparison.json",
                "report.html",
                "cell.json",
            }
            <= names
        )
        self.assertFalse([name for name in names if "tmp" in name or "part" in name])


if __name__ == "__main__":
    main()
