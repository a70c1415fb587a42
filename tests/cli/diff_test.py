# SPDX-License-Identifier: Apache-2.0
"""Where two runs part, by how much and why."""
import json
import shutil

from cases import FEMUR, SMALL, matrix_product, mha, png, rotation_vector_deg, simulate, transposed
from marrow_cli import BUILD, TEST_PLUGINS, Case, main, marrow

VERSIONS = BUILD / "tests" / "plugin_versions"
CHAIN = """marrow: 1
nodes:
  draw: {uses: test.draw}
  first: {uses: test.constant, with: {value: 3, word: one}}
  other: {uses: test.constant, with: {value: 4}}
  sum: {uses: test.add, in: {a: first, b: other}}
  drawn: {uses: test.add, in: {a: sum, b: draw}}
outputs: {sum: sum, drawn: drawn}
"""
FILES = """marrow: 1
inputs: {data: {type: path}}
nodes:
  read: {uses: test.file_size, with: {path: $data}}
  sum: {uses: test.add, in: {a: read}}
outputs: {sum: sum}
"""


class Runs(Case):
    def setUp(self):
        super().setUp()
        self.plugins = [TEST_PLUGINS]
        self.environment = {}

    def marrow(self, *arguments, **more):
        return marrow(
            *arguments, plugins=self.plugins, extra_environment=self.environment, **{"cwd": self.scratch, **more}
        )

    def run_into(self, name, text, *arguments, code=0):
        result = self.marrow("run", self.write("p.yaml", text), "--out", name, "--quiet", *arguments)
        self.assertEqual(result.returncode, code, result.stderr)

    def diff(self, code, *arguments):
        result = self.marrow("diff", *arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertEqual(result.stderr, "")
        return result.stdout

    def expect(self, code, text):
        """That the difference of the runs a and b is told in these words."""
        self.assertEqual(self.diff(code, "a", "b"), "first run (was): a\nsecond run (is): b\n\n" + text)

    def use_version(self, version, extra=b""):
        """A plugin that is built anew under its old name; `extra` bytes at its end give it another build id and nothing
        else."""
        folder = self.scratch / "plugins"
        folder.mkdir(exist_ok=True)
        (folder / "marrow_versions.so").unlink(missing_ok=True)
        (folder / "marrow_versions.so").write_bytes(
            (VERSIONS / ("marrow_test_versions_%d.so" % version)).read_bytes() + extra
        )
        self.plugins = [folder, TEST_PLUGINS]

    def build_ids(self, a="a", b="b"):
        ids = [json.loads((self.scratch / name / "run.json").read_text())["plugins"] for name in (a, b)]
        return [next(plugin["build_id"][:8] for plugin in one if plugin["file"] == "marrow_versions.so") for one in ids]


class Diff(Runs):
    def test_identical_runs(self):
        self.run_into("a", CHAIN)
        self.run_into("b", CHAIN)  # all of it read back from the store
        self.expect(0, "identical: all 5 nodes came out the same\n")

    def test_an_option(self):
        self.run_into("a", CHAIN)
        self.run_into("b", CHAIN, "--set", "other.value=4.25")
        self.expect(
            1,
            "First difference: node 'other' (test.constant)\n"
            "  why: option 'value' is 4.25, was 4\n"
            "  number  value                    4.25, was 4 (+0.25)\n"
            "In consequence differ: sum, drawn\n"
            "The same in both runs: 2 nodes\n\n"
            "Outputs that differ\n"
            "  sum    value                    7.25, was 7 (+0.25)\n"
            "  drawn  value                    %s\n" % self.drawn(),
        )

    def drawn(self):
        a, b = (
            json.loads((self.scratch / name / "outputs" / "drawn.json").read_text())["metrics"][0]["value"]
            for name in "ab"
        )
        return "%.5g, was %.5g (%+.3g)" % (b, a, b - a)

    def test_only_the_reason_of_the_first_node_is_its_reason(self):
        self.run_into("a", CHAIN)
        self.run_into(
            "b", CHAIN, "--set", "first.value=5", "--set", "first.word=two", "--set", "other.word=three", "--seed", 2
        )
        text = self.diff(1, "a", "b")
        self.assertIn(
            (
                "First difference: node 'draw' (test.draw)\n  why: it draws random numbers, and the seed is 2, was 1\n "
                " number  value"
            ),
            text,
        )
        self.assertIn(
            (
                "Node 'first' (test.constant) differs by itself, too\n  why: option 'value' is 5, was 3\n  why: option"
                " 'word' is two, was one\n"
            ),
            text,
        )
        self.assertIn("In consequence differ: sum, drawn\nThe same in both runs: 1 node\n", text)
        self.assertIn("Also changed: node 'other': option 'word' is three, was one (with the same result)\n", text)

    def test_a_seed_that_nothing_draws_from(self):
        text = CHAIN.replace("  draw: {uses: test.draw}\n", "").replace("b: draw", "b: other")
        self.run_into("a", text)
        self.run_into("b", text, "--seed", 2)
        self.expect(0, "identical: all 4 nodes came out the same\nAlso changed: the seed is 2, was 1\n")

    def test_a_plugin_that_was_rebuilt(self):
        text = CHAIN.replace(
            "drawn: {uses: test.add, in: {a: sum, b: draw}}", "drawn: {uses: test.scale, in: {a: sum}}"
        )
        self.use_version(1)
        self.run_into("a", text)
        self.use_version(2)
        self.run_into("b", text)
        before, now = self.build_ids()
        self.expect(
            1,
            "First difference: node 'drawn' (test.scale)\n"
            "  why: its plugin marrow_versions.so is another build (build id %s, was %s)\n"
            "  scaled  value                    17.5 mm, was 14 (+3.5)\n"
            "The same in both runs: 3 nodes\n"
            "Of another build: marrow_versions.so (build id %s, was %s)\n\n"
            "Outputs that differ\n"
            "  drawn  as above\n"
            "Outputs that are the same: sum\n" % (now, before, now, before),
        )

    def test_a_rebuilt_plugin_with_the_same_results(self):
        text = (
            "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  f: {uses: test.scaler}\n  n: {uses: test.apply_scaler,"
            " in: {scaler: f, to: c}}\noutputs: {n: n}\n"
        )
        self.use_version(2)
        self.run_into("a", text)
        self.use_version(2, extra=b"newer")
        self.run_into("b", text)
        before, now = self.build_ids()
        self.expect(
            0,
            "identical: all 2 nodes came out the same\nOf another build: marrow_versions.so (build id %s, was %s)\n"
            % (now, before),
        )

    def test_a_rebuilt_framework(self):
        self.run_into("a", CHAIN)
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        record = json.loads((self.scratch / "b" / "run.json").read_text())
        record["framework"] = record["plugins"][0]["build_id"] = "0" * 32
        self.write("b/run.json", json.dumps(record))
        self.expect(
            0,
            (
                "identical: all 5 nodes came out the same\n"
                "Of another build: marrow's own library, and with it the build ids of marrow_test_numbers.so\n"
            ),
        )

    def test_a_function_that_a_node_calls(self):
        text = (
            "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  f: {uses: test.adder, in: {amount: c}}\n  n: {uses:"
            " test.apply, in: {adder: f, to: c}}\noutputs: {n: n}\n"
        )
        self.run_into("a", text)
        self.run_into(
            "b",
            text.replace("amount: c", "amount: d").replace(
                "nodes:", "nodes:\n  d: {uses: test.constant, with: {value: 2}}"
            ),
        )
        self.expect(
            1,
            (
                "First difference: node 'n' (test.apply)\n  why: the function of node 'f', which it calls: input"
                " 'amount' is wired to d (there was no node 'd'), was wired to c\n  number  value                    3,"
                " was 2 (+1)\nThe same in both runs: 1 node\nOnly in the second run: d\n\nOutputs that differ\n  n  as"
                " above\n"
            ),
        )

    def test_a_plugins_own_type(self):
        text = (
            "marrow: 1\nnodes:\n  p: {uses: test.powers}\n  n: {uses: test.last_power, in: {powers: p}}\noutputs: {n:"
            " n}\n"
        )
        self.use_version(1)
        self.run_into("a", text)
        self.use_version(2)
        self.run_into("b", text)
        self.assertIn(
            "First difference: node 'p' (test.powers)\n  why: its plugin marrow_versions.so is another build",
            self.diff(1, "a", "b"),
        )
        self.assertIn("\n  powers  2 of 32 bytes of the powers differ\n", self.diff(1, "a", "b"))

    def test_another_node_and_other_wires(self):
        self.run_into("a", CHAIN)
        self.run_into(
            "b",
            CHAIN.replace(
                "{uses: test.add, in: {a: first, b: other}}",
                "{uses: test.fail_above, in: {a: other}, with: {value: 9}}",
            ),
        )
        text = self.diff(1, "a", "b")
        self.assertIn(
            (
                "First difference: node 'sum' (test.fail_above)\n"
                "  why: it uses test.fail_above, used test.add\n"
                "  why: input 'a' is wired to other, was wired to first (there is no node 'first')\n"
                "  why: input 'b' is not wired, was wired to other\n"
                "  number  value                    4, was 7 (-3)\n"
            ),
            text,
        )
        self.assertIn("Only in the first run: first\n", text)

    def test_only_a_node_more(self):
        self.run_into("a", CHAIN)
        self.run_into("b", CHAIN.replace("outputs: {", "  more: {uses: test.constant}\noutputs: {more: more, "))
        self.expect(
            1,
            (
                "What took part in both runs came out the same: 5 nodes\n"
                "Only in the second run: more\n\n"
                "Outputs that only the second run has: more\n"
                "Outputs that are the same: sum, drawn\n"
            ),
        )

    def test_items_of_lists(self):
        text = (
            "marrow: 1\nnodes:\n  s: {uses: test.sides, with: {names: [a, b]}}\n  n: {uses: test.add, in: {a:"
            " s.both}}\noutputs: {n: n}\n"
        )
        self.run_into("a", text)
        self.run_into("b", text.replace("[a, b]", "[b, a, c]"))
        self.expect(
            1,
            (
                "First difference: node 's' (test.sides)\n"
                "  why: option 'names' is [b, a, c], was [a, b]\n"
                "  both a  value                    20, was 10 (+10)\n"
                "  both b  value                    10, was 20 (-10)\n"
                "  both c  it was not there\n"
                "In consequence differ: n\n"
                "The same in both runs: 0 nodes\n\n"
                "Outputs that differ\n"
                "  n a  as above\n"
                "  n b  as above\n"
                "  n c  it was not there\n"
            ),
        )

    def test_a_file_that_changed_under_its_path(self):
        self.use_version(1)
        path = self.write("ct", "1")
        self.run_into("a", FILES, "data=ct")
        path.write_text("22")
        self.run_into("b", FILES, "data=ct")
        self.expect(
            1,
            "First difference: node 'read' (test.file_size)\n"
            "  why: the content of the file %s (option 'path') differs\n"
            "  bytes  bytes                    2, was 1 (+1)\n"
            "In consequence differ: sum\n"
            "The same in both runs: 0 nodes\n\n"
            "Outputs that differ\n"
            "  sum  value                    2, was 1 (+1)\n" % path,
        )

    def test_folders_count_by_their_content(self):
        self.use_version(1)
        for name, content in (("one", "1"), ("same", "1"), ("two", "22")):
            (self.scratch / name).mkdir()
            self.write(name + "/ct", content)
            self.run_into("of-" + name, FILES, "data=" + name)
        self.assertIn("\nidentical: all 2 nodes came out the same\n", self.diff(0, "of-one", "of-same"))
        self.assertIn(
            "  why: option 'path' is {0}/two, was {0}/one, and the contents differ\n".format(self.scratch),
            self.diff(1, "of-one", "of-two"),
        )
        self.write("one/ct", "333")
        self.run_into("later", FILES, "data=one")
        self.assertIn(
            "  why: the content of the folder %s/one (option 'path') differs\n" % self.scratch,
            self.diff(1, "of-one", "later"),
        )

    def test_a_failed_run(self):
        text = CHAIN.replace(
            "  drawn:", "  passed: {uses: test.fail_above, in: {a: sum}, with: {value: 7}}\n  drawn:"
        ).replace("a: sum, b: draw", "a: passed, b: draw")
        self.run_into("a", text)
        self.run_into("b", text, "--set", "passed.value=6", "--set", "draw.uses=test.constant", code=1)
        drawn = json.loads((self.scratch / "a" / "outputs" / "drawn.json").read_text())["metrics"][0]["value"] - 7
        self.expect(
            1,
            "First difference: node 'draw' (test.constant)\n"
            "  why: it uses test.constant, used test.draw\n"
            "  number  value                    1, was %.5g (%+.3g)\n"
            "Node 'passed' (test.fail_above) differs by itself, too\n"
            "  in the first run it was done\n"
            "  in the second run it failed: the number is too large; give a smaller one\n"
            "  why: option 'value' is 6, was 7\n"
            "In consequence not run: drawn\n"
            "The same in both runs: 3 nodes\n\n"
            "Outputs that only the first run has: drawn\n"
            "Outputs that are the same: sum\n" % (drawn, 1 - drawn),
        )
        self.run_into("c", text, "--set", "passed.value=6", "--set", "draw.uses=test.constant", code=1)
        self.assertIn(
            (
                "identical: all 6 nodes came out the same\nnode 'passed' failed in both: the number is too large; give"
                " a smaller one\n"
            ),
            self.diff(0, "b", "c"),
        )

    def test_a_list_that_failed_in_part(self):
        text = (
            "marrow: 1\nnodes:\n  l: {uses: test.letters}\n  f: {uses: test.fail_above, in: {a: l}, with: {value:"
            " 1000}}\n  n: {uses: test.add, in: {a: f}}\noutputs: {n: n}\n"
        )
        self.run_into("a", text)
        self.run_into("b", text, "--set", "f.value=250", code=1)
        self.expect(
            1,
            (
                "First difference: node 'f' (test.fail_above)\n"
                "  in the first run it was done\n"
                "  in the second run it failed: z: the number is too large; give a smaller one\n"
                "  why: option 'value' is 250, was 1000\n"
                "  number z  it is not there\n"
                "In consequence not run: n\n"
                "The same in both runs: 1 node\n\n"
                "Outputs that differ\n"
                "  n z  it is not there\n"
            ),
        )
        self.run_into("c", text, "--set", "f.value=50", code=1)
        told = self.diff(1, "b", "c")
        self.assertIn(
            (
                "  in the first run it failed: z: the number is too large; give a smaller one\n"
                "  in the second run it failed: x: the number is too large; give a smaller one\n"
            ),
            told,
        )
        self.assertIn("In consequence differ: n\n", told)

    def test_the_same_items_in_another_order(self):
        text = (
            "marrow: 1\nnodes:\n  s: {uses: test.sides, with: {names: [a]}}\n  t: {uses: test.constant, with: {value:"
            " 10}}\n  n: {uses: test.sum, in: {items: s.both}}\noutputs: {n: n}\n"
        )
        self.run_into("a", text.replace("items: s.both", "items: [t, s.left]"))
        self.run_into("b", text.replace("items: s.both", "items: [s.left, t]"))
        self.assertIn(
            (
                "identical: all 3 nodes came out the same\nAlso changed: node 'n': input 'items' is wired to [s.left,"
                " t], was wired to [t, s.left] (with the same result)\n"
            ),
            self.diff(0, "a", "b"),
        )

    def test_values_that_the_store_no_longer_has(self):
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}  # that no other test has filled
        self.use_version(1)
        text = (
            "marrow: 1\nnodes:\n  p: {uses: test.powers}\n  n: {uses: test.last_power, in: {powers: p}}\noutputs: {n:"
            " n}\n"
        )
        self.run_into("a", text, "--no-cache", "--seed", 3)
        self.use_version(2)
        self.run_into("b", text, "--no-cache")
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
        text = CHAIN.replace(
            "outputs: {", "  s: {uses: test.sides, with: {names: [one, two]}}\noutputs: {both: s.both, "
        )
        self.run_into("a", text)
        self.run_into("b", text)
        (self.scratch / "a" / "outputs" / "sum.json").unlink()
        drawn, item = (
            self.scratch / "b" / "outputs" / "drawn.json",
            self.scratch / "b" / "outputs" / "both" / "two.json",
        )
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
                + "\nAll else is by what the runs came to, not by these files\n\n"
                "What took part in both runs came out the same: 6 nodes\n"
            ),
            told,
        )
        self.assertNotIn("identical", told)
        told = json.loads(self.diff(1, "a", "b", "--json"))
        self.assertEqual((told["identical"], told["damaged_files"]), (False, damaged))
        self.assertIn("a/outputs/sum.json is missing\n", self.diff(1, "a", "a"))
        shutil.copy(self.scratch / "b" / "outputs" / "sum.json", self.scratch / "a" / "outputs")
        item.unlink()
        shutil.copy(self.scratch / "a" / "outputs" / "both" / "two.json", item)
        drawn.write_bytes(whole)
        self.assertIn("identical: all 6 nodes came out the same\n", self.diff(0, "a", "b"))

    def test_a_record_without_digests_is_compared_by_keys(self):
        self.run_into("a", CHAIN)
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        record = json.loads((self.scratch / "b" / "run.json").read_text())
        for output in record["outputs"]:
            self.assertEqual(len(output.pop("digests")), 1)
        self.write("b/run.json", json.dumps(record))
        (self.scratch / "b" / "outputs" / "sum.json").unlink()
        self.assertIn("identical", self.diff(0, "a", "b"))

    def test_for_scripts(self):
        self.run_into("a", CHAIN)
        self.run_into("b", CHAIN, "--set", "other.value=4.25")
        told = json.loads(self.diff(1, "a", "b", "--json"))
        self.assertFalse(told["identical"])
        self.assertEqual(told["first"]["node"], "other")
        self.assertEqual(
            [(change["what"], change["name"], change["before"], change["now"]) for change in told["first"]["why"]],
            [("option", "value", "4", "4.25")],
        )
        self.assertEqual(
            told["first"]["outputs"][0]["items"][0]["amount"]["value"],
            {"before": 4, "now": 4.25, "difference": 0.25, "unit": ""},
        )
        self.assertEqual(
            told["nodes"], {"same": 2, "in_consequence": ["sum", "drawn"], "only_before": [], "only_now": []}
        )
        self.assertEqual([output["name"] for output in told["outputs"] if not output["identical"]], ["sum", "drawn"])
        self.assertTrue(json.loads(self.diff(0, "a", "a", "--json"))["identical"])

    def test_folders_that_are_not_of_runs(self):
        self.run_into("a", CHAIN)
        advice = (
            "; give a folder that 'marrow run' wrote, or one of the cells of a comparison"
            " (FOLDER/cells/VARIANT/CASE/START)\n"
        )
        for name in ("empty", "killed", "damaged", "old", "bare"):
            (self.scratch / name).mkdir()
        for name in ("killed", "damaged", "old"):
            shutil.copy(self.scratch / "a" / "pipeline.yaml", self.scratch / name)
        self.write("damaged/run.json", "{")
        shutil.copy(self.scratch / "a" / "run.json", self.scratch / "bare")
        record = json.loads((self.scratch / "a" / "run.json").read_text())
        for node in record["nodes"]:
            del node["items"]
        self.write("old/run.json", json.dumps(record))
        shutil.copytree(self.scratch / "a", self.scratch / "linked")
        (self.scratch / "linked" / "pipeline.yaml").rename(self.scratch / "elsewhere.yaml")
        (self.scratch / "linked" / "pipeline.yaml").symlink_to(self.scratch / "elsewhere.yaml")
        for name, text in (
            ("nothing", "nothing is not a folder" + advice),
            ("empty", "empty is not the folder of a run: it has no run.json" + advice),
            ("bare", "bare is not the whole folder of a run: it has a run.json, but no pipeline.yaml" + advice),
            (
                "killed",
                "the run in killed did not come to its end: it has a pipeline.yaml, but no run.json; run it again\n",
            ),
            ("damaged", "damaged/run.json is not what 'marrow run' wrote: "),
            (
                "linked",
                (
                    "linked/pipeline.yaml is a link to a file outside of the folder, of which nothing is shown; copy it"
                    " there\n"
                ),
            ),
            (
                "old",
                (
                    "old/run.json was written by an older marrow, which kept too little to compare it; run its"
                    " pipeline.yaml again, with --seed 1\n"
                ),
            ),
        ):
            for command in (["diff", name, "a"], ["diff", "a", name], ["rerun", name]):
                result = self.marrow(*command)
                self.assertEqual((result.returncode, result.stdout), (2, ""))
                self.assertTrue(result.stderr.startswith("marrow: error: " + text), result.stderr)


