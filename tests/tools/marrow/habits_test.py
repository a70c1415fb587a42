# SPDX-License-Identifier: Apache-2.0
"""What people expect of any command line: short options, a dry run, the standard input, JSON, and columns that wrap."""
import os
import re
import subprocess

from harness import MARROW, SOURCE, TEST_PLUGINS
from harness.program import Case, main
from harness.terminal import Terminal

PIPELINE = """marrow: 1
nodes:
  first: {uses: test.constant, with: {value: 3}}
  sides: {uses: test.sides}
  sum: {uses: test.add, in: {a: sides.both, b: first}}
  unused: {uses: test.constant}
outputs: {total: sum, number: first}
"""


class Habits(Case):
    def setUp(self):
        super().setUp()
        self.write("p.yaml", PIPELINE)

    def test_version(self):
        version = re.search(r"project\(marrow VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
        for asked in ("--version", "-V", "version"):
            self.assertEqual(self.printed(asked), "marrow %s\n" % version)

    def test_letters(self):
        self.expect(0, "run", "p.yaml", "-qo", "out")
        self.assertTrue((self.scratch / "out" / "run.json").exists())
        quiet = self.expect(0, "run", "p.yaml", "-q", "-o", "again")
        self.assertEqual((quiet.stdout, quiet.stderr), ("", ""))
        self.expect(0, "rerun", "out", "-o", "rerun")
        self.expect(0, "schema", "-o", "schema.json")
        self.assertTrue((self.scratch / "schema.json").exists())

    def test_a_word_after_one_dash_is_no_value(self):
        """-out=x would be the folder ut=x."""
        run = ["run", "p.yaml"]
        self.refusals(
            ("'run' has no option '-out'; did you mean '--out'?", *run, "-out=x"),
            ("'run' has no option '-only'; did you mean '--only'?", *run, "-only=total"),
            ("'run' has no option '-quiet'; did you mean '--quiet'?", *run, "-quiet"),
            ("'run' has no option '-vo3'; ", *run, "-vo3"),
            ("there is no command 'rnu'", "rnu", "-quiet"),
            ("'gc' has no option '-keep-gb'; did you mean '--keep-gb'?", "cache", "gc", "-keep-gb"),
        )
        self.assertEqual(self.everything(), ["p.yaml"])
        self.expect(0, "check", "p.yaml", "--set", "first.value=-3")

    def test_what_excludes_each_other(self):
        for words in (
            ["run", "p.yaml", "-v", "--log-level", "error"],
            ["run", "p.yaml", "-n", "--no-cache"],
            ["graph", "p.yaml", "--json", "--dot"],
        ):
            result = self.expect(2, *words)
            self.assertEqual(result.stdout, "")
            self.assertIn("excludes", result.stderr.lower())

    def test_verbose(self):
        self.write(
            "warn.yaml",
            "marrow: 1\nnodes:\n  r: {repeat: {nodes: {c: {uses: test.constant}}, outputs: {o: c}}, at_most: 1}\n"
            "outputs: {o: r.last_o}\n",
        )
        run = ["run", "warn.yaml", "--no-cache", "-o"]
        self.assertNotIn("r/c", self.expect(0, *run, "a").stderr, "short steps of a body")
        self.assertIn("r/c", self.expect(0, *run, "b", "-v").stderr)

    def test_dry_run_and_plan(self):
        plan = self.printed("plan", "p.yaml")
        self.assertIn("0 cached, 2 to run, 1 that may run", plan)
        for word in ("-n", "--dry-run"):
            self.assertEqual(self.printed("run", "p.yaml", word), plan)
        as_json = self.json_of("plan", "p.yaml")
        self.assertEqual(self.json_of("run", "p.yaml", "-n"), as_json)
        self.assertIn("1 to run", self.printed("run", "p.yaml", "-n", "--only", "number"))
        self.assertEqual(self.everything(), ["p.yaml"], "nothing is made")
        states = lambda plan: {name: node["state"] for name, node in plan["nodes"].items()}
        first = {"first": "runs", "sides": "runs", "sum": "depends", "unused": "not_needed"}
        self.assertEqual(states(as_json), first)
        self.assertEqual((as_json["cached"], as_json["to_run"], as_json["may_run"]), (0, 2, 1))
        self.expect(0, "run", "p.yaml", "-q")
        changed = self.json_of("plan", "p.yaml", "--set", "first.value=4")
        self.assertEqual(states(changed), {**first, "sides": "cached"})
        self.assertEqual(changed["nodes"]["first"]["text"], "runs: option 'value' is 4, was 3")

    def test_graph_as_json(self):
        graph = self.json_of("graph", "p.yaml")
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

    def test_cache_as_json(self):
        self.expect(0, "run", "p.yaml", "-q", "-o", "out")
        info = self.json_of("cache", "info")
        self.assertEqual(info["folder"], str(self.scratch / "cache"))
        self.assertEqual(info["nodes"]["test.constant"]["results"], 1)
        for amount in ("results", "bytes"):
            self.assertEqual(info["all"][amount], sum(share[amount] for share in info["nodes"].values()))
        key = self.nodes()["first"]["keys"]["number"]
        made = self.json_of("cache", "why", key)[0]
        self.assertEqual((made["node"], made["options"]["value"], made["outputs"]), ("test.constant", "3", [key]))
        removed = self.json_of("cache", "gc", "--keep-gb", "0")
        self.assertEqual((removed["removed"], removed["bytes"]), (info["all"]["results"], info["all"]["bytes"]))

    def from_input(self, text, *arguments, code=0):
        process = self.start(*arguments, stdin=subprocess.PIPE)
        said, complaints = process.communicate(text)
        self.assertEqual(process.returncode, code, said + complaints)
        return said + complaints

    def test_the_standard_input(self):
        self.write("data", "1")
        text = PIPELINE.replace("value: 3", "value: 3, path: data")
        self.assertIn("-: good; 4 nodes, 2 outputs\n", self.from_input(text, "check", "-"))
        self.assertIn("first  (test.constant)", self.from_input(text, "graph", "-"))
        self.assertIn("2 to run", self.from_input(text, "plan", "-"))
        self.from_input(text, "run", "-", "-q")
        self.assertTrue((self.scratch / "runs/stdin/outputs/number.json").exists())
        self.from_input(text.replace("marrow: 1", "marrow: 1\nname: mine"), "run", "-", "-q", "--set", "first.value=5")
        self.assertEqual(self.metric("runs/mine/outputs/number.json"), 5)
        self.expect(0, "rerun", "runs/stdin")

    def test_faults_of_the_standard_input(self):
        said = self.from_input(PIPELINE.replace("test.add", "test.ad"), "check", "-", code=2)
        self.assertIn("-:5:15: error: unknown node 'test.ad'\n", said)
        self.assertIn("  sum: {uses: test.ad, in:", said, "its line is shown")
        for text, command, fault in (
            ("#" * 4_000_001, "check", "-: error: the pipeline file is longer than 4 MB"),
            ("experiment: 1\n", "check", "this is an experiment, not a pipeline"),
            ("", "watch", "which does not change; give the path of a pipeline"),
        ):
            self.assertIn(fault, self.from_input(text, command, "-", code=2))
        holds_none = (
            "marrow: error: - is the standard input, which holds no %s; give its path (./- is a file of that name)\n"
        )
        for command, what in (("compare", "experiment"), ("show", "folder of a run")):
            self.assertEqual(self.from_input("", command, "-", code=2), holds_none % what)
        self.write("-", PIPELINE)
        self.assertIn("./-: good", self.from_input("", "check", "./-"))

    def in_terminal(self, columns, *arguments):
        environment = {**os.environ, "MARROW_PLUGIN_PATH": str(TEST_PLUGINS), **self.variables()}
        with Terminal([MARROW, *arguments], columns, self.scratch, environment) as terminal:
            return terminal.to_the_end()

    def test_columns_wrap_on_a_terminal(self):
        for arguments in (["list"], ["list", "--kinds"], ["run", "--help"], ["inspect", "edges.canny"], ["doctor"]):
            whole = self.printed(*arguments)
            self.assertGreater(max(map(len, whole.splitlines())), 70, arguments)
            for columns in (100, 70):
                text = self.in_terminal(columns, *arguments)
                for line in text.splitlines():
                    words = line.split()
                    self.assertTrue(len(line) <= columns or len(words[-1]) > 20, (columns, line))
                self.assertEqual(text.split(), whole.split(), "nothing else changes")

    def test_a_wrapped_row(self):
        for columns, first, second in (
            (77, "first            test.constant                      runs: it has not run", 52 * " " + "before"),
            (
                70,
                "first            test.constant",
                "      runs: it has not run before",
            ),  # too little room beside the names
        ):
            self.assertEqual(self.in_terminal(columns, "plan", "p.yaml").splitlines()[:2], [first, second])
        wrapped = "  --shared                    of the shared store, instead\n" + 30 * " " + "of this host's\n"
        self.assertIn(wrapped, self.in_terminal(60, "cache", "gc", "--help"))


if __name__ == "__main__":
    main()
