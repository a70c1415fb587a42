# SPDX-License-Identifier: Apache-2.0
"""The folder of a comparison: whose it is, and who may write to it."""
import json
import os
import shutil
import signal
import subprocess

from compare_cases import DRAWN, HEAD, PIPELINE, Compared
from harness import MARROW
from harness.program import IS_SANITIZED, main

OTHERS = "mine holds something else than a comparison; choose another with --out, or remove it"


class Folder(Compared):
    def test_nothing_is_written_into_a_case(self):
        before = self.everything()
        sentence = "lies in the case %s, which would change while its cells run; " % (self.scratch / "cases" / "1")
        inside = ["--out", "cases/1/out"]
        said = "the output folder cases/1/out " + sentence
        self.refused(said + "choose another with --out", "compare", "e.yaml", *inside)
        self.refused(said, "cell", "e.yaml", "a/1/0", *inside)
        store = self.scratch / "cases" / "1" / "store"
        said = "the store of results %s %sset MARROW_CACHE to another folder, or give --no-cache" % (store, sentence)
        self.refused(said, "compare", "e.yaml", "--out", "out", extra_environment={"MARROW_CACHE": str(store)})
        self.assertEqual(self.everything(), before)

    def test_a_plugin_that_goes_elsewhere_takes_no_result_along(self):
        self.experiment("e", "{a: {}, elsewhere: {m.how: elsewhere}, error: {m.how: error}}")
        self.compare("--jobs", 1)
        self.assertEqual(
            self.json("out/cells/elsewhere/0/0/cell.json")["reason"],
            "node 'm' (test.misbehave) failed: the working folder was changed to / while it ran; a plugin must leave "
            "it as it is",
        )
        self.assertEqual(len(list((self.out / "cells").glob("*/*/0/run.json"))), 6)
        self.expect(1, "run", "p.yaml", "case=cases/0", "--set", "m.how=elsewhere", "--out", "one")
        self.assertTrue((self.scratch / "one" / "run.json").exists())

    def test_a_folder_of_other_things_is_not_ours(self):
        self.write("mine/experiment.yaml", "my own notes")
        self.refused_both(OTHERS, "--out", "mine")
        self.assertEqual(self.read("mine/experiment.yaml"), "my own notes")
        self.assertEqual(os.listdir(self.scratch / "mine"), ["experiment.yaml"])

    def test_what_looks_like_a_marker(self):
        marker = self.scratch / "mine" / "marrow-comparison"
        for what, make in {
            "a text": lambda: marker.write_text("my notes\n"),
            "a folder": marker.mkdir,
            "a pipe": lambda: os.mkfifo(marker),
            "a link": lambda: marker.symlink_to(self.file),
            "a dangling link": lambda: marker.symlink_to("nowhere"),
        }.items():
            with self.subTest(what):
                (self.scratch / "mine").mkdir()
                make()
                self.refused(OTHERS, "compare", self.file, "--out", "mine", timeout=120)
                self.assertEqual(os.listdir(self.scratch / "mine"), ["marrow-comparison"])
                shutil.rmtree(self.scratch / "mine")

    def test_what_lies_at_the_place_of_a_file_is_not_opened(self):
        self.compare(out="whole")
        whole = self.scratch / "whole"
        files = [path.relative_to(whole) for path in whole.rglob("*") if path.is_file()]
        names = (
            "report.html comparison.json cells.jsonl cells.csv experiment.yaml key.txt cell.json report.json".split()
        )
        of_b = (("cells", "b"), ("pictures", "b"))
        files = [file for file in files if file.name in names and file.parts[0:2] not in of_b]
        self.assertEqual({file.name for file in files}, set(names))
        for make in (os.mkfifo, lambda place: os.symlink("/dev/zero", place)):
            shutil.rmtree(self.out, ignore_errors=True)
            shutil.copytree(whole, self.out)
            for file in files:
                (self.out / file).unlink()
                make(self.out / file)
            self.compare(timeout=120)
            for path in (self.out / file for file in files):
                self.assertTrue(path.is_file() and not path.is_symlink(), path)
        self.assertTrue(all((self.out / file).stat().st_size for file in files))

    def test_nothing_is_changed_behind_a_link(self):
        notes = self.write("mine/0/0/notes", "mine").parents[2]
        self.compare(out="whole")
        for place in ("cells", "pictures", "cases", "report", "cells/b", "cells/b/0", "pictures/a/1", "cells/b/1/0"):
            with self.subTest(place):
                shutil.copytree(self.scratch / "whole", self.out)
                shutil.rmtree(self.out / place, ignore_errors=True)
                (self.out / place).symlink_to(notes)
                said = (
                    "out/%s is a link, behind which nothing is changed; remove it, or choose another folder with --out"
                )
                self.refused(said % place, "compare", self.file, "--out", "out")
                self.refused(said % place, "cell", self.file, "b/0/0", "--out", "out")
                found = [str(path.relative_to(notes)) for path in notes.rglob("*")]
                self.assertEqual(found, ["0", "0/0", "0/0/notes"])
                shutil.rmtree(self.out)

    def test_the_folder_of_another_experiment(self):
        self.compare()
        self.refused(
            "the folder out holds the comparison of another experiment, 'e'; this one is 'other': choose another folder"
            " with --out, or remove it",
            *("compare", self.experiment("other", "{a: {}}"), "--out", "out"),
        )
        self.assertEqual(self.read("out/experiment.yaml"), self.file.read_text())
        self.experiment("e", "{a: {}, b: {m.value: 6}}")  # changed, but the same experiment
        self.assertIn("2 were there already", self.compare().stdout)

    def test_a_marker_whose_maker_was_killed(self):
        self.compare(out="whole")
        text = (self.scratch / "whole" / "marrow-comparison").read_bytes()
        for length in (0, 1, len(text) // 2, len(text) - 1):
            with self.subTest(length):
                marker = self.write("out/marrow-comparison", text[:length])
                self.expect(0, "cell", self.file, "a/0/0", "--out", "out")
                self.assertEqual(marker.read_bytes(), text)
                marker.write_bytes(text[:length])
                self.refused("holds something else", "cell", self.file, "a/0/0", "--out", "out")
                shutil.rmtree(self.out)


class Surroundings(Compared):
    """Folders that nobody may write to, and variables that are not there."""

    def test_where_nothing_can_be_written(self):
        self.write("file", "")
        for out in ("file", "file/out", "/proc/out", "/dev/null"):
            with self.subTest(out):
                self.refused("--out", "compare", self.file, "--out", out)
        self.write("runs", "in the way")
        said = "cannot make the folder runs/compare/e: Not a directory; choose another with --out"
        self.refused(said, "compare", self.file)

    def test_as_another_user_in_a_folder_that_is_not_his(self):
        usual = {"user": 65534, "capture_output": True, "text": True}
        if os.getuid() != 0 or subprocess.run([MARROW, "--help"], **usual).returncode != 0:
            self.skipTest("needs root, and a build that others may run")
        self.scratch.chmod(0o755)
        self.compare()
        environment = {**os.environ, "MARROW_PLUGIN_PATH": str(self.plugins[0]), "MARROW_CACHE": "/nowhere"}
        for out in (["--out", "out"], ["--out", "new"], []):
            with self.subTest(out):
                command = [MARROW, "compare", self.file, *out]
                result = subprocess.run(command, env=environment, cwd=self.scratch, timeout=60, **usual)
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                said = r"^marrow: error: cannot (write to|make) the folder .*: Permission denied; choose another with"
                self.assertRegex(result.stderr, said + r" --out\n$")

    def test_without_a_folder_for_temporary_files(self):
        for name, folder in enumerate(("", "/nowhere")):
            said = self.compare(out="out%d" % name, extra_environment={"TMPDIR": folder}).stderr
            self.assertEqual(said.count("error"), 0)


# The cells in the folder of a comparison: which are kept and which run again, by one process or several at once.
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


# Nothing is mixed in a comparison: rows that were changed, experiments of one name, figures in another order, cases
# that are copies.
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
