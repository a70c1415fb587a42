# SPDX-License-Identifier: Apache-2.0
"""Where two runs part, and why."""
import json
import shutil

from diff_cases import CHAIN, Runs
from harness.program import main

FILES = """marrow: 1
inputs: {data: {type: path}}
nodes:
  read: {uses: test.file_size, with: {path: $data}}
  sum: {uses: test.add, in: {a: read}}
outputs: {sum: sum}
"""
UNDRAWN = CHAIN.replace("  draw: {uses: test.draw}\n", "").replace("b: draw", "b: other")
SCALED = CHAIN.replace("drawn: {uses: test.add, in: {a: sum, b: draw}}", "drawn: {uses: test.scale, in: {a: sum}}")
PASSING = CHAIN.replace(
    "  drawn:", "  passed: {uses: test.fail_above, in: {a: sum}, with: {value: 7}}\n  drawn:"
).replace("a: sum, b: draw", "a: passed, b: draw")
SCALER = """marrow: 1
nodes:
  c: {uses: test.constant}
  f: {uses: test.scaler}
  n: {uses: test.apply_scaler, in: {scaler: f, to: c}}
outputs: {n: n}
"""
ADDER = """marrow: 1
nodes:
  c: {uses: test.constant}
  f: {uses: test.adder, in: {amount: c}}
  n: {uses: test.apply, in: {adder: f, to: c}}
outputs: {n: n}
"""
POWERS = "marrow: 1\nnodes:\n  p: {uses: test.powers}\n  n: {uses: test.last_power, in: {powers: p}}\noutputs: {n: n}\n"
SIDES = """marrow: 1
nodes:
  s: {uses: test.sides, with: {names: [a, b]}}
  n: {uses: test.add, in: {a: s.both}}
outputs: {n: n}
"""
LETTERS = """marrow: 1
nodes:
  l: {uses: test.letters}
  f: {uses: test.fail_above, in: {a: l}, with: {value: 1000}}
  n: {uses: test.add, in: {a: f}}
outputs: {n: n}
"""
SUM = """marrow: 1
nodes:
  s: {uses: test.sides, with: {names: [a]}}
  t: {uses: test.constant, with: {value: 10}}
  n: {uses: test.sum, in: {items: [%s]}}
outputs: {n: n}
"""


