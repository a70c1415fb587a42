# SPDX-License-Identifier: Apache-2.0
"""The folder of a comparison: whose it is, and who may write to it."""
import os
import shutil
import subprocess

from compare_cases import Compared
from harness import MARROW
from harness.program import main

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


if __name__ == "__main__":
    main()
