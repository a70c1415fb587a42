# SPDX-License-Identifier: Apache-2.0
"""Nothing is mixed in a comparison: rows that were changed, experiments of one name, figures in another order, cases
that are copies."""
import json
import shutil

from compare_cases import HEAD, Compared
from harness.program import main

TWO_FIGURES = """marrow: 1
inputs: {case: {type: path}}
nodes:
  one: {uses: test.constant, with: {value: 3, path: $case}}
  two: {uses: test.constant, with: {value: 7, path: $case}}
outputs: {one: one, two: two}
"""
SIMULATION = "marrow: 1\nnodes:\n  s: {uses: test.sides}\noutputs: {case: s.both}\n"
COPIES = "; each counts as a case of its own, so intervals are too narrow and p too small: leave the copies out"


class Rows(Compared):
    def test_a_row_that_was_changed_by_hand_is_not_believed(self):
        self.compare()
        before = self.figures()["b/1/0"]
        file = self.kept_row("b/1/0")
        good = file.read_text()
        row = json.loads(good)
        values = '"values":%s' % json.dumps(row["values"])
        self.assertIn(values, good)
        for text, fault in (
            (good.replace(values, '"values":[0.001]'), "it is not what its digest is of: it was changed or damaged"),
            (json.dumps({**row, "digest": "0"}), "it is not what its digest is of"),
            (json.dumps({key: row[key] for key in row if key != "digest"}), "it has no digest of itself"),
        ):
            with self.subTest(fault):
                file.write_text(text)
                done = self.compare("--quiet")
                said = "note: 1 row is not as marrow wrote it, so it does not count: out/cells/b/1/0/cell.json: "
                self.assertIn(said + fault, done.stderr)
                self.assertIn("3 were there already", done.stdout)
                self.assertEqual(self.figures()["b/1/0"], before)
        self.assertEqual(self.compare("--quiet").stderr, "")
        # Each row says what it was made from.
        keys = {row["id"]: row["key"] for row in self.json_lines("out/cells.jsonl")}
        for cell, row in self.rows().items():
            kept = json.loads(self.kept_row(cell).read_text())["key"]
            self.assertEqual((row["key"], keys[cell]), (kept, kept))
            self.assertIn('"%s"' % kept[:12], self.read("out/report.html"))
        self.assertEqual(len(set(keys.values())), 4)

    def test_figures_that_changed_their_order_or_meaning(self):
        """The values of the nodes are written in the pipeline: one is 3 and two is 7."""
        self.write("p.yaml", TWO_FIGURES)
        for metrics, success, there in (
            ("[one.value, two.value]", None, 0),
            ("[two.value, one.value]", None, 0),
            ("[two.value]", None, 0),
            ("[{figure: two.value, label: another}]", None, 2),
            ("[{figure: two.value, better: higher}]\nsuccess: {two.value: 6}", "1", 2),
            ("[{figure: two.value, better: lower}]\nsuccess: {two.value: 6}", "0", 2),
            ("[one.value, two.value]", None, 0),
        ):
            with self.subTest(metrics):
                self.experiment("e", "{a: {}}", HEAD.replace("[number.value]", metrics))
                self.assertIn("%d were there already" % there, self.compare().stdout)
                for row in self.rows().values():
                    self.assertEqual(float(row["two.value"]), 7)
                    self.assertEqual(float(row.get("one.value", 3)), 3)
                    if success:
                        self.assertEqual(row["success"], success)

    def test_cases_that_are_copies(self):
        shutil.copytree(self.scratch / "cases" / "0", self.scratch / "cases" / "copy")
        said = "note: 1 case has the same content as another one, such as '0' and 'copy'" + COPIES + "\n"
        self.assertIn(said, self.compare("--quiet").stderr)

    def test_simulated_cases_that_do_not_use_the_seed(self):
        self.write("s.yaml", SIMULATION)
        self.experiment("e", "{a: {}}", HEAD.replace("folders: [cases/*]", "simulate: {pipeline: s.yaml, seeds: 1..3}"))
        said = "note: 2 cases have the same content as another one, such as 'seed-1' and 'seed-2'" + COPIES
        self.assertIn(said + ", or let the simulation take the seed (seed_input)\n", self.compare("--quiet").stderr)


class Owner(Compared):
    """Experiments of one name."""

    def test_another_experiment_of_the_same_name_is_refused(self):
        other = self.write("elsewhere/e.yaml", self.file.read_text())
        for name in ("p.yaml", "cases/0/data", "cases/1/data"):
            self.write("elsewhere/" + name, self.read(name))
        for arguments, folder in ((["--out", "out"], "out"), ([], "runs/compare/e")):
            self.expect(0, "compare", self.file, *arguments)
            sentence = (
                "the folder %s holds the comparison of another experiment of the same name, 'e', whose file is %s; this"
                " one is %s: choose another folder with --out, or remove it" % (folder, self.file, other)
            )
            self.refused_both(sentence, *arguments, file=other)
            self.assertIn("4 were there", self.printed("compare", self.file, *arguments))

    def test_its_file_may_be_moved_and_reached_in_another_way(self):
        self.compare()
        (self.scratch / "link").symlink_to(".")
        for way in ("link/e.yaml", "cases/../e.yaml"):
            self.compare(file=way)
        moved = self.scratch / "e\nmoved.yaml"
        self.file.rename(moved)
        text = moved.read_text()
        moved.write_text(text + "name: e\n")
        self.assertIn("4 were there", self.compare(file=moved).stdout)
        self.file.write_text(text)
        self.refused("another experiment of the same name, 'e', whose file is ", "compare", self.file, "--out", "out")

    def test_a_marker_of_an_older_version_names_no_file(self):
        self.compare()
        marker = self.out / "marrow-comparison"
        lines = marker.read_text().splitlines(keepends=True)
        self.assertEqual(lines[1:], ["experiment: e\n", "file: %s\n" % self.file])
        marker.write_text("".join(lines[:2]))
        self.assertIn("4 were there", self.compare().stdout)
        self.assertEqual(marker.read_text(), "".join(lines))


if __name__ == "__main__":
    main()
