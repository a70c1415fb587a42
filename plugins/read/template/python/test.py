# SPDX-License-Identifier: Apache-2.0
import pathlib
import tempfile
import unittest

import marrow
import numpy as np
from new_node_file import new_node

POSE = """marrow-pose: 1
target: world
source: ct
matrix: [[0, -1, 0, 0.0125], [1, 0, 0, -0.007], [0, 0, 1, 0.3], [0, 0, 0, 1]]
"""


class NewNode(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "pose.yaml"

    def test_it_reads_metres(self):
        self.file.write_text(POSE)
        pose = new_node(path=self.file, unit_mm=1000)
        np.testing.assert_allclose(pose.matrix @ [10, 20, 30, 1], [-7.5, 3, 330, 1])

    def test_it_names_a_file_that_holds_no_pose(self):
        self.file.write_text("nothing\n")
        with self.assertRaisesRegex(marrow.Error, str(self.file)):
            new_node(path=self.file)


if __name__ == "__main__":
    unittest.main()
