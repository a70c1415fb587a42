# SPDX-License-Identifier: Apache-2.0
"""Names and folders: what a name may be, that no two results share a file, and what is replaced."""
import json
import os
import shutil
import subprocess

from harness import MARROW, TEST_PLUGINS
from harness.program import main
from number_cases import NUMBER, Commands

SIDES = (
    "marrow: 1\nname: sides\nnodes:\n  s: {uses: test.sides, with: {names: %s}}\n  a: {uses: test.add, in: {a:"
    " s.both}}\noutputs: {o: a}\n"
)


class Names(Commands):
    def test_a_pipelines_name_is_no_path(self):
        (self.scratch / "a" / "b").mkdir(parents=True)
        for name in ("run.json", "log.txt", "pipeline.yaml"):
            self.write("a/" + name, "mine")
        for name in ("../../x", "..", ".", "/tmp/marrow-x", "a\\\\b", "x\\e[2J"):
            self.write("a/b/p.yaml", NUMBER % ('name: "%s"\n' % name))
            before = self.everything()
            for command in ("run", "check", "plan"):
                result = self.expect(2, command, "p.yaml", cwd=self.scratch / "a" / "b")
                self.assertIn("p.yaml:2:1: error: a pipeline's name becomes a file name: '", result.stderr)
                self.assertIn("hint: use at most 100 letters", result.stderr)
            self.assertEqual(self.everything(), before)
        self.write("a/b/..yaml", NUMBER % "")
        self.assertIn(
            "the pipeline takes its name from its file, and '.' cannot name a folder",
            self.expect(2, "run", "..yaml", cwd=self.scratch / "a" / "b").stderr,
        )
        self.assertEqual((self.scratch / "a" / "pipeline.yaml").read_text(), "mine")

    def test_the_folder_of_a_rerun_is_none_either(self):
        self.expect(0, "run", self.write("p.yaml", NUMBER % ""), "--out", "a", "--quiet")
        self.write(
            "a/pipeline.yaml", (self.scratch / "a" / "pipeline.yaml").read_text().replace("name: p", "name: ../../x")
        )
        self.assertIn(
            "a pipeline's name becomes a file name: '../../x' cannot be one", self.expect(2, "rerun", "a").stderr
        )
        self.assertFalse((self.scratch / "runs").exists())

    def test_two_runs_at_once_never_share_a_folder(self):
        text = NUMBER % "name: both\n"
        self.write("p.yaml", text)
        environment = dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS))
        for round in range(10):
            (self.scratch / ("empty%d" % round)).mkdir()
            for folder in (None, "out%d" % round, "empty%d" % round):
                out = ["--out", folder] if folder else []
                pair = [
                    subprocess.Popen(
                        [str(MARROW), "run", "p.yaml", "--set", "c.value=%d" % value, *out],
                        cwd=self.scratch,
                        env=environment,
                        stdout=subprocess.DEVNULL,
                        stderr=subprocess.PIPE,
                        text=True,
                    )
                    for value in (1, 2)
                ]
                errors = [process.communicate()[1] for process in pair]
                codes = [process.returncode for process in pair]
                self.assertEqual(sorted(codes), [0, 2] if folder else [0, 0], errors)
                if folder:
                    self.assertRegex(
                        errors[codes.index(2)],
                        "marrow: error: the output folder %s (was taken by another run just now|is already there and"
                        " not empty); choose another with --out" % folder,
                    )
        values = []
        for folder in [*(self.scratch / "runs").iterdir(), *self.scratch.glob("out*"), *self.scratch.glob("empty*")]:
            value = json.loads((folder / "outputs" / "number.json").read_text())["metrics"][0]["value"]
            self.assertEqual(json.loads((folder / "run.json").read_text())["overrides"], ["c.value=%d" % value])
            self.assertIn("value: %d\n" % value, (folder / "pipeline.yaml").read_text())
            values.append(value)
        self.assertEqual(len(values), 40)
        self.assertEqual(
            sorted(path.name for path in (self.scratch / "runs").iterdir()),
            sorted(["both"] + ["both-%d" % i for i in range(2, 21)]),
        )

    def test_each_item_has_a_file_of_its_own(self):
        names = ["a/b", "a_b", "a\\b", "..", "same", "same"]
        self.write("p.yaml", SIDES % json.dumps(names))
        self.expect(0, "run", "p.yaml", "--out", "a", "--quiet")
        record = json.loads((self.scratch / "a" / "run.json").read_text())
        files = record["outputs"][0]["files"]
        self.assertEqual(
            files, ["outputs/o/" + name + ".json" for name in ("a%2Fb", "a_b", "a%5Cb", "%2E.", "same", "same (2)")]
        )
        values = [json.loads((self.scratch / "a" / file).read_text())["metrics"][0]["value"] for file in files]
        self.assertEqual(values, [10, 20, 30, 40, 50, 60])
        # What reads a run finds each of them, without the store too.
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        changed = self.scratch / "b" / "run.json"
        key = record["outputs"][0]["items"][0][1]
        changed.write_text(
            changed.read_text().replace(key, "f" * 32).replace('"digests"', '"of the files of another run"')
        )
        self.write(
            "b/outputs/o/a%2Fb.json", (self.scratch / "a" / "outputs/o/a%2Fb.json").read_text().replace("10.0", "11.0")
        )
        told = self.expect(
            1, "diff", "a", "b", extra_environment={"MARROW_CACHE": str(self.scratch / "no store")}
        ).stdout
        self.assertIn("a%2Fb  value                    11, was 10 (+1) (by the files in outputs/)\n", told)
        self.expect(0, "show", "a")
        self.assertIn(
            '"columns":["a%2Fb","a_b","a%5Cb","%2E.","same","same (2)"]',
            (self.scratch / "a" / "report.html").read_text(),
        )

    def test_what_is_replaced_and_what_not(self):
        self.assertIn("an existing one is replaced", " ".join(self.expect(0, "show", "--help").stdout.split()))
        self.assertIn("an existing one is replaced", " ".join(self.expect(0, "schema", "--help").stdout.split()))
        self.assertIn(
            "new or empty (default: runs/NAME, or runs/NAME-2 ... if that exists)",
            " ".join(self.expect(0, "run", "--help").stdout.split()),
        )
        self.expect(0, "schema", "--out", self.write("s.json", "old"))
        self.assertIn("json-schema", (self.scratch / "s.json").read_text())
        (self.scratch / "folder").mkdir()
        self.assertIn("cannot write folder: Is a directory", self.expect(2, "schema", "--out", "folder").stderr)
        self.assertEqual(self.everything(), ["folder", "s.json"], "nothing temporary is left")


if __name__ == "__main__":
    main()
