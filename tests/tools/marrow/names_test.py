# SPDX-License-Identifier: Apache-2.0
"""Names and folders: what a name may be, that no two results share a file, and what is replaced."""
import json
import shutil

from harness.program import Case, main

NUMBER = "marrow: 1\n%snodes:\n  c: {uses: test.constant, with: {value: 3}}\noutputs: {number: c}\n"
SIDES = """marrow: 1
name: sides
nodes:
  s: {uses: test.sides, with: {names: %s}}
  a: {uses: test.add, in: {a: s.both}}
outputs: {o: a}
"""
ROUNDS = 5


class Names(Case):
    has_own_store = False

    def test_a_pipelines_name_is_no_path(self):
        for name in ("run.json", "log.txt", "pipeline.yaml"):
            self.write("a/" + name, "mine")
        below = self.scratch / "a" / "b"
        for name in ("../../x", "x\\e[2J"):  # hostile_pipelines_test.cpp has others
            self.write("a/b/p.yaml", NUMBER % ('name: "%s"\n' % name))
            before = self.everything()
            said = ["p.yaml:2:1: error: a pipeline's name becomes a file name: '", "hint: use at most 100 letters"]
            for command in ("run", "check", "plan"):
                self.refused(said, command, "p.yaml", cwd=below)
            self.assertEqual(self.everything(), before)
        self.write("a/b/..yaml", NUMBER % "")
        said = "the pipeline takes its name from its file, and '.' cannot name a folder"
        self.refused(said, "run", "..yaml", cwd=below)
        self.assertEqual(self.read("a/pipeline.yaml"), "mine")

    def test_the_folder_of_a_rerun_is_none_either(self):
        self.expect(0, "run", self.write("p.yaml", NUMBER % ""), "--out", "a", "--quiet")
        self.write("a/pipeline.yaml", self.read("a/pipeline.yaml").replace("name: p", "name: ../../x"))
        self.refused("a pipeline's name becomes a file name: '../../x' cannot be one", "rerun", "a")
        self.assertFalse((self.scratch / "runs").exists())

    def test_two_runs_at_once_never_share_a_folder(self):
        self.write("p.yaml", NUMBER % "name: both\n")
        for number in range(ROUNDS):
            (self.scratch / ("empty%d" % number)).mkdir()
            for folder in (None, "out%d" % number, "empty%d" % number):
                out = ["--out", folder] if folder else []
                pair = [self.start("run", "p.yaml", "--set", "c.value=%d" % value, *out) for value in (1, 2)]
                errors = [process.communicate()[1] for process in pair]
                codes = [process.returncode for process in pair]
                self.assertEqual(sorted(codes), [0, 2] if folder else [0, 0], errors)
                if folder:
                    self.assertRegex(
                        errors[codes.index(2)],
                        "marrow: error: the output folder %s (was taken by another run just now|is already there and"
                        " not empty); choose another with --out" % folder,
                    )
        runs = ["both"] + ["both-%d" % i for i in range(2, 2 * ROUNDS + 1)]
        self.assertEqual(sorted(path.name for path in (self.scratch / "runs").iterdir()), sorted(runs))
        for folder in ["runs/" + name for name in runs] + [
            kind % i for kind in ("out%d", "empty%d") for i in range(ROUNDS)
        ]:
            value = self.metric(folder + "/outputs/number.json")
            self.assertEqual(self.json(folder + "/run.json")["overrides"], ["c.value=%d" % value])
            self.assertIn("value: %d\n" % value, self.read(folder + "/pipeline.yaml"))

    def test_each_item_has_a_file_of_its_own(self):
        self.write("p.yaml", SIDES % json.dumps(["a/b", "a_b", "a\\b", "..", "same", "same"]))
        self.expect(0, "run", "p.yaml", "--out", "a", "--quiet")
        names = ["a%2Fb", "a_b", "a%5Cb", "%2E.", "same", "same (2)"]
        output = self.json("a/run.json")["outputs"][0]
        self.assertEqual(output["files"], ["outputs/o/" + name + ".json" for name in names])
        self.assertEqual([self.metric("a/" + file) for file in output["files"]], [10, 20, 30, 40, 50, 60])
        # What reads a run finds each of them, without the store too.
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        record = self.read("b/run.json").replace(output["items"][0][1], "f" * 32)
        self.write("b/run.json", record.replace('"digests"', '"of the files of another run"'))
        self.write("b/outputs/o/a%2Fb.json", self.read("a/outputs/o/a%2Fb.json").replace("10.0", "11.0"))
        no_store = {"MARROW_CACHE": str(self.scratch / "no store")}
        told = self.expect(1, "diff", "a", "b", extra_environment=no_store).stdout
        self.assertIn("a%2Fb  value                    11, was 10 (+1) (by the files in outputs/)\n", told)
        self.expect(0, "show", "a")
        self.assertIn('"columns":%s' % json.dumps(names, separators=(",", ":")), self.read("a/report.html"))

    def test_what_is_replaced_and_what_not(self):
        for command, said in (
            ("show", "an existing one is replaced"),
            ("schema", "an existing one is replaced"),
            ("run", "new or empty (default: runs/NAME, or runs/NAME-2 ... if that exists)"),
        ):
            self.assertIn(said, " ".join(self.printed(command, "--help").split()))
        self.expect(0, "schema", "--out", self.write("s.json", "old"))
        self.assertIn("json-schema", self.read("s.json"))
        (self.scratch / "folder").mkdir()
        self.refused("cannot write folder: Is a directory", "schema", "--out", "folder")
        self.assertEqual(self.everything(), ["folder", "s.json"], "nothing temporary is left")


if __name__ == "__main__":
    main()
