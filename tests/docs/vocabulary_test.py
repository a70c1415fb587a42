# SPDX-License-Identifier: Apache-2.0
"""docs/vocabulary.md holds the names of all ports and options that several nodes have, with the types and units that
they have, and no other names."""
import collections
import sys

from harness import MARROW, SOURCE
from harness.program import Case, main

sys.path.insert(0, str(SOURCE / "tools" / "site"))
import catalogue  # noqa: E402
import own_names  # noqa: E402


class Table:
    """The rows of docs/vocabulary.md. Each name has the set of what it is: (type,) or (type, unit)."""

    def __init__(self):
        self.ports, self.options, self.twice = {}, {}, []
        of_ports = False
        for line in (SOURCE / "docs" / "vocabulary.md").read_text().splitlines():
            of_ports = line == "## Ports" or of_ports and not line.startswith("## ")
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            if not line.startswith("| `"):
                continue
            name = cells[0].strip("`")
            if of_ports:
                self._add(self.ports, name, {(one,) for one in cells[1].split(", ")})
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

    def shared(self, of_node):
        """What each name is that several nodes have."""
        has, users = collections.defaultdict(set), collections.defaultdict(set)
        for name, node in self.nodes.items():
            for one, *what in of_node(node):
                has[one].add(tuple(what))
                users[one].add(name)
        return {one: what for one, what in has.items() if len(users[one]) > 1}

    def test_the_table_holds_each_port(self):
        self.assertEqual(self.shared(own_names.ports_of), self.table.ports)

    def test_the_table_holds_each_option(self):
        self.assertEqual(self.shared(own_names.options_of), self.table.options)

    def test_an_option_has_one_unit_and_one_type(self):
        self.assertEqual(self.table.twice, [])
        for name, what in self.table.options.items():
            self.assertEqual(len({unit for _, unit in what}), 1, name)
            self.assertLessEqual(len({kind for kind, _ in what if not kind.startswith("list of ")}), 1, name)

    def test_the_site_tells_the_names_of_one_node(self):
        rows = own_names.own_names_part(self.nodes).splitlines()
        (row,) = [row for row in rows if row.startswith("| [`guide.target`]")]
        self.assertEqual(row, "| [`guide.target`](../nodes/guide.target.md) |  | `max_residual_px` (number, px) |")
        for of_node, shared in ((own_names.ports_of, self.table.ports), (own_names.options_of, self.table.options)):
            names = {one[0] for node in self.nodes.values() for one in of_node(node)}
            own = [one[0] for ones in own_names.own_names(self.nodes, of_node).values() for one in ones]
            self.assertEqual(set(own), names - set(shared))


if __name__ == "__main__":
    main()
