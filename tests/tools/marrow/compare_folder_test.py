# SPDX-License-Identifier: Apache-2.0
"""The folder of a comparison: whose it is, and who may write to it."""
import json
import os
import shutil
import subprocess

from compare_cases import Comparison
from harness import MARROW, TEST_PLUGINS
from harness.program import main, marrow


class Folder(Comparison):
    def test_nothing_is_written_into_a_case(self):
        before = sorted(self.scratch.rglob("*"))
        sentence = "lies in the case %s, which would change while its cells run; " % (self.scratch / "cases" / "1")
        self.refused(
            "the output folder cases/1/out " + sentence + "choose another with --out",
            "compare",
            "e.yaml",
            "--out",
            "cases/1/out",
        )
        self.refused("the output folder cases/1/out " + sentence, "cell", "e.yaml", "a/1/0", "--out", "cases/1/out")
        store = self.scratch / "cases" / "1" / "store"
        result = marrow(
            "compare",
            "e.yaml",
            "--out",
            "out",
            plugins=[TEST_PLUGINS],
            extra_environment={"MARROW_CACHE": str(store)},
            cwd=self.scratch,
        )
        self.assertEqual(result.returncode, 2)
        self.assertIn(
            "the store of results %s %sset MARROW_CACHE to another folder, or give --no-cache" % (store, sentence),
            result.stderr,
        )
        self.assertEqual(sorted(self.scratch.rglob("*")), before)

    def test_a_plugin_that_goes_elsewhere_takes_no_result_along(self):
        self.experiment("e", "{a: {}, elsewhere: {m.how: elsewhere}, error: {m.how: error}}")
        self.marrow(0, "compare", "e.yaml", "--out", "out", "--jobs", 1)
        cells = json.loads((self.scratch / "out" / "cells" / "elsewhere" / "0" / "0" / "cell.json").read_text())
        self.assertEqual(
            cells["reason"],
            (
                "node 'm' (test.misbehave) failed: the working folder was changed to / while it ran; a plugin must"
                " leave it as it is"
            ),
        )
        self.assertEqual(len(list((self.scratch / "out" / "cells").glob("*/*/0/run.json"))), 6)
        self.marrow(1, "run", "p.yaml", "case=cases/0", "--set", "m.how=elsewhere", "--out", "one")
        self.assertTrue((self.scratch / "one" / "run.json").exists())

    def test_a_folder_with_an_experiment_file_is_not_ours_for_that(self):
        (self.scratch / "mine").mkdir()
        self.write("mine/experiment.yaml", "my own notes")
        for command in (["compare", self.file], ["cell", self.file, "a/0/0"]):
            self.refused(
                "mine holds something else than a comparison; choose another with --out, or remove it",
                *command,
                "--out",
                "mine"
            )
        self.assertEqual((self.scratch / "mine" / "experiment.yaml").read_text(), "my own notes")
        self.assertEqual(os.listdir(self.scratch / "mine"), ["experiment.yaml"])

    def test_what_looks_like_a_marker(self):
        marker = self.scratch / "mine" / "marrow-comparison"
        makers = {
            "a text": lambda: marker.write_text("my notes\n"),
            "a folder": marker.mkdir,
            "a pipe": lambda: os.mkfifo(marker),
            "a link": lambda: marker.symlink_to(self.file),
            "a dangling link": lambda: marker.symlink_to("nowhere"),
        }
        for what, make in makers.items():
            with self.subTest(what):
                (self.scratch / "mine").mkdir()
                make()
                self.refused(
                    "holds something else than a comparison", "compare", self.file, "--out", "mine", timeout=120
                )
                self.assertEqual(os.listdir(self.scratch / "mine"), ["marrow-comparison"])
                shutil.rmtree(self.scratch / "mine")

    def test_what_lies_at_the_place_of_a_file_is_not_opened(self):
        self.marrow(0, "compare", self.file, "--out", "whole")
        files = [
            path.relative_to(self.scratch / "whole") for path in (self.scratch / "whole").rglob("*") if path.is_file()
        ]
        names = {
            "report.html",
            "comparison.json",
            "cells.jsonl",
            "cells.csv",
            "experiment.yaml",
            "key.txt",
            "cell.json",
            "report.json",
        }
        files = [
            file for file in files if file.name in names and file.parts[0:2] not in (("cells", "b"), ("pictures", "b"))
        ]
        self.assertEqual({file.name for file in files}, names)
        for make in (os.mkfifo, lambda place: os.symlink("/dev/zero", place)):
            shutil.rmtree(self.scratch / "out", ignore_errors=True)
            shutil.copytree(self.scratch / "whole", self.scratch / "out")
            for file in files:
                (self.scratch / "out" / file).unlink()
                make(self.scratch / "out" / file)
            self.marrow(0, "compare", self.file, "--out", "out", timeout=120)
            for file in files:
                self.assertTrue(
                    (self.scratch / "out" / file).is_file() and not (self.scratch / "out" / file).is_symlink(), file
                )
        self.assertTrue(all((self.scratch / "out" / file).stat().st_size for file in files))

    def test_nothing_is_changed_behind_a_link(self):
        (self.scratch / "mine" / "0" / "0").mkdir(parents=True)
        self.write("mine/0/0/notes", "mine")
        for place in ("cells", "pictures", "cases", "report", "cells/b", "cells/b/0", "pictures/a/1", "cells/b/1/0"):
            with self.subTest(place):
                self.marrow(0, "compare", self.file, "--out", "out")
                shutil.rmtree(self.scratch / "out" / place, ignore_errors=True)
                (self.scratch / "out" / place).symlink_to(self.scratch / "mine")
                for command in (["compare", self.file], ["cell", self.file, "b/0/0"]):
                    self.refused(
                        "out/%s is a link, behind which nothing is changed; remove it, or choose another folder with"
                        " --out" % place,
                        *command,
                        "--out",
                        "out"
                    )
                self.assertEqual(
                    [str(path.relative_to(self.scratch / "mine")) for path in (self.scratch / "mine").rglob("*")],
                    ["0", "0/0", "0/0/notes"],
                )
                shutil.rmtree(self.scratch / "out")

    def test_the_folder_of_another_experiment(self):
        self.marrow(0, "compare", self.file, "--out", "out")
        other = self.experiment("other", "{a: {}}")
        self.refused(
            (
                "the folder out holds the comparison of another experiment, 'e'; this one is 'other': choose another"
                " folder with --out, or remove it"
            ),
            "compare",
            other,
            "--out",
            "out",
        )
        self.assertEqual((self.scratch / "out" / "experiment.yaml").read_text(), self.file.read_text())
        self.experiment("e", "{a: {}, b: {m.value: 6}}")  # changed, but the same experiment
        self.assertIn("2 were there already", self.marrow(0, "compare", self.file, "--out", "out").stdout)

    def test_a_marker_whose_maker_was_killed(self):
        self.marrow(0, "compare", self.file, "--out", "whole")
        text = (self.scratch / "whole" / "marrow-comparison").read_bytes()
        for length in (0, 1, len(text) // 2, len(text) - 1):
            with self.subTest(length):
                (self.scratch / "out").mkdir()
                (self.scratch / "out" / "marrow-comparison").write_bytes(text[:length])
                self.marrow(0, "cell", self.file, "a/0/0", "--out", "out")
                self.assertEqual((self.scratch / "out" / "marrow-comparison").read_bytes(), text)
                (self.scratch / "out" / "marrow-comparison").write_bytes(text[:length])
                self.refused("holds something else", "cell", self.file, "a/0/0", "--out", "out")
                shutil.rmtree(self.scratch / "out")


class Surroundings(Comparison):
    """Folders that nobody may write to, and variables that are not there."""

    def test_where_nothing_can_be_written(self):
        self.write("file", "")
        for out in ("file", "file/out", "/proc/out", "/dev/null"):
            with self.subTest(out):
                result = self.marrow(2, "compare", self.file, "--out", out)
                self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
                self.assertIn("--out", result.stderr)
        self.write("runs", "in the way")
        self.refused(
            "cannot make the folder runs/compare/e: Not a directory; choose another with --out", "compare", self.file
        )

    def test_as_another_user_in_a_folder_that_is_not_his(self):
        if (
            os.getuid() != 0
            or subprocess.run(
                [str(MARROW), "--help"], user=65534, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            ).returncode
            != 0
        ):
            self.skipTest("needs root, and a build that others may run")
        self.scratch.chmod(0o755)
        self.marrow(0, "compare", self.file, "--out", "out")
        environment = dict(self.environment, MARROW_CACHE="/nowhere")
        for out in (["--out", "out"], ["--out", "new"], []):
            with self.subTest(out):
                result = subprocess.run(
                    [str(MARROW), "compare", str(self.file), *out],
                    env=environment,
                    cwd=self.scratch,
                    user=65534,
                    capture_output=True,
                    text=True,
                    timeout=60,
                )
                self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
                self.assertRegex(
                    result.stderr,
                    (
                        r"^marrow: error: cannot (write to|make) the folder .*: Permission denied; choose another with"
                        r" --out\n$"
                    ),
                )

    def test_without_a_folder_for_temporary_files(self):
        for name, folder in enumerate(("", "/nowhere")):
            self.environment["TMPDIR"] = folder
            process = self.start("compare", self.file, "--out", "out%d" % name)
            self.assertEqual((process.communicate()[1].count("error"), process.returncode), (0, 0))


if __name__ == "__main__":
    main()
