# SPDX-License-Identifier: Apache-2.0
"""The log of a run: levels on the terminal, every line in the file, events as JSON."""
import json
import os
import pty
import re
import subprocess
import unittest

from harness import MARROW, TEST_PLUGINS
from harness.program import Case, main, marrow

PIPELINE = """marrow: 1
nodes:
  c: {uses: test.constant}
  w: {uses: test.warn}
  s: {uses: test.say}
  f: {uses: test.fail_above, in: {a: c}, with: {value: -1}}
outputs: {c: c, w: w, s: s, f: f}
"""
LINE = re.compile(r"\d{4}-\d{2}-\d{2} \d{2}:\d{2}:\d{2}\.\d{3} \[(debug|info|warning|error)\] (.*)")


class Log(Case):
    def setUp(self):
        super().setUp()
        self.path = self.write("p.yaml", PIPELINE)
        self.runs = 0

    def run_with(self, *arguments):
        self.runs += 1
        out = self.scratch / ("out-%d" % self.runs)
        result = marrow("run", self.path, "--out", out, "--no-cache", *arguments, plugins=[TEST_PLUGINS])
        self.assertEqual(result.returncode, 1, result.stderr)
        lines = [LINE.fullmatch(line) for line in (out / "log.txt").read_text().splitlines()]
        self.assertNotIn(None, lines)
        return result, [line.groups() for line in lines]

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
        self.assertIn(("debug", "s: a trifle"), lines)
        self.assertIn(("info", "s: a word"), lines)
        self.assertIn(("warning", "w: mind the gap"), lines)
        errors = [text for level, text in lines if level == "error"]
        self.assertEqual(len(errors), 1)
        self.assertIn("node 'f'", errors[0])

    def test_as_json(self):
        result = self.run_with("--json")[0]
        events = [json.loads(line) for line in result.stdout.splitlines() if line.startswith('{"event"')]
        said = {
            (event["node"], event.get("level"), event["text"])
            for event in events
            if event["event"] in ("message", "warning")
        }
        self.assertEqual(said, {("s", "debug", "a trifle"), ("s", "info", "a word"), ("w", "warning", "mind the gap")})

    def test_an_unknown_level(self):
        result = marrow("run", self.path, "--log-level", "loud", plugins=[TEST_PLUGINS])
        self.assertEqual(result.returncode, 2)
        self.assertIn("--log-level", result.stderr)
        self.assertIn("loud", result.stderr)

    def test_colours_on_a_terminal_only(self):
        self.assertNotIn("\x1b[", self.run_with()[0].stderr)
        master, slave = pty.openpty()
        environment = dict(os.environ, MARROW_PLUGIN_PATH=str(TEST_PLUGINS), TERM="xterm")
        with subprocess.Popen(
            [str(MARROW), "run", str(self.path), "--out", str(self.scratch / "coloured"), "--no-cache"],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=slave,
        ) as process:
            os.close(slave)
            shown = b""
            while True:
                try:
                    part = os.read(master, 4096)
                except OSError:  # the other end is closed
                    break
                if not part:
                    break
                shown += part
            process.wait(timeout=300)
        os.close(master)
        self.assertRegex(shown, rb"\x1b\[33m[^\n]*mind the gap")
        self.assertNotIn("\x1b", (self.scratch / "coloured" / "log.txt").read_text())


if __name__ == "__main__":
    main()
