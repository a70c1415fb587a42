# SPDX-License-Identifier: Apache-2.0
"""What is printed: no text of a file commands the terminal, and what cannot be printed is said."""
import json
import os
import subprocess

from harness import MARROW, TEST_PLUGINS
from harness.program import main
from number_cases import Commands

ESCAPE = "\x1b[2J\x1b]0;owned\x07\nmarrow: forged"


class Terminal(Commands):
    def test_no_name_commands_the_terminal(self):
        self.write(
            "p.yaml",
            "marrow: 1\nnodes:\n  s: {uses: test.sides, with: {names: [%s, %s]}}\n  w: {uses: test.work, with: {value:"
            " 0.3}, in: {after: s.both}}\n  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 10}}\noutputs:"
            " {o: f, w: w}\n" % (json.dumps(ESCAPE), json.dumps("\x9b31m\u202e")),
        )
        told = []
        for arguments in (
            ["run", "p.yaml", "--out", "a"],
            ["diff", "a", "a"],
            ["rerun", "a", "--out", "b"],
            ["graph", "p.yaml"],
            ["plan", "p.yaml"],
            ["show", "a"],
            ["run", "p.yaml", "--out", "c", "--set", "f.in.a=s." + ESCAPE.replace(".", "")],
            ["inspect", ESCAPE],
            ["list", ESCAPE],
        ):
            result = subprocess.run(
                [str(MARROW), *arguments],
                cwd=self.scratch,
                env=dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS)),
                capture_output=True,
            )
            told.append(result.stdout + result.stderr)
        told += [(self.scratch / "a" / "log.txt").read_bytes(), (self.scratch / "b" / "log.txt").read_bytes()]
        for text in told:
            for bad in (b"\x1b", b"\x07", b"\xc2\x9b", b"\xe2\x80\xae", b"\nmarrow: forged"):
                self.assertNotIn(bad, text)
        self.assertIn(b"f (\\x1b[2J\\x1b]0;owned\\x07\\x0amarrow: forged)", told[0])
        self.assertRegex(told[-1], rb"w \(\\u009b31m\\u202e\): \d")

    def test_nor_does_a_faulty_file(self):
        # YAML itself lets no escape sequence through, but these it does.
        self.write(
            "p.yaml",
            (
                'marrow: 1\n"k\\e[2J": 1\nnodes:\n  c: {uses: "u\\e[31m", with: {"o\\e": 1}}  # \u009b31m'
                ' \u202e\noutputs: {"o\\e": "r\\e"}\n'
            ),
        )
        for arguments in (
            ["check", "p.yaml"],
            ["run", "p.yaml", "--set", "c.value=\x1b[2J"],
            ["check", "p.yaml", "\x1b[2J=1"],
            ["check", "\x1b[2J.yaml"],
        ):
            result = self.expect(2, *arguments)
            for bad in ("\x1b", "\x9b", "\u202e"):
                self.assertNotIn(bad, result.stdout + result.stderr)
        self.assertIn(
            "the key 'k\\x1b[2J' in the pipeline holds a control character", self.expect(2, "check", "p.yaml").stderr
        )
        self.assertIn("# \\u009b31m \\u202e", self.expect(2, "check", "p.yaml").stderr, "the line as it is quoted")
        self.assertIn(
            "k\x1b[2J",
            json.loads(self.expect(2, "check", "--json", "p.yaml").stdout)[0]["message"],
            "JSON has escapes of its own",
        )

    def test_nor_does_an_argument_or_a_folder(self):
        name, cache = "a" + ESCAPE.replace("/", "") + "\u202e", self.scratch / "cache\x1b[2J"
        self.write(name, "x")
        self.write(
            "p.yaml",
            (
                "marrow: 1\ninputs: {x: {type: path}}\nnodes:\n  w: {uses: test.work, with: {value: 0.01, path:"
                " $x}}\noutputs: {o: w}\n"
            ),
        )
        environment = {"MARROW_CACHE": str(cache)}
        self.expect(0, "run", "p.yaml", "x=" + name, "--out", "o", extra_environment=environment)
        key = json.loads((self.scratch / "o" / "run.json").read_text())["nodes"][0]["keys"]["number"]
        commands = [
            [0, "cache", "info"],
            [0, "cache", "why", key],
            [2, "cache", "why", ESCAPE],
            [2, "cache", "gc", "--keep-gb", ESCAPE],
            [2, "run", "p.yaml", "--threads", ESCAPE],
            [2, "run", "p.yaml", "--seed", ESCAPE],
            [2, "run", "p.yaml", "--" + ESCAPE],
            [0, "doctor"],
        ]
        for code, *arguments in commands:
            environment["MARROW_PLUGIN_PATH"] = str(TEST_PLUGINS) + ":/nowhere" + ESCAPE
            result = self.expect(code, *arguments, extra_environment=environment)
            for bad in ("\x1b", "\x07", "\u202e", "\nmarrow: forged"):
                self.assertNotIn(bad, result.stdout + result.stderr, arguments)
            self.assertIn("\\x1b[2J", result.stdout + result.stderr, arguments)

    def test_names_in_dot_files_and_pages_are_names(self):
        self.write(
            "p.yaml",
            (
                "marrow: 1\nname: 'a\"b'\nnodes:\n  'c\"; x': {uses: test.constant}\n  s: {uses: test.sides, with:"
                " {names: ['</script><script>alert(1)</script>', b]}}\noutputs: {'o\"': 'c\"; x', s: s.both}\n"
            ),
        )
        dot = self.expect(0, "graph", "--dot", "p.yaml").stdout
        self.assertIn('digraph "a\\"b" {', dot)
        self.assertIn('  "c\\"; x" [label="c\\"; x\\ntest.constant", tooltip="p.yaml:4"];', dot)
        self.expect(0, "run", "p.yaml", "--out", "a", "--quiet")
        self.expect(0, "show", "a")
        page = (self.scratch / "a" / "report.html").read_text()
        self.assertNotIn("<script>alert", page)
        self.assertEqual(
            self.page_data("a/report.html")["figures"][-1]["columns"][0], "<%2Fscript><script>alert(1)<%2Fscript>"
        )

    def test_what_cannot_be_printed_is_said(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([str(MARROW), "list"], stdout=full, stderr=subprocess.PIPE, text=True)
        self.assertIn(result.returncode, (1, 2))
        self.assertEqual(
            result.stderr, "marrow: error: what was to be printed could not be written; is the disk full?\n"
        )


if __name__ == "__main__":
    main()
