# SPDX-License-Identifier: Apache-2.0
"""The folder of a comparison: whose it is, who may write to it, and what is in it when something goes wrong."""
import json
import os
import shutil
import signal
import subprocess

from marrow_cli import IS_SANITIZED, MARROW, TEST_PLUGINS, Case, main, marrow, wait_until

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  shared: {uses: test.work, with: {value: 0.02, path: $case}}
  m: {uses: test.misbehave, in: {a: shared}}
outputs: {number: m}
"""
HEAD = "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\nmetrics: [number.value]\ntimed_cells: 0\n"


class Comparison(Case):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        for i in range(2):
            (self.scratch / "cases" / str(i)).mkdir(parents=True)
            self.write("cases/%d/data" % i, "case %d" % i)
        self.environment = dict(
            os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS), MARROW_CACHE=str(self.scratch / "cache")
        )
        self.file = self.experiment("e", "{a: {}, b: {m.value: 5}}")

    def experiment(self, name, variants):
        return self.write(name + ".yaml", HEAD + "variants: " + variants + "\n")

    def marrow(self, code, *arguments, **more):
        result = marrow(
            *arguments,
            plugins=[TEST_PLUGINS],
            extra_environment={"MARROW_CACHE": str(self.scratch / "cache")},
            cwd=self.scratch,
            **more
        )
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def refused(self, sentence, *arguments, **more):
        """Says in one sentence why nothing was done."""
        result = self.marrow(2, *arguments, **more)
        self.assertIn(sentence, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)

    def start(self, *arguments):
        process = subprocess.Popen(
            [str(MARROW), *map(str, arguments)],
            env=self.environment,
            cwd=self.scratch,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)  # where the test ends before
        return process

    def wait_for(self, path):
        wait_until(path.exists, "%s did not come" % path)

    def slow(self):
        """An experiment whose cell hangs, as long as it is let."""
        return self.experiment("slow", "{hang: {m.how: hang}}")


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
        for place in ("cells", "pictures", "cases", "cells/b", "cells/b/0", "pictures/a/1", "cells/b/1/0"):
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
            "a name": ({"id": "../../../evil", "variant": "a", "case": "0"}, "4 were there"),
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
        self.write("p.yaml", PIPELINE.replace("number: m", "number: m, picture: shared"))
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
        # Two cells that hang and are tried twice: it goes on for four limits more.
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
