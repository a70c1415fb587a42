# SPDX-License-Identifier: Apache-2.0
"""What people expect of any command line: short options, a dry run, the standard input, JSON, and columns that wrap."""
import json
import os
import re
import subprocess

from harness import MARROW, SOURCE, TEST_PLUGINS
from harness.program import Case, SharedCase, main
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
    files = {"p.yaml": PIPELINE}

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


# What is printed: no text of a file commands the terminal, and what cannot be printed is said.
ESCAPE = "\x1b[2J\x1b]0;owned\x07\nmarrow: forged"
BAD = ("\x1b", "\x07", "\x9b", "\u202e", "\nmarrow: forged")
NAMES = """marrow: 1
nodes:
  s: {uses: test.sides, with: {names: [%s, %s]}}
  w: {uses: test.work, with: {value: 0.3}, in: {after: s.both}}
  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 10}}
outputs: {o: f, w: w}
"""
# YAML itself lets no escape sequence through, but these it does.
FAULTY = """marrow: 1
"k\\e[2J": 1
nodes:
  c: {uses: "u\\e[31m", with: {"o\\e": 1}}  # \u009b31m \u202e
outputs: {"o\\e": "r\\e"}
"""
WORK = """marrow: 1
inputs: {x: {type: path}}
nodes:
  w: {uses: test.work, with: {value: 0.01, path: $x}}
outputs: {o: w}
"""
MARKS = """marrow: 1
name: 'a"b'
nodes:
  'c"; x': {uses: test.constant}
  s: {uses: test.sides, with: {names: ['</script><script>alert(1)</script>', b]}}
outputs: {'o"': 'c"; x', s: s.both}
"""


