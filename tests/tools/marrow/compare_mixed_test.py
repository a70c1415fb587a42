# SPDX-License-Identifier: Apache-2.0
"""Nothing is mixed in a comparison: rows that were changed, experiments of one name, figures in another order, cases
that are copies."""
import json
import shutil

from compare_cases import HEAD, Comparison
from harness.program import main

TWO_FIGURES = """marrow: 1
inputs: {case: {type: path}}
nodes:
  one: {uses: test.constant, with: {value: 3, path: $case}}
  two: {uses: test.constant, with: {value: 7, path: $case}}
outputs: {one: one, two: two}
"""
SIMULATION = "marrow: 1\nnodes:\n  s: {uses: test.sides}\noutputs: {case: s.both}\n"


class Rows(Comparison):
    def test_a_row_that_was_changed_by_hand_is_not_believed(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        before = self.rows()
        file = self.scratch / "out" / "cells" / "b" / "1" / "0" / "cell.json"
        good = file.read_text()
        values = '"values":%s' % json.dumps(json.loads(good)["values"])
        self.assertIn(values, good)
        for text, fault in (
            (good.replace(values, '"values":[0.001]'), "it is not what its digest is of: it was changed or damaged"),
            (json.dumps({**json.loads(good), "digest": "0"}), "it is not what its digest is of"),
            (json.dumps({k: v for k, v in json.loads(good).items() if k != "digest"}), "it has no digest of itself"),
        ):
            with self.subTest(fault):
                file.write_text(text)
                done = self.marrow(0, "compare", self.file, "--out", "out", "--quiet")
                self.assertIn(
                    "note: 1 row is not as marrow wrote it, so it does not count: out/cells/b/1/0/cell.json: " + fault,
                    done.stderr,
                )
                self.assertIn("3 were there already", done.stdout)
                self.assertEqual(self.rows()["b/1/0"]["number.value"], before["b/1/0"]["number.value"])
        self.assertEqual(self.marrow(0, "compare", self.file, "--out", "out", "--quiet").stderr, "")

    def test_each_row_says_what_it_was_made_from(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        lines = (self.scratch / "out" / "cells.jsonl").read_text().splitlines()
        keys = {row["id"]: row["key"] for row in map(json.loads, lines)}
        for cell, row in self.rows().items():
            kept = json.loads((self.scratch / "out" / "cells" / cell / "cell.json").read_text())
            self.assertEqual((row["key"], keys[cell]), (kept["key"], kept["key"]))
            self.assertIn('"%s"' % kept["key"][:12], (self.scratch / "out" / "report.html").read_text())
        self.assertEqual(len(set(keys.values())), 4)

    def test_figures_that_changed_their_order_or_meaning(self):
        """The values of the nodes are written in the pipeline: one is 3 and two is 7."""
        self.write("p.yaml", TWO_FIGURES)
        head = HEAD.replace("metrics: [number.value]\n", "") + "variants: {a: {}}\n"
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
                file = self.write("e.yaml", head + "metrics: " + metrics + "\n")
                done = self.marrow(0, "compare", file, "--out", "out")
                self.assertIn("%d were there already" % there, done.stdout)
                for row in self.rows().values():
                    self.assertEqual(float(row["two.value"]), 7)
                    self.assertEqual(float(row.get("one.value", 3)), 3)
                    if success:
                        self.assertEqual(row["success"], success)

    def test_cases_that_are_copies(self):
        shutil.copytree(self.scratch / "cases" / "0", self.scratch / "cases" / "copy")
        said = self.marrow(0, "compare", self.file, "--out", "out", "--quiet").stderr
        self.assertIn(
            "note: 1 case has the same content as another one, such as '0' and 'copy'; each counts as a case of its"
            " own, so intervals are too narrow and p too small: leave the copies out\n",
            said,
        )

    def test_simulated_cases_that_do_not_use_the_seed(self):
        self.write("s.yaml", SIMULATION)
        head = HEAD.replace("folders: [cases/*]", "simulate: {pipeline: s.yaml, seeds: 1..3}")
        file = self.write("e.yaml", head + "variants: {a: {}}\n")
        self.assertIn(
            "note: 2 cases have the same content as another one, such as 'seed-1' and 'seed-2'; each counts as a case"
            " of its own, so intervals are too narrow and p too small: leave the copies out, or let the simulation take"
            " the seed (seed_input)\n",
            self.marrow(0, "compare", file, "--out", "out", "--quiet").stderr,
        )


class Owner(Comparison):
    """Experiments of one name."""

    def setUp(self):
        super().setUp()
        shutil.copytree(self.scratch / "cases", self.scratch / "elsewhere" / "cases")
        shutil.copy(self.scratch / "p.yaml", self.scratch / "elsewhere")
        self.other = self.scratch / "elsewhere" / "e.yaml"
        shutil.copy(self.file, self.other)

    def test_another_experiment_of_the_same_name_is_refused(self):
        for arguments, folder in ((["--out", "out"], "out"), ([], "runs/compare/e")):
            self.marrow(0, "compare", self.file, *arguments)
            sentence = (
                "the folder %s holds the comparison of another experiment of the same name, 'e', whose file is %s; this"
                " one is %s: choose another folder with --out, or remove it" % (folder, self.file, self.other)
            )
            self.refused(sentence, "compare", self.other, *arguments)
            self.refused(sentence, "cell", self.other, "a/0/0", *arguments)
            self.assertIn("4 were there", self.marrow(0, "compare", self.file, *arguments).stdout)

    def test_one_that_was_moved_keeps_its_folder(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        moved = self.scratch / "e\nmoved.yaml"
        self.file.rename(moved)
        text = moved.read_text()
        moved.write_text(text + "name: e\n")
        self.assertIn("4 were there", self.marrow(0, "compare", moved, "--out", "out").stdout)
        self.file.write_text(text)
        self.refused("another experiment of the same name, 'e', whose file is ", "compare", self.file, "--out", "out")

    def test_another_way_to_the_same_file(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        (self.scratch / "link").symlink_to(".")
        for way in ("link/e.yaml", "cases/../e.yaml"):
            self.marrow(0, "compare", way, "--out", "out")

    def test_a_marker_of_an_older_version_names_no_file(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        marker = self.scratch / "out" / "marrow-comparison"
        lines = marker.read_text().splitlines(keepends=True)
        self.assertEqual(lines[1:], ["experiment: e\n", "file: %s\n" % self.file])
        marker.write_text("".join(lines[:2]))
        self.assertIn("4 were there", self.marrow(0, "compare", self.file, "--out", "out").stdout)
        self.assertEqual(marker.read_text(), "".join(lines))


if __name__ == "__main__":
    main()