POSE = """marrow-pose: 1
target: world
source: ct
matrix:
  - [%s, 5]
  - [%s, 6]
  - [0, 0, 1, 7]
  - [0, 0, 0, 1]
warnings: []
cost: %s
evaluations: 12
fragment_frame:
  origin_mm: [10, 0, 0]
  axes:
    - [1, 0, 0]
    - [0, 1, 0]
    - [0, 0, 1]
"""


class Amounts(Runs):
    """In the terms of the field: what is read from files whose difference is known."""

    def setUp(self):
        super().setUp()
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}
        self.pipeline = "marrow: 1\nnodes:\n" + "".join(
            "  %s: {uses: read.%s, with: {path: %s}}\n" % (kind, kind, name)
            for kind, name in (("volume", "ct.mha"), ("image", "view.png"), ("pose", "pose.yaml"))
        )
        self.pipeline += "outputs: {volume: volume, image: image, pose: pose}\n"

    def run_on(self, name, hu, grey, pose, *arguments):
        (self.scratch / "ct.mha").write_bytes(mha((4, 5, 6), [0.0] * 119 + [hu]))
        (self.scratch / "view.png").write_bytes(png(8, 9, lambda u, v: grey if (u, v) == (3, 4) else 100))
        self.write("pose.yaml", pose)
        self.run_into(name, self.pipeline, *arguments)

    def both(self, *arguments):
        self.run_on("a", 0.0, 100, POSE % ("1, 0, 0", "0, 1, 0", 0.5), *arguments)
        self.run_on("b", -7.5, 400, POSE % ("0, -1, 0", "1, 0, 0", 0.25), *arguments)
        return self.diff(1, "a", "b")

    def test_by_values(self):
        told = self.both()
        self.assertIn(
            "First difference: node 'volume' (read.volume)\n  why: the content of the file %s/ct.mha (option 'path')"
            " differs\n  volume  1 of 120 voxels differ (0.833 %%), by at most 7.5 HU\nNode 'image' (read.image)"
            " differs by itself, too\n  why: the content of the file %s/view.png (option 'path') differs\nNode 'pose'"
            " (read.pose) differs by itself, too\n" % (self.scratch, self.scratch),
            told,
        )
        self.assertIn(
            (
                "\nOutputs that differ\n  volume  as above\n  image   1 of 72 pixels differ (1.39 %), by at most 300"
                " grey values\n  pose\n      90 deg and 14.14 mm apart at the fragment's centroid (+90 deg about and +0"
                " mm along its long axis)\n      cost 0.25, was 0.5; 12 evaluations, were 12\n"
            ),
            told,
        )

    def test_by_files(self):
        told = self.both("--no-cache")
        self.assertRegex(
            told,
            (
                r"\n  volume  (\d+ of \d+ bytes of the file differ|the file of \d+ bytes, were \d+) \(by the files in"
                r" outputs/\)\n"
            ),
        )
        self.assertRegex(
            told,
            (
                r"\n  image   (\d+ of \d+ bytes of the file differ|the file of \d+ bytes, were \d+) \(by the files in"
                r" outputs/\)\n"
            ),
        )
        self.assertIn(
            (
                "\n  pose\n      90 deg and 14.14 mm apart at the fragment's centroid (+90 deg about and +0 mm along"
                " its long axis)\n      cost 0.25, was 0.5; 12 evaluations, were 12 (by the files in outputs/)\n"
            ),
            told,
        )


