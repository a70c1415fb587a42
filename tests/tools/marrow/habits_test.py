# SPDX-License-Identifier: Apache-2.0
"""What people expect of any command line: short options, a dry run, the standard input, JSON, and columns that wrap."""
import json
import os
import re
import subprocess

from harness import MARROW, SOURCE, TEST_PLUGINS
from harness.program import main
from harness.terminal import Terminal
from number_cases import Commands

PIPELINE = """marrow: 1
nodes:
  first: {uses: test.constant, with: {value: 3}}
  sides: {uses: test.sides}
  sum: {uses: test.add, in: {a: sides.both, b: first}}
  unused: {uses: test.constant}
outputs: {total: sum, number: first}
"""


class Habits(Commands):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache")}

    def marrow(self, *arguments, **more):
        return super().marrow(*arguments, **{"extra_environment": self.environment, **more})

    def json(self, *arguments):
        return json.loads(self.expect(0, *arguments, "--json").stdout)

    def said(self, *arguments):
        result = self.expect(2, *arguments)
        self.assertEqual(result.stdout, "")
        return result.stderr

    def test_version(self):
        version = re.search(r"project\(marrow VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
        for asked in ("--version", "-V", "version"):
            self.assertEqual(self.expect(0, asked).stdout, "marrow %s\n" % version)

    def test_letters(self):
        self.expect(0, "run", "p.yaml", "-qo", "out")
        self.assertTrue((self.scratch / "out" / "run.json").exists())
        quiet = self.expect(0, "run", "p.yaml", "-q", "-o", "again")
        self.assertEqual((quiet.stdout, quiet.stderr), ("", ""))
        self.assertEqual(self.expect(0, "rerun", "out", "-o", "rerun").returncode, 0)
        self.assertIn("note", self.expect(0, "schema", "-o", "schema.json").stderr + "note")
        self.assertTrue((self.scratch / "schema.json").exists())

    def test_a_word_after_one_dash_is_no_value(self):
        """-out=x would be the folder ut=x."""
        for word, meant in (("-out=x", "--out"), ("-only=total", "--only"), ("-quiet", "--quiet")):
            self.assertIn(
                "'run' has no option '%s'; did you mean '%s'?" % (word.split("=")[0], meant),
                self.said("run", "p.yaml", word),
            )
        self.assertIn("'run' has no option '-vo3'; ", self.said("run", "p.yaml", "-vo3"))
        self.assertIn("there is no command 'rnu'", self.said("rnu", "-quiet"))
        self.assertIn("'gc' has no option '-keep-gb'; did you mean '--keep-gb'?", self.said("cache", "gc", "-keep-gb"))
        self.assertEqual(self.everything(), ["p.yaml"])
        self.expect(0, "check", "p.yaml", "--set", "first.value=-3")

    def test_verbose(self):
        self.write(
            "warn.yaml",
            "marrow: 1\nnodes:\n  r: {repeat: {nodes: {c: {uses: test.constant}}, outputs: {o: c}}, at_most: 1}\n"
            "outputs: {o: r.last_o}\n",
        )
        usual = self.expect(0, "run", "warn.yaml", "--no-cache", "-o", "a").stderr
        verbose = self.expect(0, "run", "warn.yaml", "--no-cache", "-o", "b", "-v").stderr
        self.assertNotIn("r/c", usual, "short steps of a body")
        self.assertIn("r/c", verbose)
        self.assertIn("excludes", self.said("run", "p.yaml", "-v", "--log-level", "error").lower())

    def test_dry_run(self):
        plan = self.expect(0, "plan", "p.yaml").stdout
        self.assertIn("0 cached, 2 to run, 1 that may run", plan)
        for word in ("-n", "--dry-run"):
            self.assertEqual(self.expect(0, "run", "p.yaml", word).stdout, plan)
        self.assertEqual(self.json("run", "p.yaml", "-n"), self.json("plan", "p.yaml"))
        self.assertIn("1 to run", self.expect(0, "run", "p.yaml", "-n", "--only", "number").stdout)
        self.assertIn("excludes", self.said("run", "p.yaml", "-n", "--no-cache").lower())
        self.assertEqual(self.everything(), ["p.yaml"], "nothing is made")

    def test_plan_as_json(self):
        plan = self.json("plan", "p.yaml")
        states = {name: node["state"] for name, node in plan["nodes"].items()}
        self.assertEqual(states, {"first": "runs", "sides": "runs", "sum": "depends", "unused": "not_needed"})
        self.assertEqual((plan["cached"], plan["to_run"], plan["may_run"]), (0, 2, 1))
        self.expect(0, "run", "p.yaml", "-q")
        plan = self.json("plan", "p.yaml", "--set", "first.value=4")
        states = {name: node["state"] for name, node in plan["nodes"].items()}
        self.assertEqual(states, {"first": "runs", "sides": "cached", "sum": "depends", "unused": "not_needed"})
        self.assertEqual(plan["nodes"]["first"]["text"], "runs: option 'value' is 4, was 3")

    def test_graph_as_json(self):
        graph = self.json("graph", "p.yaml")
        self.assertEqual(graph["name"], "p")
        nodes = {node["id"]: node for node in graph["nodes"]}
        self.assertEqual(sorted(nodes), ["first", "sides", "sum", "unused"])
        self.assertEqual(nodes["sum"]["for_each"], ["side"])
        self.assertEqual([name for name, node in nodes.items() if not node["needed"]], ["unused"])
        self.assertEqual(
            sorted((edge["from"], edge["to"], edge["port"], edge["function"]) for edge in graph["edges"]),
            [("first", "sum", "b", False), ("sides", "sum", "a", False)],
        )
        self.assertEqual(
            [(one["name"], one["from"], one["axes"]) for one in graph["outputs"]],
            [("total", "sum", ["side"]), ("number", "first", [])],
        )
        self.assertIn("excludes", self.said("graph", "p.yaml", "--json", "--dot").lower())

    def test_cache_as_json(self):
        self.expect(0, "run", "p.yaml", "-q", "-o", "out")
        info = self.json("cache", "info")
        self.assertEqual(info["folder"], str(self.scratch / "cache"))
        self.assertEqual({name: share["results"] for name, share in info["nodes"].items()}["test.constant"], 1)
        self.assertEqual(info["all"]["results"], sum(share["results"] for share in info["nodes"].values()))
        self.assertEqual(info["all"]["bytes"], sum(share["bytes"] for share in info["nodes"].values()))
        record = json.loads((self.scratch / "out" / "run.json").read_text())
        key = next(node["keys"]["number"] for node in record["nodes"] if node["id"] == "first")
        made = self.json("cache", "why", key)[0]
        self.assertEqual((made["node"], made["options"]["value"], made["outputs"]), ("test.constant", "3", [key]))
        removed = self.json("cache", "gc", "--keep-gb", "0")
        self.assertEqual((removed["removed"], removed["bytes"]), (info["all"]["results"], info["all"]["bytes"]))

    def from_input(self, text, *arguments, code=0):
        done = subprocess.run(
            [MARROW, *arguments],
            input=text,
            capture_output=True,
            text=True,
            cwd=self.scratch,
            env={**os.environ, "MARROW_PLUGIN_PATH": str(TEST_PLUGINS), **self.environment},
        )
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def test_the_standard_input(self):
        self.write("data", "1")
        text = PIPELINE.replace("value: 3", "value: 3, path: data")
        self.assertIn("-: good; 4 nodes, 2 outputs\n", self.from_input(text, "check", "-").stdout)
        self.assertIn("first  (test.constant)", self.from_input(text, "graph", "-").stdout)
        self.assertIn("2 to run", self.from_input(text, "plan", "-").stdout)
        self.from_input(text, "run", "-", "-q")
        self.assertTrue((self.scratch / "runs" / "stdin" / "outputs" / "number.json").exists())
        self.from_input(text.replace("marrow: 1", "marrow: 1\nname: mine"), "run", "-", "-q", "--set", "first.value=5")
        number = json.loads((self.scratch / "runs" / "mine" / "outputs" / "number.json").read_text())
        self.assertIn(5, [item["value"] for item in number.get("items", number.get("metrics", []))], number)
        self.expect(0, "rerun", "runs/stdin")

    def test_faults_of_the_standard_input(self):
        said = self.from_input(PIPELINE.replace("test.add", "test.ad"), "check", "-", code=2).stderr
        self.assertIn("-:5:15: error: unknown node 'test.ad'\n", said)
        self.assertIn("  sum: {uses: test.ad, in:", said, "its line is shown")
        self.assertIn(
            "-: error: the pipeline file is longer than 4 MB",
            self.from_input("#" * 4_000_001, "check", "-", code=2).stderr,
        )
        self.assertIn(
            "this is an experiment, not a pipeline", self.from_input("experiment: 1\n", "check", "-", code=2).stderr
        )
        for command, what in ((["compare", "-"], "experiment"), (["show", "-"], "folder of a run")):
            self.assertEqual(
                self.from_input("", *command, code=2).stderr,
                "marrow: error: - is the standard input, which holds no %s; give its path (./- is a file of that "
                "name)\n" % what,
            )
        self.assertIn(
            "which does not change; give the path of a pipeline", self.from_input("", "watch", "-", code=2).stderr
        )
        self.write("-", PIPELINE)
        self.assertIn("./-: good", self.from_input("", "check", "./-").stdout)

    def in_terminal(self, columns, *arguments):
        environment = {**os.environ, "MARROW_PLUGIN_PATH": str(TEST_PLUGINS), **self.environment}
        with Terminal([MARROW, *arguments], columns, self.scratch, environment) as terminal:
            return terminal.to_the_end()

    def test_columns_wrap_on_a_terminal(self):
        for arguments in (["list"], ["list", "--kinds"], ["run", "--help"], ["inspect", "edges.canny"], ["doctor"]):
            whole = self.expect(0, *arguments).stdout
            self.assertGreater(max(map(len, whole.splitlines())), 70, arguments)
            for columns in (100, 70):
                text = self.in_terminal(columns, *arguments)
                for line in text.splitlines():
                    words = line.split()
                    self.assertTrue(len(line) <= columns or len(words[-1]) > 20, (columns, line))
                self.assertEqual(text.split(), whole.split(), "nothing else changes")

    def test_a_wrapped_row(self):
        text = self.in_terminal(77, "plan", "p.yaml")
        lines = ["first            test.constant                      runs: it has not run", 52 * " " + "before"]
        self.assertEqual(text.splitlines()[:2], lines)
        text = self.in_terminal(70, "plan", "p.yaml")  # too little room beside the names
        self.assertEqual(text.splitlines()[:2], ["first            test.constant", "      runs: it has not run before"])
        help_text = self.in_terminal(60, "cache", "gc", "--help")
        self.assertIn(
            "  --shared                    of the shared store, instead\n" + 30 * " " + "of this host's\n", help_text
        )


if __name__ == "__main__":
    main()
