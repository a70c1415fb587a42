# SPDX-License-Identifier: Apache-2.0
"""The cells in the folder of a comparison: which are kept and which run again, by one process or several at once."""
import json
import shutil
import signal

from compare_cases import DRAWN, PIPELINE, Compared
from harness.program import IS_SANITIZED, main

POSE = """marrow-pose: 1
target: world
source: ct
rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
translation_mm: [0, 0, 0]
evaluations: %d
"""


class Cells(Compared):
    def in_rows(self, key):
        """What each row of the table has under a key."""
        return {row["id"]: row[key] for row in self.json_lines("out/cells.jsonl")}

    def test_two_at_once_in_one_folder(self):
        first = self.start("compare", self.slow(), "--out", "out", "--time-limit", 300)
        self.wait_for(self.out / "experiment.yaml")
        said = "another comparison or cell is running in out; wait for it, or choose another folder with --out"
        self.refused(said, "compare", self.slow(), "--out", "out")
        said = "another comparison is running in out; wait for it"
        self.refused(said, "cell", self.slow(), "hang/0/0", "--out", "out")
        first.send_signal(signal.SIGKILL)
        first.communicate()
        self.compare("--time-limit", 0.5, file=self.slow())  # killed, it gave the folder back

    def test_many_cells_at_once(self):
        names = "abcdef"
        variants = "{%s}" % ", ".join("%s: {m.value: %d}" % (name, i) for i, name in enumerate(names))
        cells = ["%s/%d/0" % (name, case) for name in names for case in range(2)]
        file = self.experiment("many", variants)
        processes = [self.start("cell", file, cell, "--out", "out") for cell in cells]
        ends = [(process.communicate(), process.returncode) for process in processes]
        self.assertEqual([code for _, code in ends], [0] * 12, ends)
        self.assertIn("12 were there already", self.compare(file=file).stdout)

    def test_a_cell_that_another_process_is_at(self):
        cell = ["cell", self.slow(), "hang/0/0", "--out", "out"]
        first = self.start(*cell)
        self.wait_for(self.out / "cells/hang/0/0/pipeline.yaml")
        self.refused("the cell hang/0/0 is being run by another process", *cell)
        self.refused("another comparison or cell is running in out", "compare", self.slow(), "--out", "out")
        first.kill()
        first.communicate()

    def test_a_cell_whose_folder_cannot_be_written_costs_that_cell(self):
        self.write("out/cells/b/1", "in the way")
        marker = "This folder is a comparison of marrow, which changes and removes what is in it.\nexperiment: e\n"
        self.write("out/marrow-comparison", marker)
        self.assertRegex(self.compare().stdout, r"b/1/0: .*out/cells/b/1/0.*: Not a directory")
        done = {"a/0/0": "done", "b/0/0": "done", "a/1/0": "done", "b/1/0": "failed"}
        self.assertEqual(self.in_rows("status"), done)

    def test_a_row_that_was_changed_is_run_again_or_stays_where_it_is(self):
        self.compare()
        file = self.kept_row("b/1/0")
        good = json.loads(file.read_text())
        for what, change in {
            "a name": {"id": "../../../evil", "variant": "a", "case": "0"},
            "no values": {"values": []},
            "no number": {"values": ["x"]},
            "counts": {"evaluations": -1},
            "no JSON": None,
        }.items():
            with self.subTest(what):
                file.write_text(json.dumps(dict(good, **change)) if change else "{")
                self.assertIn("3 were there", self.compare().stdout)
                self.assertEqual(sorted(self.in_rows("id")), ["a/0/0", "a/1/0", "b/0/0", "b/1/0"])
                found = [self.in_rows(key)["b/1/0"] for key in ("variant", "case", "values")]
                self.assertEqual(found, ["b", "1", good["values"]])
        self.assertFalse(list(self.scratch.rglob("evil")))

    def test_changed_comments_run_and_draw_nothing_again(self):
        self.write("p.yaml", PIPELINE.replace("outputs: {", DRAWN % "shared" + "outputs: {picture: drawn, "))
        self.write("e.yaml", self.file.read_text() + "pictures: [picture]\n")
        self.compare()
        drawn = {path: path.stat().st_mtime_ns for path in (self.out / "pictures").rglob("key.txt")}
        self.assertEqual(len(drawn), 4)
        for name in ("p.yaml", "e.yaml"):
            self.write(name, "# another comment\n" + self.read(name))
        self.assertIn("4 were there already", self.compare().stdout)
        self.assertEqual({path: path.stat().st_mtime_ns for path in drawn}, drawn)

    def test_a_case_that_changed_is_run_again_and_a_failed_cell_too(self):
        self.experiment("e", "{a: {}, b: {m.how: error}}")
        self.assertIn("0 were there already", self.compare().stdout)
        self.assertIn("2 were there already", self.compare().stdout)
        self.write("cases/1/data", "changed")
        self.assertIn("1 were there already", self.compare().stdout)

    def test_files_that_change_while_it_runs(self):
        # A cell that hangs and is tried twice: it takes two more time limits.
        shutil.rmtree(self.scratch / "cases" / "1")
        self.experiment("e", "{a: {}, hang: {m.how: hang}}")
        arguments = ["--out", "out", "--no-cache", "--jobs", 1, "--time-limit", 10 if IS_SANITIZED else 3]
        for name in ("e.yaml", "p.yaml"):
            with self.subTest(name):
                process = self.start("compare", self.file, *arguments)
                self.wait_for(self.kept_row("a/0/0"))
                self.write(name, self.read(name) + "# changed\n")
                _, said = process.communicate(timeout=240)
                self.assertEqual(process.returncode, 2, said)
                self.assertIn(
                    "%s was changed while the comparison ran: its tables may mix the old with the new; give the same"
                    " command again" % (self.scratch / name),
                    said,
                )
                shutil.rmtree(self.out)

    def test_the_evaluations_of_all_poses_are_counted(self):
        nodes = "".join("  p%d: {uses: read.pose, with: {path: %d.yaml}}\n" % (n, n) for n in (70, 8))
        text = PIPELINE.replace("outputs:", nodes + "outputs:")
        self.write("p.yaml", text.replace("number: m", "number: m, first: p70, second: p8"))
        for count in (70, 8):
            self.write("%d.yaml" % count, POSE % count)
        self.compare()
        self.assertEqual(list(self.in_rows("evaluations").values()), [78] * 4)

    def test_no_half_file_is_left(self):
        self.compare()
        names = {path.name for path in self.out.rglob("*") if path.is_file()}
        whole = "marrow-comparison experiment.yaml cells.csv cells.jsonl comparison.json report.html cell.json"
        self.assertLessEqual(set(whole.split()), names)
        self.assertFalse([name for name in names if "tmp" in name or "part" in name])


if __name__ == "__main__":
    main()