class Diff(Runs):
    def drawn(self, name):
        return self.metric(name + "/outputs/drawn.json")

    def test_identical_runs(self):
        self.expect_diff_of(0, "identical: all 5 nodes came out the same\n", CHAIN, CHAIN)  # b is read back

    def test_an_option(self):
        self.run_both(CHAIN, CHAIN, "--set", "other.value=4.25")
        a, b = map(self.drawn, "ab")
        self.expect_diff(
            1,
            "First difference: node 'other' (test.constant)\n"
            "  why: option 'value' is 4.25, was 4 (--set other.value=4.25, was p.yaml:5)\n"
            "  number  value                    4.25, was 4 (+0.25)\n"
            "In consequence differ: sum, drawn\n"
            "The same in both runs: 2 nodes\n\n"
            "Outputs that differ\n"
            "  sum    value                    7.25, was 7 (+0.25)\n"
            "  drawn  value                    %.5g, was %.5g (%+.3g)\n" % (b, a, b - a),
        )
        told = json.loads(self.diff(1, "a", "b", "--json"))
        self.assertFalse(told["identical"])
        self.assertEqual(told["first"]["node"], "other")
        (why,) = told["first"]["why"]
        self.assertEqual([why[key] for key in ("what", "name", "before", "now")], ["option", "value", "4", "4.25"])
        amount = told["first"]["outputs"][0]["items"][0]["amount"]["value"]
        self.assertEqual(amount, {"before": 4, "now": 4.25, "difference": 0.25, "unit": ""})
        nodes = {"same": 2, "in_consequence": ["sum", "drawn"], "only_before": [], "only_now": []}
        self.assertEqual(told["nodes"], nodes)
        self.assertEqual([output["name"] for output in told["outputs"] if not output["identical"]], ["sum", "drawn"])
        self.assertTrue(json.loads(self.diff(0, "a", "a", "--json"))["identical"])

    def test_only_the_reason_of_the_first_node_is_its_reason(self):
        changes = ["--set", "first.value=5", "--set", "first.word=two", "--set", "other.word=three", "--seed", 2]
        told = self.diff_of(1, CHAIN, CHAIN, *changes)
        for text in (
            "First difference: node 'draw' (test.draw)\n"
            "  why: it draws random numbers, and the seed is 2, was 1\n"
            "  number  value",
            "Node 'first' (test.constant) differs by itself, too\n"
            "  why: option 'value' is 5, was 3 (--set first.value=5, was p.yaml:4)\n"
            "  why: option 'word' is two, was one (--set first.word=two, was p.yaml:4)\n",
            "In consequence differ: sum, drawn\nThe same in both runs: 1 node\n",
            "Also changed: node 'other': option 'word' is three, was one (--set other.word=three, was the default) "
            "(with the same result)\n",
        ):
            self.assertIn(text, told)

    def test_a_seed_that_nothing_draws_from(self):
        said = "identical: all 4 nodes came out the same\nAlso changed: the seed is 2, was 1\n"
        self.expect_diff_of(0, said, UNDRAWN, UNDRAWN, "--seed", 2)

    def rebuilt(self, text, first=1, extra=b""):
        """The build ids of the plugin in runs of this text, now and before."""
        self.use_version(first)
        self.run_into("a", text)
        self.use_version(2, extra)
        self.run_into("b", text)
        return self.build_ids()[::-1]

    def test_a_plugin_that_was_rebuilt(self):
        ids = self.rebuilt(SCALED)
        self.expect_diff(
            1,
            "First difference: node 'drawn' (test.scale)\n"
            "  why: its plugin marrow_versions.so is another build (build id %s, was %s)\n"
            "  scaled  value                    17.5 mm, was 14 (+3.5)\n"
            "The same in both runs: 3 nodes\n"
            "Of another build: marrow_versions.so (build id %s, was %s)\n\n"
            "Outputs that differ\n"
            "  drawn  as above\n"
            "Outputs that are the same: sum\n" % (*ids, *ids),
        )

    def test_a_rebuilt_plugin_with_the_same_results(self):
        said = "identical: all 2 nodes came out the same\nOf another build: marrow_versions.so (build id %s, was %s)\n"
        self.expect_diff(0, said % tuple(self.rebuilt(SCALER, 2, extra=b"newer")))

    def test_a_rebuilt_framework(self):
        self.run_into("a", CHAIN)
        shutil.copytree(self.scratch / "a", self.scratch / "b")
        record = self.json("b/run.json")
        record["framework"] = record["plugins"][0]["build_id"] = "0" * 32
        self.write("b/run.json", json.dumps(record))
        self.expect_diff(
            0,
            "identical: all 5 nodes came out the same\n"
            "Of another build: marrow's own library, and with it the build ids of marrow_test_numbers.so\n",
        )

    def test_a_plugins_own_type(self):
        self.rebuilt(POWERS)
        told = self.diff(1, "a", "b")
        self.assertIn(
            "First difference: node 'p' (test.powers)\n  why: its plugin marrow_versions.so is another build", told
        )
        self.assertIn("\n  powers  2 of 32 bytes of the powers differ\n", told)

    def test_a_function_that_a_node_calls(self):
        more = "nodes:\n  d: {uses: test.constant, with: {value: 2}}"
        self.expect_diff_of(
            1,
            "First difference: node 'n' (test.apply)\n"
            "  why: the function of node 'f', which it calls: input 'amount' is wired to d (there was no node 'd'), was"
            " wired to c\n"
            "  number  value                    3, was 2 (+1)\n"
            "The same in both runs: 1 node\n"
            "Only in the second run: d\n\n"
            "Outputs that differ\n"
            "  n  as above\n",
            *(ADDER, ADDER.replace("amount: c", "amount: d").replace("nodes:", more)),
        )

    def test_another_node_and_other_wires(self):
        add, fail_above = "{uses: test.add, in: {a: first, b: other}}", "test.fail_above, in: {a: other}"
        told = self.diff_of(1, CHAIN, CHAIN.replace(add, "{uses: %s, with: {value: 9}}" % fail_above))
        self.assertIn(
            "First difference: node 'sum' (test.fail_above)\n"
            "  why: it uses test.fail_above, used test.add\n"
            "  why: input 'a' is wired to other, was wired to first (node 'first' is not needed)\n"
            "  why: input 'b' is not wired, was wired to other\n"
            "  number  value                    4, was 7 (-3)\n",
            told,
        )
        self.assertIn("Not needed in the second run: first\n", told)

    def test_only_a_node_more(self):
        self.expect_diff_of(
            1,
            "What took part in both runs came out the same: 5 nodes\n"
            "Only in the second run: more\n\n"
            "Outputs that only the second run has: more\n"
            "Outputs that are the same: sum, drawn\n",
            *(CHAIN, CHAIN.replace("outputs: {", "  more: {uses: test.constant}\noutputs: {more: more, ")),
        )

    def test_items_of_lists(self):
        self.expect_diff_of(
            1,
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
            "  n c  it was not there\n",
            *(SIDES, SIDES.replace("[a, b]", "[b, a, c]")),
        )

    def run_on(self, name, path, content):
        self.write(path, content)
        self.run_into(name, FILES, "data=" + path.split("/")[0])

    def test_a_file_that_changed_under_its_path(self):
        self.use_version(1)
        self.run_on("a", "ct", "1")
        self.run_on("b", "ct", "22")
        self.expect_diff(
            1,
            "First difference: node 'read' (test.file_size)\n"
            "  why: the content of the file %s (option 'path') differs\n"
            "  bytes  bytes                    2, was 1 (+1)\n"
            "In consequence differ: sum\n"
            "The same in both runs: 0 nodes\n\n"
            "Outputs that differ\n"
            "  sum  value                    2, was 1 (+1)\n" % (self.scratch / "ct"),
        )

    def test_folders_count_by_their_content(self):
        self.use_version(1)
        for name, content in (("one", "1"), ("same", "1"), ("two", "22")):
            self.run_on("of-" + name, name + "/ct", content)
        self.assertIn("\nidentical: all 2 nodes came out the same\n", self.diff(0, "of-one", "of-same"))
        said = "  why: option 'path' is {0}/two, was {0}/one, and the contents differ\n".format(self.scratch)
        self.assertIn(said, self.diff(1, "of-one", "of-two"))
        self.run_on("later", "one/ct", "333")
        said = "  why: the content of the folder %s/one (option 'path') differs\n" % self.scratch
        self.assertIn(said, self.diff(1, "of-one", "later"))

    def test_a_failed_run(self):
        changes = ["--set", "passed.value=6", "--set", "draw.uses=test.constant"]
        self.run_both(PASSING, PASSING, *changes, status=1)
        drawn = self.drawn("a") - 7
        self.expect_diff(
            1,
            "First difference: node 'draw' (test.constant)\n"
            "  why: it uses test.constant, used test.draw (--set draw.uses=test.constant, was p.yaml:3)\n"
            "  number  value                    1, was %.5g (%+.3g)\n"
            "Node 'passed' (test.fail_above) differs by itself, too\n"
            "  in the first run it was done\n"
            "  in the second run it failed: the number is too large; give a smaller one\n"
            "  why: option 'value' is 6, was 7 (--set passed.value=6, was p.yaml:7)\n"
            "In consequence not run: drawn\n"
            "The same in both runs: 3 nodes\n\n"
            "Outputs that only the first run has: drawn\n"
            "Outputs that are the same: sum\n" % (drawn, 1 - drawn),
        )
        self.run_into("c", PASSING, *changes, code=1)
        self.assertIn(
            "identical: all 6 nodes came out the same\n"
            "node 'passed' failed in both: the number is too large; give a smaller one\n",
            self.diff(0, "b", "c"),
        )

    def test_a_list_that_failed_in_part(self):
        said = "it failed: %s: the number is too large; give a smaller one\n"
        self.run_both(LETTERS, LETTERS, "--set", "f.value=250", status=1)
        self.expect_diff(
            1,
            "First difference: node 'f' (test.fail_above)\n"
            "  in the first run it was done\n"
            "  in the second run "
            + said % "z"
            + "  why: option 'value' is 250, was 1000 (--set f.value=250, was p.yaml:4)\n"
            "  number z  it is not there\n"
            "In consequence not run: n\n"
            "The same in both runs: 1 node\n\n"
            "Outputs that differ\n"
            "  n z  it is not there\n",
        )
        self.run_into("c", LETTERS, "--set", "f.value=50", code=1)
        told = self.diff(1, "b", "c")
        self.assertIn("  in the first run " + said % "z" + "  in the second run " + said % "x", told)
        self.assertIn("In consequence differ: n\n", told)

    def test_the_same_items_in_another_order(self):
        self.assertIn(
            "identical: all 3 nodes came out the same\n"
            "Also changed: node 'n': input 'items' is wired to [s.left, t], was wired to [t, s.left] (with the same"
            " result)\n",
            self.diff_of(0, SUM % "t, s.left", SUM % "s.left, t"),
        )


