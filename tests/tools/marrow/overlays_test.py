# SPDX-License-Identifier: Apache-2.0
"""What a picture of a shipped pipeline calls "before" is the start of the search whose result it calls "after"."""
import unittest

from harness.program import main
from harness.shipped import nodes_of, shipped

# The inputs by which poses go from one node to the next.
WAYS = ("starts", "initial", "pose", "poses", "stages", "start", "first", "second", "third", "fourth")


def node_of(reference):
    return reference.split(".")[0] if isinstance(reference, str) else None


def before(nodes, name):
    """The nodes from which the poses of a node come."""
    found, waiting = set(), [name]
    while waiting:
        wires = nodes.get(waiting.pop(), {}).get("in", {})
        waiting += [node_of(wires[way]) for way in WAYS if way in wires and node_of(wires[way]) not in found]
        found.update(waiting)
    return found


class Overlays(unittest.TestCase):
    def test_the_start_leads_to_the_result(self):
        compared = 0
        for file in shipped():
            nodes = nodes_of(file)
            for name, node in nodes.items():
                wires = node.get("in", {})
                if not node.get("uses", "").startswith("render.") or "start" not in wires:
                    continue
                compared += 1
                with self.subTest("%s: %s" % (file.name, name)):
                    self.assertIn(node_of(wires["start"]), before(nodes, node_of(wires["pose"])))
        self.assertGreater(compared, 10)


if __name__ == "__main__":
    main()
