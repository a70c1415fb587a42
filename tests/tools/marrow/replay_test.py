# SPDX-License-Identifier: Apache-2.0
"""A failed call leaves a folder, and is made again from it, alone."""
import json
import os
import re
import shutil
import unittest

from diff_cases import Runs
from harness import BUILD, MARROW
from harness.program import IS_SANITIZED, main

LETTERS = """marrow: 1
nodes:
  l: {uses: test.letters}
  f: {uses: test.fail_above, in: {a: l}, with: {value: 150}}
outputs: {f: f}
"""
FUNCTIONS = """marrow: 1
nodes:
  five: {uses: test.constant, with: {value: 5}}
  l: {uses: test.letters}
  adder: {uses: test.adder, in: {amount: five}}
  f: {uses: test.fail_applied, in: {adder: adder, to: l}, with: {value: 250}}
outputs: {f: f}
"""
BODY = """marrow: 1
nodes:
  before: {uses: test.constant, with: {value: 0}}
  item: {uses: test.constant}
  two: {uses: test.constant, with: {value: 2}}
  adder: {uses: test.adder, in: {amount: two}}
  sum: {uses: test.add, in: {a: before, b: item}}
  good: {uses: test.fail_applied, in: {adder: adder, to: sum}, with: {value: %s}}
outputs: {sum: sum, good: good}
"""
OVER = """marrow: 1
nodes:
  l: {uses: test.letters}
  r: {repeat: body.yaml, over: letter, in: {item: l}, carry: {before: sum}}
outputs: {all: r.good}
"""
FAILS = "marrow: 1\nnodes:\n  %s\n  f: {uses: test.fail_above, in: {a: %s}, with: {value: 0}}\noutputs: {f: f}\n"
TOO_LARGE = "the number is too large; give a smaller one"


SAME_ERROR = "failed again, with the same error: "
SAME_INPUTS = "  its inputs are the same as in the run\n"


