# SPDX-License-Identifier: Apache-2.0
"""One name of a port or an option has one type and one unit in all nodes, and the site's tables of docs/vocabulary.md
hold each name once."""
import sys

from harness import MARROW, SOURCE
from harness.program import Case, main

sys.path.insert(0, str(SOURCE / "tools" / "site"))
import catalogue  # noqa: E402
import vocabulary  # noqa: E402

# Ports that mean the same for values of several types.
OF_SEVERAL_TYPES = {
    "camera_file": {"jointtrack camera file", "xmalab camera file"},
    "other_projectors": {"outline projector", "radiograph projector"},
    "phantom": {"cluttered phantom", "phantom"},
    "points": {"landmarks", "plate points"},
    "projector": {"outline projector", "radiograph projector"},
    "reference": {"mesh", "pose", "signed field"},
    "state": {"guide state", "robot state", "track state"},
    "truth": {"edge map", "truth"},
}


class Vocabulary(Case):
    plugins = []

    @classmethod
    def setUpClass(cls):
        cls.nodes = catalogue.Catalogue(MARROW).nodes

    def test_a_port_has_one_type(self):
        types = {name: what[0] for name, what in vocabulary.shared(self.nodes, vocabulary.ports_of).items()}
        self.assertEqual({name: several for name, several in types.items() if len(several) > 1}, OF_SEVERAL_TYPES)

    def test_an_option_has_one_unit_and_one_type(self):
        for name, (types, units, _) in vocabulary.shared(self.nodes, vocabulary.options_of).items():
            self.assertEqual(len(units), 1, name)
            self.assertLessEqual(len({kind for kind in types if not kind.startswith("list of ")}), 1, name)

    def test_the_site_tells_each_name(self):
        rows = vocabulary.tables(self.nodes).splitlines()
        (row,) = [row for row in rows if row.startswith("| [`guide.target`]")]
        self.assertEqual(row, "| [`guide.target`](../nodes/guide.target.md) |  | `max_residual_px` (number, px) |")
        (row,) = [row for row in rows if row.startswith("| `stroke_mm`")]
        self.assertRegex(row, r"^\| `stroke_mm` \| number \| mm \| \w")
        for of_node in (vocabulary.ports_of, vocabulary.options_of):
            names = {one[0] for node in self.nodes.values() for one in of_node(node)}
            own = {one[0] for ones in vocabulary.own_names(self.nodes, of_node).values() for one in ones}
            self.assertEqual(own, names - set(vocabulary.shared(self.nodes, of_node)))


if __name__ == "__main__":
    main()
