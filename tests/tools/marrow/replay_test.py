# SPDX-License-Identifier: Apache-2.0
"""A failed call leaves a folder, and is made again from it, alone."""
import json
import os
import re
import shutil
import subprocess
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
TOO_LARGE = "the number is too large; give a smaller one"


class Replay(Runs):
    def setUp(self):
        super().setUp()
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}

    def replay(self, code, *arguments, **more):
        result = self.marrow("replay", *arguments, **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def call(self, folder):
        return json.loads((self.scratch / folder / "call.json").read_text())

    def folders(self, run="a"):
        failed = self.scratch / run / "failed"
        return sorted(str(file.parent.relative_to(failed)) for file in failed.rglob("call.json"))

    def test_the_folder_of_an_item(self):
        told = self.marrow("run", self.write("p.yaml", LETTERS), "--out", "a b", "--seed", 5)
        self.assertEqual(told.returncode, 1)
        self.assertIn(
            "what failed can be called again alone:\n  marrow replay 'a b/failed/f/y'\n"
            "  marrow replay 'a b/failed/f/z'\n",
            told.stdout,
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
        value = json.loads((self.scratch / "a b/failed/f/y" / given["file"]).read_text())
        self.assertEqual(value["metrics"][0]["value"], 200)

    def test_an_item_is_called_alone(self):
        self.run_into("a", LETTERS, code=1)
        told = self.replay(1, "a/failed/f/y")
        self.assertEqual(
            told.stdout,
            "node 'f' (test.fail_above) for y\n  its inputs are the same as in the run\nfailed again, with the same"
            " error: %s\nunder a debugger:  marrow replay a/failed/f/y --debugger gdb\n" % TOO_LARGE,
        )
        self.assertEqual(told.stderr, "", "what it needs is read back, and no other item is called")
        self.assertEqual(self.replay(1, ".", cwd=self.scratch / "a/failed/f/y").stdout.count("same error"), 1)
        # Without the store, what it needs is made again.
        self.assertRegex(self.replay(1, "a/failed/f/y", "--no-cache").stderr, r"^l: made again, \d+\.\d{3} s\n$")
        shutil.rmtree(self.scratch / "cache")
        told = self.replay(1, "a/failed/f/y")
        self.assertRegex(told.stderr, r"^l: made again, ")
        self.assertIn("its inputs are the same", told.stdout)

    def test_which_of_several(self):
        self.run_into("a", LETTERS, code=1)
        told = self.replay(2, "a").stderr
        self.assertIn("2 calls failed in a; give one of them:\n    a/failed/f/y\n    a/failed/f/z\n", told)
        self.run_into("b", LETTERS.replace("150", "250"), code=1)
        self.assertIn("node 'f' (test.fail_above) for z\n", self.replay(1, "b").stdout)
        self.run_into("c", LETTERS.replace("150", "350"))
        self.assertFalse((self.scratch / "c/failed").exists())
        self.assertIn("no call of a node failed in the run in c\n", self.replay(2, "c").stderr)

    def test_a_wrong_folder(self):
        self.assertIn("nothing is not a folder", self.replay(2, "nothing").stderr)
        (self.scratch / "empty").mkdir()
        self.assertIn(
            "empty is not the folder of a failed call: it has no call.json; give one of those below failed/ in the"
            " folder of a run",
            self.replay(2, "empty").stderr,
        )
        self.run_into("a", LETTERS.replace("150", "250"), code=1)
        self.write("a/failed/f/z/call.json", '{"run": 3}')
        self.assertIn("call.json is not what 'marrow run' wrote; run the pipeline again", self.replay(2, "a").stderr)

    def test_after_the_plugin_was_rebuilt(self):
        text = (
            "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 100}}\n  s: {uses: test.scale, in: {a: c}}\n"
            "  f: {uses: test.fail_above, in: {a: s}, with: {value: 150}}\noutputs: {f: f}\n"
        )
        self.use_version(1)  # scales by 2
        self.run_into("a", text, code=1)
        self.use_version(2)  # by 2.5
        told = self.replay(1, "a").stdout
        self.assertIn("its inputs are the same as in the run\n", told)
        told = self.replay(1, "a", "--no-cache").stdout
        self.assertIn("  input 'a' is not what it was in the run: what makes it gave something else this time\n", told)
        # What was read back is not kept as if the new version had made it.
        self.run_into("b", text.replace("value: 150", "value: 500"))
        value = json.loads((self.scratch / "b/outputs/f.json").read_text())["metrics"][0]["value"]
        self.assertEqual(value, 250)

    def test_a_call_that_works_now(self):
        """The file says what the node does; it has changed since."""
        self.write("word", "refuse")
        self.write("p.yaml", "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: parse.test_number, in: {added:"
                   " c}, with: {path: word, value: 3}}\noutputs: {n: n}\n")  # fmt: skip
        result = self.marrow("run", "p.yaml", "--out", "a", "--quiet")
        self.assertEqual(result.returncode, 1)
        self.assertIn("word: is refused\n", self.replay(1, "a").stdout)
        self.write("word", "fine")
        told = self.replay(0, "a").stdout
        self.assertRegex(
            told, r"\ndone after \d+\.\d{3} s; in the run it failed: .*/word: is refused\n  number: metrics\n"
        )
        self.assertRegex(told, r"\n    letters +0\.0000 \n")

    def test_the_seed(self):
        self.run_into("a", "marrow: 1\nnodes:\n  d: {uses: test.fail_drawn}\noutputs: {d: d}\n", "--seed", 7, code=1)
        drawn = self.call("a/failed/d")
        self.assertEqual(drawn["reason"], "it drew %d" % (drawn["call_seed"] % 1000003))
        self.assertIn("failed again, with the same error: " + drawn["reason"], self.replay(1, "a").stdout)
        self.write("a/failed/d/call.json", json.dumps({**drawn, "call_seed": 12}))
        self.assertIn("failed again, with another error: it drew 12\nin the run it was: %s\n" % drawn["reason"],
                      self.replay(1, "a").stdout)  # fmt: skip

    def test_functions_are_made_again(self):
        self.run_into("a", FUNCTIONS, code=1)
        self.assertEqual(self.folders(), ["f/z"])
        call = self.call("a/failed/f/z")
        self.assertEqual(call["inputs"]["adder"][0]["file"], "", "no file can hold a function")
        told = self.replay(1, "a")
        self.assertIn("the same as in the run\nfailed again, with the same error: the function gave 305\n", told.stdout)
        self.assertIn("adder: made again", told.stderr)

    def test_a_function_that_cannot_be_made(self):
        text = FUNCTIONS.replace("test.adder", "test.failing_adder")
        self.run_into("a", text, code=1)
        self.assertEqual(self.folders(), ["adder"])
        told = self.replay(1, "a").stdout
        self.assertIn("node 'adder' (test.failing_adder)\n  its inputs are the same as in the run\n", told)
        self.assertIn("with the same error: it cannot add\n", told)

    def test_in_a_body(self):
        """Pass y gets the sum of pass x: 100 + 200 and 2 by the function."""
        self.write("body.yaml", BODY % 250)
        self.run_into("a", OVER, code=1)
        self.assertEqual(self.folders(), ["r/good/y"])
        call = self.call("a/failed/r/good/y")
        self.assertEqual([call[name] for name in ("within", "node", "item")], ["r/y", "good", ""])
        told = self.replay(1, "a")
        self.assertIn("node 'r/good' (test.fail_applied) for y\n  its inputs are the same", told.stdout)
        self.assertIn("with the same error: the function gave 302\n", told.stdout)
        self.assertEqual(re.findall(r"r/(?:good|sum).*", told.stderr), [], "no other pass is run again")
        told = self.replay(1, "a", "--no-cache")
        self.assertIn("with the same error: the function gave 302\n", told.stdout)

    def test_in_a_body_that_goes_on(self):
        self.write("body.yaml", BODY % 250)
        self.run_into("a", OVER.replace("carry:", "if_pass_fails: go_on, carry:"))
        self.assertEqual(self.folders(), ["r/good/y", "r/good/z"])
        # A pass that failed hands on nothing: z has the sum of x, too.
        for name, gave in (("y", 302), ("z", 402)):
            self.assertIn(
                "the same error: the function gave %d\n" % gave, self.replay(1, "a/failed/r/good/" + name).stdout
            )

    def test_what_all_passes_share(self):
        self.write("body.yaml", BODY.replace("test.adder", "test.failing_adder") % 999)
        self.run_into("a", OVER, code=1)
        self.assertEqual(self.folders(), ["r/adder"])
        self.assertIn("with the same error: it cannot add\n", self.replay(1, "a").stdout)
        body = BODY.replace(
            "two: {uses: test.constant, with: {value: 2}}",
            "one: {uses: test.constant}\n  two: {uses: test.fail_above, in: {a: one}, with: {value: 0}}",
        )
        self.write("body.yaml", body % 999)
        self.run_into("b", OVER, code=1)
        self.assertEqual(self.folders("b"), ["r/two"])
        self.assertIn("with the same error: %s\n" % TOO_LARGE, self.replay(1, "b").stdout)

    def test_in_a_body_of_a_body(self):
        self.write("body.yaml", BODY % 250)
        self.write("outer.yaml", OVER)
        text = "marrow: 1\nnodes:\n  o: {repeat: outer.yaml, at_most: 1}\noutputs: {all: o.all}\n"
        self.run_into("a", text, code=1)
        self.assertEqual(len(self.folders()), 1)
        told = self.replay(1, "a").stdout
        self.assertIn("node 'o/r/good' (test.fail_applied) for ", told)
        self.assertIn("with the same error: the function gave 302\n", told)

    def test_in_a_pass_of_a_pass(self):
        """Pass x of the outer body starts with 100: the inner passes get 200, and then 400."""
        self.write("body.yaml", BODY % 250)
        start = OVER.replace("nodes:", "nodes:\n  start: {uses: test.constant}").replace(
            "item: l", "item: l, before: start"
        )
        self.write("outer.yaml", start.replace("all: r.good", "last: r.last_good"))
        text = (
            "marrow: 1\nnodes:\n  l: {uses: test.letters}\n"
            "  o: {repeat: outer.yaml, over: letter, in: {start: l}, if_pass_fails: go_on}\noutputs: {last: o.last}\n"
        )
        self.run_into("a", text)
        self.assertEqual(self.folders(), ["o/r/good/x/y", "o/r/good/y/x", "o/r/good/z/x"])
        for place, gave in (("x/y", 402), ("y/x", 302), ("z/x", 402)):
            told = self.replay(1, "a/failed/o/r/good/" + place, "--no-cache").stdout
            self.assertIn("its inputs are the same as in the run\n", told)
            self.assertIn("with the same error: the function gave %d\n" % gave, told)

    def test_a_node_that_may_fail(self):
        text = LETTERS.replace("with: {value: 150}", "with: {value: 250}, may_fail: true")
        self.run_into("a", text)
        self.assertEqual(self.folders(), ["f/z"])
        self.assertIn("with the same error: " + TOO_LARGE, self.replay(1, "a").stdout)

    def test_inputs_that_do_not_go_in_step(self):
        text = (
            "marrow: 1\nnodes:\n  s: {uses: test.sides}\n  t: {uses: test.sides, with: {names: [c]}}\n"
            "  f: {uses: test.add, in: {a: s.both, b: t.both}}\noutputs: {f: f}\n"
        )
        self.run_into("a", text, code=1)
        self.assertIsNone(self.call("a/failed/f")["inputs"])
        self.assertIn("with the same error: inputs 'a' and 'b' do not go in step", self.replay(1, "a").stdout)

    def test_what_keeps_the_call_from_being_made(self):
        self.write("word", "fine")
        text = (
            "marrow: 1\nnodes:\n  n: {uses: parse.test_number, with: {path: word, value: 900}}\n"
            "  f: {uses: test.fail_above, in: {a: n}, with: {value: 0}}\noutputs: {f: f}\n"
        )
        self.run_into("a", text, code=1)
        self.write("word", "refuse")
        told = self.replay(2, "a", "--no-cache").stderr
        self.assertIn("marrow: error: it could not be called: node 'n' (parse.test_number) failed: ", told)

    def test_names_that_no_folder_can_have(self):
        text = (
            "marrow: 1\nnodes:\n  s: {uses: test.sides, with: {names: ['../x', 'a/b', '..']}}\n"
            "  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 0}}\noutputs: {f: f}\n"
        )
        self.run_into("a", text, code=1)
        self.assertEqual(len(self.folders()), 3)
        for folder in self.folders():
            self.assertIn("for " + self.call("a/failed/" + folder)["item"], self.replay(1, "a/failed/" + folder).stdout)

    def test_no_more_folders_than_tell_something(self):
        names = ", ".join("n%d" % i for i in range(12))
        text = (
            "marrow: 1\nnodes:\n  s: {uses: test.sides, with: {names: [%s]}}\n"
            "  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 0}}\noutputs: {f: f}\n" % names
        )
        self.run_into("a", text, code=1)
        self.assertEqual(len(self.folders()), 10)

    def test_a_reader(self):
        """It dies in its own process, as in the run; in this process it takes the replay with it."""
        self.write("word", "crash")
        text = "marrow: 1\nnodes:\n  c: {uses: test.constant}\n  n: {uses: parse.test_number, in: {added: c}, "
        text += "with: {path: word}}\noutputs: {n: n}\n"
        self.run_into("a", text, code=1)
        self.assertIn("with the same error: ", self.replay(1, "a").stdout)
        if not IS_SANITIZED:
            self.replay(-11, "a", "--in-this-process")

    def test_a_cell_of_a_comparison(self):
        (self.scratch / "cases" / "one").mkdir(parents=True)
        text = LETTERS.replace("{uses: test.letters}", "{uses: test.constant, with: {value: 300, path: $case}}")
        self.write("p.yaml", text.replace("nodes:", "inputs: {case: {type: path}}\nnodes:"))
        self.write(
            "e.yaml",
            "experiment: 1\npipeline: p.yaml\nvariants: {b: {f.value: 500}, a: {}}\ncases: {folders: [cases/*]}\n"
            "metrics: [f.value]\ntimed_cells: 0\n",
        )
        told = self.marrow("compare", "e.yaml", "--out", "compared")
        cells = [str(file.parent) for file in (self.scratch / "compared").rglob("call.json")]
        self.assertEqual(len(cells), 1, told.stdout + told.stderr)
        self.assertIn("with the same error: " + TOO_LARGE, self.replay(1, cells[0]).stdout)

    def test_events_and_json(self):
        result = self.marrow("run", self.write("p.yaml", LETTERS), "--out", "a", "--json")
        self.assertEqual(json.loads(result.stdout.splitlines()[-1])["failed_calls"], ["failed/f/y", "failed/f/z"])

    def test_debuggers(self):
        self.run_into("a", LETTERS.replace("150", "250"), code=1)
        told = self.replay(2, "a", "--debugger", "no-such-debugger").stderr
        self.assertIn("the debugger 'no-such-debugger' cannot be started: No such file or directory; install it, or "
                      "name another with --debugger", told)  # fmt: skip
        for name in ("gdb", "lldb", "other"):
            program = self.write(name, '#!/bin/sh\nprintf "[%s]" "$@"\n')
            program.chmod(0o755)
        self.environment["PATH"] = "%s:%s" % (self.scratch, os.environ["PATH"])
        told = lambda name: self.marrow("replay", "a", "--debugger", name).stdout
        program = re.escape(str(MARROW.resolve()))
        replay = r"\[%s\]\[replay\]\[a/failed/f/z\]\[--in-this-process\]" % program
        self.assertRegex(told("gdb"), r"^\[-q\].*\[run\]\[--args\]" + replay + r"\[--stop\]$")
        self.assertRegex(told("lldb"), r"^\[-o\]\[run\]\[--\]" + replay + r"\[--stop\]$")
        self.assertRegex(told("other"), "^" + replay + "$")

    @unittest.skipUnless(shutil.which("gdb"), "gdb is not here")
    def test_gdb_stops_right_before_the_call(self):
        self.run_into("a", LETTERS.replace("150", "250"), code=1)
        commands = self.write("commands", "backtrace\ncontinue\nquit\n")
        with open(commands) as stream:
            result = subprocess.run(
                [MARROW, "replay", "a", "--debugger", "gdb"],
                cwd=self.scratch, stdin=stream, capture_output=True, text=True, timeout=300,
                env={**os.environ, **self.environment, "MARROW_PLUGIN_PATH": ":".join(map(str, self.plugins))},
            )  # fmt: skip
        told = result.stdout + result.stderr
        if "ptrace" in told or "Could not trace" in told:
            self.skipTest("this machine allows no debugger")
        self.assertIn("SIGTRAP", told)
        self.assertRegex(told, r"#\d+ .*marrow::Evaluation::call_node")
        self.assertIn("failed again, with the same error: " + TOO_LARGE, told)


main()
