# SPDX-License-Identifier: Apache-2.0
"""docs/vocabulary.md holds the names of all ports and options, with the types and units that they have, and no other
names; and a name from before is explained where a pipeline uses it."""
import collections
import re
import sys

from harness import MARROW, SOURCE
from harness.program import Case, main

sys.path.insert(0, str(SOURCE / "tools" / "site"))
import catalogue  # noqa: E402

ONE = re.compile(r"`(\w+)` \(([^),]+)(?:, ([^)]+))?\)")  # a name with its type, and its unit if it has one


def ports_of(node):
    return [(port["name"], port["type"].replace("_", " ")) for port in node["inputs"] + node["outputs"]]


def options_of(node):
    return [(one["name"], one["type"], "" if one["unit"] == "1" else one["unit"]) for one in node["options"]]


def has(node, part, name):
    return any(one["name"] == name for one in node[part])


class Table:
    """The rows of docs/vocabulary.md. Each name has the set of what it is: (type,) or (type, unit)."""

    def __init__(self):
        self.ports, self.options, self.twice = {}, {}, []
        self.own = {}  # by the node: its own ports and options
        of_ports = False
        for line in (SOURCE / "docs" / "vocabulary.md").read_text().splitlines():
            of_ports = line == "## Ports" or of_ports and not line.startswith("## ")
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            if not line.startswith("| `"):
                continue
            name = cells[0].strip("`")
            if "." in name:
                self._add(self.own, name, [[(a, b, c) for a, b, c in ONE.findall(cell)] for cell in cells[1:]])
            elif of_ports:
                self._add(self.ports, name, set(cells[1].split(", ")))
            else:
                self._add(self.options, name, {(one, cells[2]) for one in cells[1].split(" or ")})

    def _add(self, rows, name, what):
        if name in rows:
            self.twice.append(name)
        rows[name] = what


class Vocabulary(Case):
    plugins = []

    @classmethod
    def setUpClass(cls):
        cls.nodes = catalogue.Catalogue(MARROW).nodes
        cls.table = Table()

    def check(self, of_node, shared, own):
        has = collections.defaultdict(set)
        users = collections.defaultdict(set)
        for name, node in self.nodes.items():
            for one, *what in of_node(node):
                has[one].add(what[0] if len(what) == 1 else tuple(what))
                users[one].add(name)
        self.assertEqual({one: what for one, what in has.items() if len(users[one]) > 1}, shared)
        singles = {(min(users[one]), one): what for one, what in has.items() if len(users[one]) == 1}
        self.assertEqual(singles, own)

    def test_the_table_holds_each_port(self):
        own = {(node, name): {kind} for node, (ports, _) in self.table.own.items() for name, kind, _ in ports}
        self.check(ports_of, self.table.ports, own)

    def test_the_table_holds_each_option(self):
        own = {
            (node, name): {(kind, unit)}
            for node, (_, options) in self.table.own.items()
            for name, kind, unit in options
        }
        self.check(options_of, self.table.options, own)

    def test_an_option_has_one_unit_and_one_type(self):
        self.assertEqual(self.table.twice, [])
        for name, what in self.table.options.items():
            self.assertEqual(len({unit for _, unit in what}), 1, name)
            self.assertLessEqual(len({kind for kind, _ in what if not kind.startswith("list of ")}), 1, name)

    def test_what_was_called_otherwise_is_explained(self):
        lines = [line.split() for line in (SOURCE / "plugins" / "renamed.txt").read_text().splitlines()[1:]]
        for since, of, old, now in lines:
            nodes, outputs = [], []
            for name, node in self.nodes.items():
                for part, given in (("options", ", with: {%s: 1}"), ("inputs", ", in: {%s: a0}"), ("outputs", "")):
                    if (name + ".").startswith(of + ".") and has(node, part, now) and not has(node, part, old):
                        outputs.append("x%d: a%d.%s" % (len(nodes), len(nodes), old))
                        nodes.append("  a%d: {uses: %s%s}\n" % (len(nodes), name, given and given % old))
            self.write("old.yaml", "marrow: 1\nnodes:\n%soutputs: {%s}\n" % ("".join(nodes), ", ".join(outputs)))
            said = self.marrow("check", "old.yaml").stderr
            self.assertIn("'%s' is called '%s' since %s" % (old, now, since), said)


if __name__ == "__main__":
    main()