class Printed(Case):
    def told(self, *arguments, code=None):
        """All that a call prints, which commands nothing."""
        result = self.marrow(*arguments)
        self.assertIn(result.returncode, (0, 1, 2) if code is None else (code,), arguments)
        for bad in BAD:
            self.assertNotIn(bad, result.stdout + result.stderr, arguments)
        return result.stdout + result.stderr

    def test_no_name_commands_the_terminal(self):
        self.write("p.yaml", NAMES % (json.dumps(ESCAPE), json.dumps("\x9b31m\u202e")))
        told = self.told("run", "p.yaml", "--out", "a")
        self.assertIn("f (\\x1b[2J\\x1b]0;owned\\x07\\x0amarrow: forged)", told)
        for arguments in (
            ["diff", "a", "a"],
            ["rerun", "a", "--out", "b"],
            ["graph", "p.yaml"],
            ["plan", "p.yaml"],
            ["show", "a"],
            ["run", "p.yaml", "--out", "c", "--set", "f.in.a=s." + ESCAPE],
            ["inspect", ESCAPE],
            ["list", ESCAPE],
        ):
            self.told(*arguments)
        for log in ("a/log.txt", "b/log.txt"):
            text = self.read(log)
            self.assertEqual([bad for bad in BAD if bad in text], [], log)
        self.assertRegex(text, r"w \(\\u009b31m\\u202e\): \d")

    def test_nor_does_a_faulty_file(self):
        self.write("p.yaml", FAULTY)
        said = self.told("check", "p.yaml", code=2)
        self.assertIn("the key 'k\\x1b[2J' in the pipeline holds a control character", said)
        self.assertIn("# \\u009b31m \\u202e", said, "the line as it is quoted")
        for arguments in (["run", "p.yaml", "--set", "c.value=\x1b[2J"], ["check", "p.yaml", "\x1b[2J=1"]):
            self.told(*arguments, code=2)
        self.told("check", "\x1b[2J.yaml", code=2)
        as_json = json.loads(self.expect(2, "check", "--json", "p.yaml").stdout)
        self.assertIn("k\x1b[2J", as_json[0]["message"], "JSON has escapes of its own")

    def test_nor_does_an_argument_or_a_folder(self):
        name = "a" + ESCAPE.replace("/", "") + "\u202e"
        self.write(name, "x")
        self.write("p.yaml", WORK)
        self.environment = {"MARROW_CACHE": str(self.scratch / "cache\x1b[2J")}
        self.expect(0, "run", "p.yaml", "x=" + name, "--out", "o")
        key = self.nodes("o")["w"]["keys"]["number"]
        self.plugins = [TEST_PLUGINS, "/nowhere" + ESCAPE]
        for code, *arguments in (
            [0, "cache", "info"],
            [0, "cache", "why", key],
            [2, "cache", "why", ESCAPE],
            [2, "cache", "gc", "--keep-gb", ESCAPE],
            [2, "run", "p.yaml", "--threads", ESCAPE],
            [2, "run", "p.yaml", "--seed", ESCAPE],
            [2, "run", "p.yaml", "--" + ESCAPE],
            [0, "doctor"],
        ):
            self.assertIn("\\x1b[2J", self.told(*arguments, code=code), arguments)

    def test_names_in_dot_files_and_pages_are_names(self):
        self.write("p.yaml", MARKS)
        dot = self.printed("graph", "--dot", "p.yaml")
        self.assertIn('digraph "a\\"b" {', dot)
        self.assertIn('  "c\\"; x" [label="c\\"; x\\ntest.constant", tooltip="p.yaml:4"];', dot)
        self.expect(0, "run", "p.yaml", "--out", "a", "--quiet")
        self.expect(0, "show", "a")
        self.assertNotIn("<script>alert", self.read("a/report.html"))
        column = self.page_data("a/report.html")["figures"][-1]["columns"][0]
        self.assertEqual(column, "<%2Fscript><script>alert(1)<%2Fscript>")

    def test_what_cannot_be_printed_is_said(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([str(MARROW), "list"], stdout=full, stderr=subprocess.PIPE, text=True)
        self.assertIn(result.returncode, (1, 2))
        said = "marrow: error: what was to be printed could not be written; is the disk full?\n"
        self.assertEqual(result.stderr, said)


# The log of a run: levels on the terminal, every line in the file, events as JSON.
PIPELINE_OF_LOG = """marrow: 1
nodes:
  c: {uses: test.constant}
  w: {uses: test.warn}
  s: {uses: test.say}
  f: {uses: test.fail_above, in: {a: c}, with: {value: -1}}
outputs: {c: c, w: w, s: s, f: f}
"""
LINE = re.compile(r"\d{4}-\d{2}-\d{2} \d{2}:\d{2}:\d{2}\.\d{3} \[(debug|info|warning|error)\] (.*)")


class Log(SharedCase):
    def make(self):
        self.write("p.yaml", PIPELINE_OF_LOG)
        self.runs = {}

    def run_with(self, *arguments):
        """The run with these options, and the lines of its log as (level, text). Each is made once."""
        if arguments not in self.runs:
            out = "out-%d" % len(self.runs)
            result = self.expect(1, "run", "p.yaml", "--out", out, "--no-cache", *arguments)
            lines = [LINE.fullmatch(line) for line in self.read(out + "/log.txt").splitlines()]
            self.assertNotIn(None, lines)
            self.runs[arguments] = result, [line.groups() for line in lines]
        return self.runs[arguments]

    def test_the_least_level_that_is_shown(self):
        wanted = {"debug": "a trifle", "info": "a word", "warning": "warning: mind the gap", "error": "error: "}
        names = list(wanted)
        for least in (None, *names, "quiet"):
            shown = self.run_with(*(["--quiet"] if least == "quiet" else ["--log-level", least] if least else []))[0]
            first = names.index({None: "info", "quiet": "error"}.get(least, least))
            for i, name in enumerate(names):
                check = self.assertIn if i >= first else self.assertNotIn
                check(wanted[name], shown.stderr, (least, name))

    def test_the_file_has_every_line_with_level_and_node(self):
        lines = self.run_with("--quiet")[1]
        for line in (("debug", "s: a trifle"), ("info", "s: a word"), ("warning", "w: mind the gap")):
            self.assertIn(line, lines)
        (error,) = (text for level, text in lines if level == "error")
        self.assertIn("node 'f'", error)

    def test_as_json(self):
        result = self.run_with("--json")[0]
        events = [json.loads(line) for line in result.stdout.splitlines() if line.startswith('{"event"')]
        events = [event for event in events if event["event"] in ("message", "warning")]
        said = {(event["node"], event.get("level"), event["text"]) for event in events}
        self.assertEqual(said, {("s", "debug", "a trifle"), ("s", "info", "a word"), ("w", "warning", "mind the gap")})

    def test_an_unknown_level(self):
        self.refused(["--log-level", "loud"], "run", "p.yaml", "--log-level", "loud")

    def test_colours_on_a_terminal_only(self):
        self.assertNotIn("\x1b[", self.run_with()[0].stderr)
        environment = {**os.environ, "MARROW_PLUGIN_PATH": str(TEST_PLUGINS), "TERM": "xterm"}
        command = [MARROW, "run", "p.yaml", "--out", "coloured", "--no-cache"]
        with Terminal(command, cwd=self.scratch, environment=environment) as terminal:
            self.assertRegex(terminal.to_the_end(), r"\x1b\[33m[^\n]*mind the gap")
        self.assertNotIn("\x1b", self.read("coloured/log.txt"))


if __name__ == "__main__":
    main()