# Two runs that differ only in names, and nodes that one of the runs did not need.
READ = """marrow: 1
inputs: {data: {type: path}}
nodes:
  read: {uses: test.constant, with: {path: $data}}
  sum: {uses: test.add, in: {a: read}}
outputs: {sum: sum}
"""
CHOICE = """marrow: 1
nodes:
  one: {uses: test.constant, with: {value: 3}}
  other: {uses: test.constant, with: {value: 4}}
  sum: {uses: test.add, in: {a: one}}
outputs: {sum: sum}
"""
SAME = "identical: all 2 nodes came out the same\n"


class Names(Runs):
    def run_on(self, run, name, content):
        self.write(name, content)
        self.run_into(run, READ, "data=" + name.split("/")[0])

    def also_changed(self, was, now, how):
        paths = self.scratch / now, self.scratch / was
        changed = "Also changed: node 'read': option 'path' is %s, was %s, %s (with the same result)\n"
        return SAME + changed % (*paths, how)

    def test_a_file_under_another_name(self):
        self.run_on("a", "f.txt", "content")
        self.run_on("b", "g.txt", "content")
        self.expect_diff(0, self.also_changed("f.txt", "g.txt", "another name for the same content"))
        self.write("g.txt", "changed since")  # what the second run read is no longer known
        self.expect_diff(0, self.also_changed("f.txt", "g.txt", "and the contents differ, or the names"))
        (self.scratch / "g.txt").unlink()
        self.expect_diff(0, self.also_changed("f.txt", "g.txt", "and the contents differ, or the names"))
        self.run_on("c", "other.txt", "another")
        self.assertIn(", and the contents differ (with the same result)\n", self.diff(0, "a", "c"))

    def test_a_file_of_a_folder_under_another_name(self):
        for name in ("x/f.txt", "y/f.txt", "z/g.txt"):
            self.run_on("of-" + name[0], name, "content")
        self.assertTrue(self.diff(0, "of-x", "of-y").endswith("\n\n" + SAME), "a folder counts by what is in it")
        said = self.also_changed("x", "z", "another name for the same content")
        self.assertTrue(self.diff(0, "of-x", "of-z").endswith(said))

    def test_a_node_that_is_there_without_need(self):
        said = (
            "First difference: node 'sum' (test.add)\n"
            "  why: input 'a' is wired to other (node 'other' was not needed), was wired to one (node 'one' is not"
            " needed)\n"
            "  sum  value                    4, was 3 (+1)\n"
            "The same in both runs: 0 nodes\n"
            "Not needed in the second run: one\n"
            "Not needed in the first run: other\n\n"
            "Outputs that differ\n"
            "  sum  as above\n"
        )
        self.expect_diff_of(1, said, CHOICE, CHOICE, "--set", "sum.in.a=other")

    def test_a_node_under_another_name(self):
        said = (
            "What took part in both runs came out the same: 1 node\n"
            "Only in the first run: one\n"
            "Only in the second run: first\n"
            "Also changed: node 'sum': input 'a' is wired to first (there was no node 'first'), was wired to one"
            " (there is no node 'one') (with the same result)\n\n"
            "Outputs that are the same: sum\n"
        )
        self.expect_diff_of(1, said, CHOICE, CHOICE.replace("one", "first"))


if __name__ == "__main__":
    main()
