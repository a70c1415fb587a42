# SPDX-License-Identifier: Apache-2.0
"""The log of a run: levels on the terminal, every line in the file, events as JSON."""
import json
import os
import re

from harness import MARROW, TEST_PLUGINS
from harness.program import SharedCase, main
from harness.terminal import Terminal

PIPELINE = """marrow: 1
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
        self.write("p.yaml", PIPELINE)
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
