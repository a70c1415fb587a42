# SPDX-License-Identifier: Apache-2.0
"""The pipelines that make a picture for each node of a kind: which nodes have one, and what is said where none is."""
import struct
import subprocess
import sys

from harness import MARROW, SOURCE
from harness.program import Case, main

sys.path.insert(0, str(SOURCE / "tools" / "site"))
import catalogue  # noqa: E402
import pictures  # noqa: E402


class Pictures(Case):
    @classmethod
    def setUpClass(cls):
        cls.catalogue = catalogue.Catalogue(MARROW)

    def test_the_kinds_that_have_pictures(self):
        nodes = {}
        for file in pictures.files(SOURCE):
            self.assertEqual(subprocess.run([MARROW, "check", file], capture_output=True).returncode, 0, str(file))
            names, legend = pictures.nodes_that_fit(MARROW, file, self.catalogue)
            self.assertTrue(legend.endswith("."), str(file))
            for name in names:
                self.assertEqual(name.split(".")[0], pictures.kind_of(file))
                nodes[name] = file
        print("%d nodes have a picture" % len(nodes))
        for kind in ("edges", "shaft", "project"):
            for node in self.catalogue.nodes_of(kind):
                # One needs several bones, the other a network.
                if node["name"] not in ("project.together", "edges.network"):
                    self.assertIn(node["name"], nodes)
        self.assertIn("similarity.ray_to_surface", nodes)
        self.assertNotIn("simulate.ct", nodes)
        self.assertNotIn("read.volume", nodes)

    def test_a_picture_is_made(self):
        file = SOURCE / "docs" / "pictures" / "simulate-board.yaml"
        path, why = pictures.make_one(MARROW, self.scratch, file, "simulate.bead_board", "")
        self.assertIsNone(why)
        self.assertEqual(path, self.scratch / "simulate.bead_board.png")
        data = path.read_bytes()
        self.assertEqual((data[:4], struct.unpack(">II", data[16:24])), (b"\x89PNG", (512, 512)))
        self.assertFalse(pictures.is_wide(path))

    def test_a_node_that_fails_has_none_and_the_reason_is_kept(self):
        file = SOURCE / "docs" / "pictures" / "edges.yaml"
        path, why = pictures.make_one(MARROW, self.scratch, file, "edges.canny", "/nowhere")
        self.assertIsNone(path)
        self.assertIn("node 'case' (read.case) failed: /nowhere: expected the folder of a case", why)


if __name__ == "__main__":
    main()
