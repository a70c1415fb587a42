# SPDX-License-Identifier: Apache-2.0
"""Runs whose folders are not as the runs left them: damaged, incomplete, older or none at all."""
import json
import shutil

from diff_cases import CHAIN, Runs
from harness.program import main

POWERS = "marrow: 1\nnodes:\n  p: {uses: test.powers}\n  n: {uses: test.last_power, in: {powers: p}}\noutputs: {n: n}\n"
SIDES = CHAIN.replace("outputs: {", "  s: {uses: test.sides, with: {names: [one, two]}}\noutputs: {both: s.both, ")
ADVICE = (
    "; give a folder that 'marrow run' wrote, or one of the cells of a comparison (FOLDER/cells/VARIANT/CASE/START)\n"
)


class Folders(Runs):
    def test_values_that_the_store_no_longer_has(self):
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}  # that no other test has filled
        self.use_version(1)
        self.run_into("a", POWERS, "--no-cache", "--seed", 3)
        self.use_version(2)
        self.run_into("b", POWERS, "--no-cache")
        told = self.diff(1, "a", "b")
        self.assertIn("\n  powers  by how much is not known: the store no longer has the value of both runs\n", told)
        self.assertIn("\n  n  value                    6.25 mm, was 4 (+2.25) (by the files in outputs/)\n", told)
        self.assertTrue(
            told.endswith(
                "\nWhat the store no longer has is made again by running a folder's pipeline.yaml with its seed, as  "
                "marrow run a/pipeline.yaml --seed 3\n"
            ),
            told,
        )

    def test_output_files_that_are_damaged_or_gone(self):
        self.run_both(SIDES, SIDES)
        (self.scratch / "a/outputs/sum.json").unlink()
        drawn, item = self.scratch / "b/outputs/drawn.json", self.scratch / "b/outputs/both/two.json"
        whole = drawn.read_bytes()
        drawn.write_bytes(whole[:-1] + b" ")
        item.unlink()
        item.symlink_to(self.scratch / "p.yaml")
        damaged = [
            "a/outputs/sum.json is missing",
            "b/outputs/both/two.json leads out of the folder",
            "b/outputs/drawn.json was changed since the run wrote it",
        ]
        told = self.diff(1, "a", "b")
        self.assertTrue(
            told.startswith(
                "first run (was): a\nsecond run (is): b\n\n"
                + "\n".join(damaged)
                + "\nEverything else compares what the runs computed, not these files\n\n"
                "What took part in both runs came out the same: 6 nodes\n"
            ),
            told,
        )
        self.assertNotIn("identical", told)
        told = json.loads(self.diff(1, "a", "b", "--json"))
        self.assertEqual((told["identical"], told["damaged_files"]), (False, damaged))
        self.assertIn("a/outputs/sum.json is missing\n", self.diff(1, "a", "a"))
        shutil.copy(self.scratch / "b/outputs/sum.json", self.scratch / "a/outputs")
        item.unlink()
        shutil.copy(self.scratch / "a/outputs/both/two.json", item)
        drawn.write_bytes(whole)
        self.assertIn("identical: all 6 nodes came out the same\n", self.diff(0, "a", "b"))

    def test_a_record_without_digests_is_compared_by_keys(self):
        self.run_into("a", CHAIN)
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        record = self.json("b/run.json")
        for output in record["outputs"]:
            self.assertEqual(len(output.pop("digests")), 1)
        self.write("b/run.json", json.dumps(record))
        (self.scratch / "b/outputs/sum.json").unlink()
        self.assertIn("identical", self.diff(0, "a", "b"))

    def test_folders_that_are_not_of_runs(self):
        self.run_into("a", CHAIN)
        pipeline, record = self.read("a/pipeline.yaml"), self.json("a/run.json")
        for node in record["nodes"]:
            del node["items"]
        (self.scratch / "empty").mkdir()
        for name in ("killed", "damaged", "old"):
            self.write(name + "/pipeline.yaml", pipeline)
        self.write("damaged/run.json", "{")
        self.write("bare/run.json", self.read("a/run.json"))
        self.write("old/run.json", json.dumps(record))
        shutil.copytree(self.scratch / "a", self.scratch / "linked")
        (self.scratch / "linked/pipeline.yaml").rename(self.scratch / "elsewhere.yaml")
        (self.scratch / "linked/pipeline.yaml").symlink_to(self.scratch / "elsewhere.yaml")
        for name, text in (
            ("nothing", " is not a folder" + ADVICE),
            ("empty", " is not the folder of a run: it has no run.json" + ADVICE),
            ("bare", " is not the whole folder of a run: it has a run.json, but no pipeline.yaml" + ADVICE),
            ("killed", " did not come to its end: it has a pipeline.yaml, but no run.json; run it again\n"),
            ("damaged", "/run.json is not what 'marrow run' wrote: "),
            (
                "linked",
                "/pipeline.yaml is a link to a file outside of the folder, and such files are not shown; copy it into "
                "the folder\n",
            ),
            (
                "old",
                "/run.json was written by an older marrow, which kept too little to compare it; run its pipeline.yaml "
                "again, with --seed 1\n",
            ),
        ):
            said = "marrow: error: " + ("the run in " if name == "killed" else "") + name + text
            for command in (["diff", name, "a"], ["diff", "a", name], ["rerun", name]):
                result = self.expect(2, *command)
                self.assertEqual(result.stdout, "")
                self.assertTrue(result.stderr.startswith(said), result.stderr)


if __name__ == "__main__":
    main()
