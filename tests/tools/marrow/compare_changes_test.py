# SPDX-License-Identifier: Apache-2.0
"""What a kept cell, or a kept case, depends on: where any of it changes, nothing old passes for new."""
import contextlib
import os
import shutil
import subprocess

from compare_cases import DRAWN
from harness import MARROW, TEST_PLUGINS
from harness.program import Case, another_run_makes_all, main, wait_until

PIPELINE = """marrow: 1
inputs: {case: {type: path}}
nodes:
  s: {uses: test.work, with: {value: 0, path: $case}}
  r: {uses: parse.test_number, with: {path: other.txt}}
outputs: {number: r, work: s}
"""
HEAD = """experiment: 1
pipeline: p.yaml
cases: {folders: [cases/*]}
metrics: [number.value, work.value]
timed_cells: 0
"""


class Changes(Case):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        self.write("other.txt", "one")
        self.add_case("1")
        self.file = self.write("e.yaml", HEAD + "variants: {a: {}, b: {s.value: 0.1}}\n")
        self.environment = dict(
            os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS), MARROW_CACHE=str(self.scratch / "cache")
        )

    def add_case(self, name):
        (self.scratch / "cases" / name).mkdir(parents=True)
        self.write("cases/%s/data" % name, "case " + name)

    def compare(self, out, *arguments, code=0):
        result = self.marrow("compare", self.file, "--out", out, *arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def figures(self, out, column="number.value"):
        return {cell: row[column] for cell, row in self.rows(out).items()}

    def expect_fresh(self, out):
        """Every figure is the present one of its own cell."""
        self.compare("fresh", "--no-cache")
        fresh = self.figures("fresh")
        self.assertEqual(
            {cell: figure for cell, figure in self.figures(out).items() if figure},
            {cell: figure for cell, figure in fresh.items() if figure},
        )

    def know_cell_a(self):
        """Makes all that cell a/1/0 needs, so that its row then comes from the store."""
        whole, self.file = self.file, self.write("a.yaml", HEAD + "variants: {a: {}}\n")
        self.compare("known")
        self.file = whole

    def changed_meanwhile(self, change, *arguments, code=2, waits=True):
        """What a comparison says when something changes once the row of cell a/1/0 is there. Where it waits, that is
        while the next cell waits for another run, so that it cannot end before."""
        if waits:
            self.know_cell_a()
        said, row = self.scratch / "said", self.scratch / "out" / "cells" / "a" / "1" / "0" / "cell.json"
        with another_run_makes_all(self.scratch / "cache") if waits else contextlib.nullcontext():
            with open(said, "w") as stream:
                process = subprocess.Popen(
                    [str(MARROW), "compare", str(self.file), "--out", "out", "--jobs", "1", *arguments],
                    env=self.environment,
                    cwd=self.scratch,
                    stdout=subprocess.DEVNULL,
                    stderr=stream,
                )
            self.addCleanup(process.wait)
            self.addCleanup(process.kill)  # where the test ends before
            is_waiting = lambda: "waits for another run" in said.read_text()
            wait_until(lambda: row.exists() and (not waits or is_waiting()), "no cell came")
            change()
        process.wait(timeout=240)
        self.assertEqual(process.returncode, code, said.read_text())
        return said.read_text()

    def test_a_file_that_an_option_names(self):
        self.compare("out")
        old = self.figures("out")
        self.assertIn("2 were there already", self.compare("out").stdout)
        self.write("other.txt", "two")
        self.assertIn("0 were there already", self.compare("out").stdout)
        self.compare("fresh", "--no-cache")
        self.assertEqual(self.figures("out"), self.figures("fresh"))
        self.assertNotEqual(self.figures("out"), old)

    def test_a_path_that_is_not_there_or_cannot_be_read_costs_the_cells_that_need_it(self):
        self.write("e.yaml", HEAD + "variants: {a: {}, b: {r.path: nothing.txt}}\n")
        self.compare("out", "--no-cache")  # this reader takes it for an empty file
        self.assertEqual(self.figures("out", "status"), {"a/1/0": "done", "b/1/0": "done"})
        (self.scratch / "folder").mkdir()
        (self.scratch / "folder" / "link").symlink_to(self.scratch / "other.txt")
        self.write("e.yaml", HEAD + "variants: {a: {}, b: {r.path: folder}}\n")
        result = self.compare("out", "--no-cache")
        self.assertEqual(self.figures("out", "status"), {"a/1/0": "done", "b/1/0": "failed"})
        self.assertRegex(result.stdout, r"b/1/0: .*folder/link: is a link to a place outside")

    def test_pictures_of_another_state_do_not_stay(self):
        head = HEAD.replace("timed_cells: 0", "timed_cells: 1")
        self.write("p.yaml", PIPELINE.replace("outputs: {", DRAWN % "r" + "outputs: {picture: drawn, "))
        self.write("e.yaml", head + "pictures: [picture]\nvariants: {a: {s.value: 4}}\n")
        self.compare("out")
        key = self.scratch / "out" / "pictures" / "a" / "1" / "0" / "key.txt"
        self.assertTrue(key.exists())
        (self.scratch / "out" / "cells" / "a" / "1" / "0" / "cell.json").unlink()
        self.write("other.txt", "two")
        said = self.changed_meanwhile(lambda: self.write("other.txt", "three"), waits=False)  # its time is measured
        self.assertIn("no pictures of a/1/0: what cell a/1/0 depends on changed", said)
        self.assertFalse(key.exists())

    def test_a_file_that_a_case_is_simulated_from(self):
        self.write(
            "s.yaml",
            (
                "marrow: 1\nnodes:\n  r: {uses: parse.test_number, with: {path: bone}}\n  s: {uses: test.sides}\n"
                "  sum: {uses: test.add, in: {a: s.both, b: r}}\noutputs: {case: sum}\n"
            ),
        )
        self.write("p.yaml", PIPELINE.replace("other.txt", "$case/a.json"))
        self.write(
            "e.yaml",
            HEAD.replace("folders: [cases/*]", "simulate: {pipeline: s.yaml, seeds: [1]}") + "variants: {a: {}}\n",
        )
        cases = {}
        for content in ("old", "new", "old"):
            self.write("bone", content)
            self.compare("out")
            kept = set((self.scratch / "cache" / "cases").glob("*/outputs/case/a.json"))
            cases.setdefault(content, kept - set().union(*cases.values()))
        self.assertEqual([len(found) for found in cases.values()], [1, 1])
        old, new = (found.pop().read_text() for found in cases.values())
        self.assertNotEqual(old, new)

    def test_which_values_are_better(self):
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {case: {type: path}}\nnodes:\n  m: {uses: test.constant, with: {value: -3, path:"
                " $case}}\noutputs: {number: m}\n"
            ),
        )
        head = HEAD.replace(
            "metrics: [number.value, work.value]",
            "success: {number.value: 2}\nmetrics: [{figure: number.value, better: %s}]",
        )
        for better, figure, success in (("lower", "-3", "1"), ("nearest_zero", "3", "0"), ("lower", "-3", "1")):
            self.write("e.yaml", head % better + "variants: {a: {}}\n")
            self.compare("out")
            self.assertEqual(
                (self.figures("out"), self.figures("out", "success")), ({"a/1/0": figure}, {"a/1/0": success}), better
            )
        self.write("e.yaml", head % "higher" + "variants: {a: {}}\n")
        self.assertIn("1 were there already", self.compare("out").stdout)

    def test_a_file_that_changes_meanwhile(self):
        said = self.changed_meanwhile(lambda: self.write("other.txt", "two"))
        self.assertIn("%s was changed while the comparison ran" % (self.scratch / "other.txt"), said)
        self.compare("out")
        self.expect_fresh("out")

    def test_a_file_that_changes_and_changes_back(self):
        def change():
            for content in ("two", "one"):
                self.write("other.txt", content)

        self.changed_meanwhile(change, code=0)
        self.assertEqual(
            self.figures("out", "reason"),
            {"a/1/0": "", "b/1/0": "a file that the cell needs was changed while it ran; run it again"},
        )

    def test_a_case_that_changes_meanwhile(self):
        self.write("p.yaml", PIPELINE.replace("other.txt", "$case/data"))
        said = self.changed_meanwhile(lambda: self.write("cases/1/data", "another"))
        self.assertIn("%s was changed while the comparison ran" % (self.scratch / "cases" / "1"), said)
        self.compare("out")
        self.expect_fresh("out")

    def with_a_crash(self):
        """After this, another process continues and checks everything itself."""
        self.add_case("2")
        self.add_case("3")
        self.write(
            "p.yaml",
            PIPELINE.replace("other.txt", "$case/data").replace(
                "outputs: {number: r, work: s}",
                "  m: {uses: test.misbehave, in: {a: s}}\noutputs: {number: r, work: m}",
            ),
        )
        self.write("e.yaml", HEAD + "variants: {a: {}, b: {s.value: 1.5}, crash: {m.how: crash}}\n")

    def test_a_case_that_comes_meanwhile(self):
        self.with_a_crash()
        said = self.changed_meanwhile(lambda: self.add_case("0"), "--no-cache", waits=False)
        self.assertIn("the list of cases ('0' is new) was changed while the comparison ran", said)
        old = self.figures("out")
        self.assertEqual(
            [cell for cell, figure in old.items() if figure], ["a/1/0", "b/1/0", "a/2/0", "b/2/0", "a/3/0", "b/3/0"]
        )
        self.compare("out")
        self.expect_fresh("out")
        self.assertLessEqual(old.items(), self.figures("out").items(), "none was booked on another case")

    def test_a_plugin_that_is_rebuilt_meanwhile(self):
        self.with_a_crash()
        shutil.copytree(TEST_PLUGINS, self.scratch / "plugins")
        self.environment["MARROW_PLUGIN_PATH"] = str(self.scratch / "plugins")

        def rebuild():
            library = self.scratch / "plugins" / "marrow_test_readers.so"
            content = library.read_bytes()
            library.unlink()
            library.write_bytes(content + b"\0")
            library.with_suffix(".json").unlink()  # what it holds is asked anew

        said = self.changed_meanwhile(rebuild)
        self.assertIn("the plugin of parse.test_number was changed while the comparison ran", said)
        self.assertEqual({row for cell, row in self.figures("out", "status").items() if "/1/" not in cell}, {"failed"})
        self.assertIn(
            "depends on changed while the comparison ran; run it again", self.figures("out", "reason")["a/2/0"]
        )

    def test_nothing_is_removed_from_what_is_mounted_in_a_cell(self):
        if subprocess.run(["unshare", "-m", "true"], stderr=subprocess.DEVNULL).returncode:
            self.skipTest("nothing can be mounted here")
        self.write("e.yaml", HEAD + "variants: {a: {}}\n")
        self.compare("out")
        (self.scratch / "mine").mkdir()
        self.write("mine/file", "keep")
        self.write("other.txt", "two")
        mounted = "out/cells/a/1/0/outputs"
        command = [
            "unshare",
            "-m",
            "sh",
            "-c",
            'mount --bind mine "$0" && exec "$@"',
            mounted,
            str(MARROW),
            "compare",
            str(self.file),
            "--out",
            "out",
        ]
        result = subprocess.run(command, env=self.environment, cwd=self.scratch, capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(
            "a/1/0: something is mounted at %s, where nothing is removed; unmount it" % mounted, result.stdout
        )
        self.assertEqual((self.scratch / "mine" / "file").read_text(), "keep")
        self.compare("out")
        self.expect_fresh("out")


if __name__ == "__main__":
    main()
