# SPDX-License-Identifier: Apache-2.0
"""What is printed: no text of a file commands the terminal, and what cannot be printed is said."""
import json
import subprocess

from harness import MARROW, TEST_PLUGINS
from harness.program import Case, main

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


class Terminal(Case):
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


if __name__ == "__main__":
    main()
