# SPDX-License-Identifier: Apache-2.0
"""What a kept cell, or a kept case, depends on: where any of it changes, nothing old passes for new."""
import contextlib
import os
import shutil
import subprocess

from compare_cases import DRAWN, Compared
from harness import MARROW, TEST_PLUGINS
from harness.program import another_run_makes_all, main, wait_until

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  s: {uses: test.work, with: {value: 0, path: $case}}
  r: {uses: parse.test_number, with: {path: other.txt}}
outputs: {number: r, work: s}
"""
OF_THE_CASE = PIPELINE.replace("other.txt", "$case/data")
CONSTANT = """marrow: 1
inputs: {case: {type: path}}
nodes:
  m: {uses: test.constant, with: {value: -3, path: $case}}
outputs: {number: m}
"""
SIMULATION = """marrow: 1
nodes:
  r: {uses: parse.test_number, with: {path: bone}}
  s: {uses: test.sides}
  sum: {uses: test.add, in: {a: s.both, b: r}}
outputs: {case: sum}
"""
METRICS = "metrics: [number.value, work.value]"
HEAD = "experiment: 1\npipeline: p.yaml\ncases: {folders: [cases/*]}\n" + METRICS + "\ntimed_cells: 0\n"


class Changes(Compared):
    pipeline, cases, variants = PIPELINE, "1", "{a: {}, b: {s.value: 0.1}}"
    files = {"other.txt": "one"}

    def experiment(self, name, variants, head=HEAD):
        return super().experiment(name, variants, head)

    def expect_fresh(self):
        """Every figure is the present one of its own cell."""
        self.compare()
        self.compare("--no-cache", out="fresh")
        present = lambda out: {cell: figure for cell, figure in self.figures(out).items() if figure}
        self.assertEqual(present("out"), present("fresh"))

    def changed_meanwhile(self, change, *arguments, status=2, waits=True):
        """What a comparison says when something changes once the row of cell a/1/0 is there. Where it waits, that is
        while the next cell waits for another run, so that it cannot end before."""
        if waits:  # all that cell a/1/0 needs is made, so that its row then comes from the store
            self.compare(file=self.experiment("a", "{a: {}}"), out="known")
        said, row = self.scratch / "said", self.kept_row("a/1/0")
        with another_run_makes_all(self.scratch / "cache") if waits else contextlib.nullcontext():
            with open(said, "w") as stream:
                words = ["compare", self.file, "--out", "out", "--jobs", "1", *arguments]
                process = self.start(*words, stdout=subprocess.DEVNULL, stderr=stream)
            is_waiting = lambda: "waits for another run" in said.read_text()
            wait_until(lambda: row.exists() and (not waits or is_waiting()), "no cell came")
            change()
        process.wait(timeout=240)
        self.assertEqual(process.returncode, status, said.read_text())
        return said.read_text()

    def test_a_file_that_an_option_names(self):
        self.compare()
        old = self.figures()
        self.assertIn("2 were there already", self.compare().stdout)
        self.write("other.txt", "two")
        self.assertIn("0 were there already", self.compare().stdout)
        self.expect_fresh()
        self.assertNotEqual(self.figures(), old)

    def test_a_path_that_is_not_there_or_cannot_be_read_costs_the_cells_that_need_it(self):
        self.experiment("e", "{a: {}, b: {r.path: nothing.txt}}")
        self.compare("--no-cache")  # this reader takes it for an empty file
        self.assertEqual(self.figures(column="status"), {"a/1/0": "done", "b/1/0": "done"})
        (self.scratch / "folder").mkdir()
        (self.scratch / "folder" / "link").symlink_to(self.scratch / "other.txt")
        self.experiment("e", "{a: {}, b: {r.path: folder}}")
        told = self.compare("--no-cache").stdout
        self.assertEqual(self.figures(column="status"), {"a/1/0": "done", "b/1/0": "failed"})
        self.assertRegex(told, r"b/1/0: .*folder/link: is a link to a place outside")

    def test_pictures_of_another_state_do_not_stay(self):
        self.write("p.yaml", PIPELINE.replace("outputs: {", DRAWN % "r" + "outputs: {picture: drawn, "))
        head = HEAD.replace("timed_cells: 0", "timed_cells: 1\npictures: [picture]")
        self.experiment("e", "{a: {s.value: 4}}", head)
        self.compare()
        key = self.out / "pictures/a/1/0/key.txt"
        self.assertTrue(key.exists())
        self.kept_row("a/1/0").unlink()
        self.write("other.txt", "two")
        said = self.changed_meanwhile(lambda: self.write("other.txt", "three"), waits=False)  # its time is measured
        self.assertIn("no pictures of a/1/0: what cell a/1/0 depends on changed", said)
        self.assertFalse(key.exists())

    def test_a_file_that_a_case_is_simulated_from(self):
        self.write("s.yaml", SIMULATION)
        self.write("p.yaml", PIPELINE.replace("other.txt", "$case/a.json"))
        head = HEAD.replace("folders: [cases/*]", "simulate: {pipeline: s.yaml, seeds: [1]}")
        self.experiment("e", "{a: {}}", head)
        cases = {}
        for content in ("old", "new", "old"):
            self.write("bone", content)
            self.compare()
            kept = set((self.scratch / "cache" / "cases").glob("*/outputs/case/a.json"))
            cases.setdefault(content, kept - set().union(*cases.values()))
        self.assertEqual([len(found) for found in cases.values()], [1, 1])
        old, new = (found.pop().read_text() for found in cases.values())
        self.assertNotEqual(old, new)

    def test_which_values_are_better(self):
        self.write("p.yaml", CONSTANT)
        head = HEAD.replace(METRICS, "success: {number.value: 2}\nmetrics: [{figure: number.value, better: %s}]")
        for better, figure, success in (("lower", "-3", "1"), ("nearest_zero", "3", "0"), ("lower", "-3", "1")):
            self.experiment("e", "{a: {}}", head % better)
            self.compare()
            found = self.figures()["a/1/0"], self.figures(column="success")["a/1/0"]
            self.assertEqual(found, (figure, success), better)
        self.experiment("e", "{a: {}}", head % "higher")
        self.assertIn("1 were there already", self.compare().stdout)

    def expect_said_of_a_change(self, changed, named):
        said = self.changed_meanwhile(lambda: self.write(changed, "another"))
        self.assertIn("%s was changed while the comparison ran" % (self.scratch / named), said)
        self.expect_fresh()

    def test_a_file_that_changes_meanwhile(self):
        self.expect_said_of_a_change("other.txt", "other.txt")

    def test_a_case_that_changes_meanwhile(self):
        self.write("p.yaml", OF_THE_CASE)
        self.expect_said_of_a_change("cases/1/data", "cases/1")

    def test_a_file_that_changes_and_changes_back(self):
        self.changed_meanwhile(lambda: [self.write("other.txt", content) for content in ("two", "one")], status=0)
        reason = "a file that the cell needs was changed while it ran; run it again"
        self.assertEqual(self.figures(column="reason"), {"a/1/0": "", "b/1/0": reason})

    def with_a_crash(self):
        """After this, another process continues and checks everything itself."""
        self.add_case("2")
        self.add_case("3")
        node = "  m: {uses: test.misbehave, in: {a: s}}\noutputs: {number: r, work: m}"
        self.write("p.yaml", OF_THE_CASE.replace("outputs: {number: r, work: s}", node))
        self.experiment("e", "{a: {}, b: {s.value: 1.5}, crash: {m.how: crash}}")

    def test_a_case_that_comes_meanwhile(self):
        self.with_a_crash()
        said = self.changed_meanwhile(lambda: self.add_case("0"), "--no-cache", waits=False)
        self.assertIn("the list of cases ('0' is new) was changed while the comparison ran", said)
        old = self.figures()
        done = [cell for cell, figure in old.items() if figure]
        self.assertEqual(done, ["a/1/0", "b/1/0", "a/2/0", "b/2/0", "a/3/0", "b/3/0"])
        self.expect_fresh()
        self.assertLessEqual(old.items(), self.figures().items(), "none was booked on another case")

    def test_a_plugin_that_is_rebuilt_meanwhile(self):
        self.with_a_crash()
        shutil.copytree(TEST_PLUGINS, self.scratch / "plugins")
        self.plugins = [self.scratch / "plugins"]
        library = self.scratch / "plugins" / "marrow_test_readers.so"

        def rebuild():
            content = library.read_bytes()
            library.unlink()
            library.write_bytes(content + b"\0")
            library.with_suffix(".json").unlink()  # what it holds is asked anew

        said = self.changed_meanwhile(rebuild)
        self.assertIn("the plugin of parse.test_number was changed while the comparison ran", said)
        of_others = {status for cell, status in self.figures(column="status").items() if "/1/" not in cell}
        self.assertEqual(of_others, {"failed"})
        reason = self.figures(column="reason")["a/2/0"]
        self.assertIn("depends on changed while the comparison ran; run it again", reason)

    def test_nothing_is_removed_from_what_is_mounted_in_a_cell(self):
        if subprocess.run(["unshare", "-m", "true"], stderr=subprocess.DEVNULL).returncode:
            self.skipTest("nothing can be mounted here")
        self.experiment("e", "{a: {}}")
        self.compare()
        self.write("mine/file", "keep")
        self.write("other.txt", "two")
        mounted = "out/cells/a/1/0/outputs"
        command = ["unshare", "-m", "sh", "-c", 'mount --bind mine "$0" && exec "$@"', mounted]
        command += [MARROW, "compare", self.file, "--out", "out"]
        environment = {**os.environ, "MARROW_PLUGIN_PATH": str(TEST_PLUGINS), **self.variables()}
        result = subprocess.run(command, env=environment, cwd=self.scratch, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        said = "a/1/0: something is mounted at %s, where nothing is removed; unmount it" % mounted
        self.assertIn(said, result.stdout)
        self.assertEqual(self.read("mine/file"), "keep")
        self.expect_fresh()


if __name__ == "__main__":
    main()