class Replay(Runs):
    has_own_store = True

    def replay(self, code, *arguments, **more):
        return self.expect(code, "replay", *arguments, **more)

    def replays(self, error, folder="a", *arguments):
        """The call fails again with the same inputs and this error. Gives what is said of it."""
        told = self.replay(1, folder, *arguments)
        self.assertIn(SAME_INPUTS + SAME_ERROR + error, told.stdout)
        return told

    def call(self, folder):
        return self.json(folder + "/call.json")

    def folders(self, run="a"):
        failed = self.scratch / run / "failed"
        return sorted(str(file.parent.relative_to(failed)) for file in failed.rglob("call.json"))

    def test_the_folder_of_an_item(self):
        said = self.expect(1, "run", self.write("p.yaml", LETTERS), "--out", "a b", "--seed", 5, "--json").stdout
        self.assertEqual(json.loads(said.splitlines()[-1])["failed_calls"], ["failed/f/y", "failed/f/z"])
        shutil.rmtree(self.scratch / "a b")
        said = self.expect(1, "run", "p.yaml", "--out", "a b", "--seed", 5).stdout
        self.assertIn(
            "what failed can be called again alone:\n  marrow replay 'a b/failed/f/y'\n"
            "  marrow replay 'a b/failed/f/z'\n",
            said,
        )
        self.assertEqual(self.folders("a b"), ["f/y", "f/z"])
        call = self.call("a b/failed/f/y")
        self.assertEqual(
            [call[name] for name in ("node", "item", "uses", "reason", "seed", "run")],
            ["f", "y", "test.fail_above", TOO_LARGE, 5, "../../.."],
        )
        self.assertEqual(call["options"]["value"], 150)
        (given,) = call["inputs"]["a"]
        self.assertEqual(given["file"], "inputs/a.json")
        self.assertEqual(self.metric("a b/failed/f/y/inputs/a.json"), 200)

    def test_an_item_is_called_alone(self):
        self.run_into("a", LETTERS, code=1)
        told = self.replay(1, "a/failed/f/y")
        self.assertEqual(
            told.stdout,
            "node 'f' (test.fail_above) for y\n%s%s%s\nunder a debugger:  marrow replay a/failed/f/y --debugger gdb\n"
            % (SAME_INPUTS, SAME_ERROR, TOO_LARGE),
        )
        self.assertEqual(told.stderr, "", "what it needs is read back, and no other item is called")
        self.assertEqual(self.replay(1, ".", cwd=self.scratch / "a/failed/f/y").stdout.count("same error"), 1)
        # Without the store, what it needs is made again.
        self.assertRegex(self.replay(1, "a/failed/f/y", "--no-cache").stderr, r"^l: made again, \d+\.\d{3} s\n$")
        shutil.rmtree(self.scratch / "cache")
        self.assertRegex(self.replays(TOO_LARGE, "a/failed/f/y").stderr, r"^l: made again, ")

    def test_which_of_several(self):
        self.run_into("a", LETTERS, code=1)
        self.refused("2 calls failed in a; give one of them:\n    a/failed/f/y\n    a/failed/f/z\n", "replay", "a")
        self.run_into("b", LETTERS.replace("150", "250"), code=1)
        self.assertIn("node 'f' (test.fail_above) for z\n", self.replay(1, "b").stdout)
        self.run_into("c", LETTERS.replace("150", "350"))
        self.assertFalse((self.scratch / "c/failed").exists())
        self.refused("no call of a node failed in the run in c\n", "replay", "c")

    def test_a_wrong_folder(self):
        (self.scratch / "empty").mkdir()
        self.run_into("a", LETTERS.replace("150", "250"), code=1)
        self.write("a/failed/f/z/call.json", '{"run": 3}')
        self.refusals(
            ("nothing is not a folder", "replay", "nothing"),
            (
                "empty is not the folder of a failed call: it has no call.json; give one of those below failed/ in the"
                " folder of a run",
                *("replay", "empty"),
            ),
            ("call.json is not what 'marrow run' wrote; run the pipeline again", "replay", "a"),
        )

    def test_after_the_plugin_was_rebuilt(self):
        text = (
            "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 100}}\n  s: {uses: test.scale, in: {a: c}}\n"
            "  f: {uses: test.fail_above, in: {a: s}, with: {value: 150}}\noutputs: {f: f}\n"
        )
        self.use_version(1)  # scales by 2
        self.run_into("a", text, code=1)
        self.use_version(2)  # by 2.5
        self.replays("")
        told = self.replay(1, "a", "--no-cache").stdout
        self.assertIn("  input 'a' is not what it was in the run: what makes it gave something else this time\n", told)
        # What was read back is not kept as if the new version had made it.
        self.run_into("b", text.replace("value: 150", "value: 500"))
        self.assertEqual(self.metric("b/outputs/f.json"), 250)

    def test_a_file_that_changes(self):
        """It says what the node does: a call that works now, one that cannot be made, and a reader that dies in its own
        process, as in the run, and takes a replay with it in this one."""
        reads = (
            "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: parse.test_number, in: {added: c}, with: {path:"
            " word, value: 3}}\noutputs: {n: n}\n"
        )
        self.write("word", "refuse")
        self.run_into("a", reads, code=1)
        self.assertIn("word: is refused\n", self.replay(1, "a").stdout)
        self.write("word", "fine")
        told = self.replay(0, "a").stdout
        self.assertRegex(
            told, r"\ndone after \d+\.\d{3} s; in the run it failed: .*/word: is refused\n  number: metrics\n"
        )
        self.assertRegex(told, r"\n    letters +0\.0000 \n")
        self.run_into("b", FAILS % ("n: {uses: parse.test_number, with: {path: word, value: 900}}", "n"), code=1)
        self.write("word", "refuse")
        said = "marrow: error: it could not be called: node 'n' (parse.test_number) failed: "
        self.refused(said, "replay", "b", "--no-cache")
        self.write("word", "crash")
        self.run_into("c", reads, code=1)
        self.replays("", "c")
        if not IS_SANITIZED:
            self.replay(-11, "c", "--in-this-process")

    def test_the_seed(self):
        self.run_into("a", "marrow: 1\nnodes:\n  d: {uses: test.fail_drawn}\noutputs: {d: d}\n", "--seed", 7, code=1)
        drawn = self.call("a/failed/d")
        self.assertEqual(drawn["reason"], "it drew %d" % (drawn["call_seed"] % 1000003))
        self.assertIn(SAME_ERROR + drawn["reason"], self.replay(1, "a").stdout)
        self.write("a/failed/d/call.json", json.dumps({**drawn, "call_seed": 12}))
        another = "failed again, with another error: it drew 12\nin the run it was: %s\n" % drawn["reason"]
        self.assertIn(another, self.replay(1, "a").stdout)

    def test_functions_are_made_again(self):
        self.run_into("a", FUNCTIONS, code=1)
        self.assertEqual(self.folders(), ["f/z"])
        call = self.call("a/failed/f/z")
        self.assertEqual(call["inputs"]["adder"][0]["file"], "", "no file can hold a function")
        self.assertIn("adder: made again", self.replays("the function gave 305\n").stderr)

    def test_what_can_be_called_again(self):
        """Each pipeline, its exit code, the folders of its failed calls, and the error of the first."""
        self.write("body.yaml", BODY % 250)
        shared = BODY.replace("test.adder", "test.failing_adder") % 999
        self.write("shared.yaml", shared)
        two = "one: {uses: test.constant}\n  two: {uses: test.fail_above, in: {a: one}, with: {value: 0}}"
        self.write("two.yaml", shared.replace("two: {uses: test.constant, with: {value: 2}}", two))
        self.write("outer.yaml", OVER)
        constant = OVER.replace("nodes:", "nodes:\n  start: {uses: test.constant}")
        start = constant.replace("item: l", "item: l, before: start").replace("all: r.good", "last: r.last_good")
        self.write("started.yaml", start)
        may_fail = LETTERS.replace("with: {value: 150}", "with: {value: 250}, may_fail: true")
        passes = (
            "marrow: 1\nnodes:\n  l: {uses: test.letters}\n  o: {repeat: started.yaml, over: letter, in: {start: l}, "
            "if_pass_fails: go_on}\noutputs: {last: o.last}\n"
        )
        body_of_a_body = "marrow: 1\nnodes:\n  o: {repeat: outer.yaml, at_most: 1}\noutputs: {all: o.all}\n"
        gave = "the function gave %d\n"
        for name, text, code, calls in (
            ("a function", FUNCTIONS.replace("test.adder", "test.failing_adder"), 1, {"adder": "it cannot add\n"}),
            ("may fail", may_fail, 0, {"f/z": TOO_LARGE}),
            # Pass y gets the sum of pass x: 100 + 200 and 2 by the function.
            ("body", OVER, 1, {"r/good/y": gave % 302}),
            # A pass that failed hands on nothing: z has the sum of x, too.
            (
                *("goes on", OVER.replace("carry:", "if_pass_fails: go_on, carry:"), 0),
                {"r/good/y": gave % 302, "r/good/z": gave % 402},
            ),
            ("all passes", OVER.replace("body.yaml", "shared.yaml"), 1, {"r/adder": "it cannot add\n"}),
            ("all passes, too", OVER.replace("body.yaml", "two.yaml"), 1, {"r/two": TOO_LARGE + "\n"}),
            ("body of a body", body_of_a_body, 1, {"o/r/good/y": gave % 302}),
            # Pass x of the outer body starts with 100: the inner passes get 200, and then 400.
            (
                "pass of a pass",
                passes,
                0,
                {"o/r/good/x/y": gave % 402, "o/r/good/y/x": gave % 302, "o/r/good/z/x": gave % 402},
            ),
        ):
            with self.subTest(name):
                self.run_into(name, text, code=code)
                self.assertEqual(self.folders(name), sorted(calls))
                for folder, error in calls.items():
                    self.replays(error, name + "/failed/" + folder)
        # What the calls need is made again.
        self.replays(gave % 302, "body", "--no-cache")
        for place, number in (("x/y", 402), ("y/x", 302), ("z/x", 402)):
            self.replays(gave % number, "pass of a pass/failed/o/r/good/" + place, "--no-cache")
        told = self.replay(1, "body")
        self.assertIn("node 'r/good' (test.fail_applied) for y\n", told.stdout)
        self.assertEqual(re.findall(r"r/(?:good|sum).*", told.stderr), [], "no other pass is run again")
        call = self.call("body/failed/r/good/y")
        self.assertEqual([call[name] for name in ("within", "node", "item")], ["r/y", "good", ""])
        self.assertIn("node 'adder' (test.failing_adder)\n", self.replay(1, "a function").stdout)
        self.assertIn("node 'o/r/good' (test.fail_applied) for ", self.replay(1, "body of a body").stdout)

    def test_names_that_no_folder_can_have_and_no_more_folders_than_tell_something(self):
        sides = "s: {uses: test.sides, with: {names: [%s]}}"
        self.run_into("a", FAILS % (sides % "'../x', 'a/b', '..'", "s.both"), code=1)
        self.assertEqual(len(self.folders()), 3)
        for folder in self.folders():
            self.assertIn("for " + self.call("a/failed/" + folder)["item"], self.replay(1, "a/failed/" + folder).stdout)
        self.run_into("b", FAILS % (sides % ", ".join("n%d" % i for i in range(12)), "s.both"), code=1)
        self.assertEqual(len(self.folders("b")), 10)

    def test_inputs_that_do_not_go_in_step(self):
        text = (
            "marrow: 1\nnodes:\n  s: {uses: test.sides}\n  t: {uses: test.sides, with: {names: [c]}}\n"
            "  f: {uses: test.add, in: {a: s.both, b: t.both}}\noutputs: {f: f}\n"
        )
        self.run_into("a", text, code=1)
        self.assertIsNone(self.call("a/failed/f")["inputs"])
        self.assertIn(SAME_ERROR + "inputs 'a' and 'b' do not go in step", self.replay(1, "a").stdout)

    def test_a_cell_of_a_comparison(self):
        (self.scratch / "cases" / "one").mkdir(parents=True)
        text = LETTERS.replace("{uses: test.letters}", "{uses: test.constant, with: {value: 300, path: $case}}")
        self.write("p.yaml", text.replace("nodes:", "inputs: {case: {type: path}}\nnodes:"))
        self.write(
            "e.yaml",
            "experiment: 1\npipeline: p.yaml\nvariants: {b: {f.value: 500}, a: {}}\ncases: {folders: [cases/*]}\n"
            "metrics: [f.value]\ntimed_cells: 0\n",
        )
        self.marrow("compare", "e.yaml", "--out", "compared")
        (cell,) = (file.parent for file in (self.scratch / "compared").rglob("call.json"))
        self.assertIn(SAME_ERROR + TOO_LARGE, self.replay(1, cell).stdout)

    def test_debuggers(self):
        self.run_into("a", LETTERS.replace("150", "250"), code=1)
        said = (
            "the debugger 'no-such-debugger' cannot be started: No such file or directory; install it, or name another "
            "with --debugger"
        )
        self.refused(said, "replay", "a", "--debugger", "no-such-debugger")
        for name in ("gdb", "lldb", "other"):
            self.write(name, '#!/bin/sh\nprintf "[%s]" "$@"\n').chmod(0o755)
        self.environment["PATH"] = "%s:%s" % (self.scratch, os.environ["PATH"])
        replay = r"\[%s\]\[replay\]\[a/failed/f/z\]\[--in-this-process\]" % re.escape(str(MARROW.resolve()))
        for name, called in (
            ("gdb", r"^\[-q\].*\[run\]\[--args\]" + replay + r"\[--stop\]$"),
            ("lldb", r"^\[-o\]\[run\]\[--\]" + replay + r"\[--stop\]$"),
            ("other", "^" + replay + "$"),
        ):
            self.assertRegex(self.marrow("replay", "a", "--debugger", name).stdout, called)

    @unittest.skipUnless(shutil.which("gdb"), "gdb is not here")
    def test_gdb_stops_right_before_the_call(self):
        self.run_into("a", LETTERS.replace("150", "250"), code=1)
        with open(self.write("commands", "backtrace\ncontinue\nquit\n")) as stream:
            told = "".join(self.start("replay", "a", "--debugger", "gdb", stdin=stream).communicate(timeout=300))
        if "ptrace" in told or "Could not trace" in told:
            self.skipTest("this machine allows no debugger")
        self.assertIn("SIGTRAP", told)
        self.assertRegex(told, r"#\d+ .*marrow::Evaluation::call_node")
        self.assertIn(SAME_ERROR + TOO_LARGE, told)


if __name__ == "__main__":
    main()
