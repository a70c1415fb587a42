# SPDX-License-Identifier: Apache-2.0
"""What a build of marrow can do, as its commands tell it: nodes, kinds and the command line itself."""
import json
import re
import subprocess

# A line of a help text: what is given, and after two spaces or more what it means.
LINE = re.compile(r"^  (\S.*?)(?:\s{2,}(\S.*))?$")
# So many columns are in front of the meanings. Where the first column is wider, its meaning is on the next line.
WIDTH = 30


class Command:
    """A command by its help text. Words are those after `marrow`."""

    def __init__(self, words, text):
        self.name = " ".join(words)
        lines = text.splitlines()
        usage = next(i for i, line in enumerate(lines) if line.startswith("Usage:"))
        self.summary = " ".join(lines[:usage]).strip()
        self.usage = re.sub(r"^Usage: \S+", "marrow", lines[usage])
        self.parts = {}
        self._read_parts(lines[usage + 1 :])

    def _read_parts(self, lines):
        rows = None
        for line in lines:
            if line.endswith(":") and not line.startswith(" "):
                rows = self.parts.setdefault(line[:-1], [])
            elif rows is not None and line.startswith(" " * WIDTH):
                rows[-1] = (rows[-1][0], (rows[-1][1] + " " + line.strip()).strip())
            elif rows is not None and LINE.match(line):
                given, meaning = LINE.match(line).groups()
                rows.append((given, meaning or ""))
            else:
                rows = None

    def rows(self, part):
        """(what is given, what it means) of Positionals, Options or Subcommands."""
        return self.parts.get(part, [])

    def options(self):
        """Names such as --set and -h, each with the row that it is from."""
        found = {}
        for given, meaning in self.rows("Options"):
            for name in given.split()[0].split(","):
                found[name.split("=")[0]] = (given, meaning)
        return found


class Catalogue:
    def __init__(self, marrow):
        self.marrow = str(marrow)
        self.nodes = {node["name"]: node for node in json.loads(self._told("list", "--json"))}
        self.kinds = {kind["name"]: kind for kind in json.loads(self._told("list", "--kinds", "--json"))}
        self.commands = {}
        self._read_command([])

    def _told(self, *arguments):
        result = subprocess.run([self.marrow, *arguments], capture_output=True, text=True)
        if result.returncode != 0:
            raise SystemExit(
                "%s %s ended with %d: %s" % (self.marrow, " ".join(arguments), result.returncode, result.stderr)
            )
        return result.stdout

    def _read_command(self, words):
        command = Command(words, self._told(*words, "--help"))
        if words:
            self.commands[command.name] = command
        for name, _ in command.rows("Subcommands"):
            self._read_command([*words, name])

    def nodes_of(self, kind):
        return [node for name, node in self.nodes.items() if name.split(".")[0] == kind]

    def schema(self):
        """The schema of pipelines."""
        return json.loads(self._told("schema"))