class Femur(Runs):
    def test_poses_in_degrees_and_mm(self):
        case = simulate(self.scratch / "simulated", *SMALL)
        text = FEMUR.read_text()
        for slow in ("scene", "landscape", "profiles", "view3d", "result"):
            text = text.replace("\n  %s: %s\n" % (slow, slow), "\n")
        pipeline = self.write("femur.yaml", text)
        for name, options in (("a", []), ("b", ["--set", "model.smoothing=3", "--set", "edges.high=80"])):
            result = self.marrow("run", pipeline, "case=%s" % case, "--out", name, "--quiet", *options)
            self.assertEqual(result.returncode, 0, result.stderr)
        told = self.diff(1, "a", "b")
        number = r"[-+]?[0-9.e-]+"
        self.assertRegex(
            told,
            r"First difference: node 'model' \(mesh.marching_cubes\)\n  why: option 'smoothing' is 3, was 0\n"
            r"  mesh distal  \d+ of \d+ vertices lie elsewhere, by at most %s mm\n" % number,
        )
        self.assertIn(
            "Node 'edges' (edges.adaptive_relaxation) differs by itself, too\n  why: option 'high' is 80, was 75\n",
            told,
        )
        self.assertIn("In consequence differ: shaft, start, pose, errors, distance, overlay, ", told)
        self.assertRegex(
            told,
            r"\n  pose distal\n      %s deg and %s mm apart at the fragment's centroid \(%s deg about and %s mm along"
            r" its long axis\)\n"
            r"      cost %s, was %s; \d+ evaluations, were \d+\n" % ((number,) * 6),
        )
        self.assertRegex(
            told, r"\n  errors distal/final\n      rotation_deg             %s deg, was %s \(%s\)\n" % ((number,) * 3)
        )
        self.assertIn("\n  model distal            as above\n", told)
        self.assertRegex(told, r"\n  edges frontal           \d+ edge pixels, were \d+: \d+ gone, 0 new\n")
        self.assertRegex(
            told,
            r"\n  overlay distal/frontal  \d+ of \d+ pixels differ \(%s %%\), by at most \d+ grey values\n" % number,
        )
        # The poses' distance by their files, worked out here.
        amount = next(
            output for output in json.loads(self.diff(1, "a", "b", "--json"))["outputs"] if output["name"] == "pose"
        )["items"][0]["amount"]
        poses = [self.pose(name) for name in "ab"]
        moved = [sum(r * c for r, c in zip(row, poses[0][1] + [1])) for pose in poses for row in pose[0][:3]]
        self.assertAlmostEqual(
            amount["displacement_mm"], sum((moved[i] - moved[i + 3]) ** 2 for i in range(3)) ** 0.5, 9
        )
        turned = rotation_vector_deg(
            matrix_product(
                *(
                    [row[:3] for row in pose[0][:3]] if i else transposed([row[:3] for row in pose[0][:3]])
                    for i, pose in enumerate(poses)
                )
            )
        )
        self.assertAlmostEqual(amount["rotation_deg"], sum(x * x for x in turned) ** 0.5, 9)

    def pose(self, run):
        import yaml

        pose = yaml.safe_load((self.scratch / run / "outputs" / "pose" / "distal.yaml").read_text())
        return pose["matrix"], pose["fragment_frame"]["origin_mm"]


if __name__ == "__main__":
    main()
