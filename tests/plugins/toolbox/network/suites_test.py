# SPDX-License-Identifier: Apache-2.0
"""Nodes with networks pass the suite of their kind, by networks that are written by hand."""
import pathlib
import subprocess
import tempfile
import unittest

from harness import MARROW, onnx

DESCRIPTION = """marrow-network: 1
name: written
help: a network of one convolution
version: 1.0.0
licence: Apache-2.0
trained: {data: nothing, good_for: tests, not_for: anything else}
input:
  values: line_integrals
  bone: bright
  pixel_px: 1
  normalise: {method: fixed, low: 0, high: 1}
  size_px: [64, 64]
  overlap_px: 16
outputs:
  %s
"""


def write(folder, weights, biases, outputs):
    """A network whose channels are weight * image + bias. Returns the description's file."""
    layer, tensors = onnx.convolution("image", "maps", [[[[weight]]] for weight in weights], biases)
    (folder / "written.onnx").write_bytes(onnx.model([layer], tensors, {"maps": (len(biases), 64, 64)}, 64, 64))
    (folder / "written.yaml").write_text(DESCRIPTION % outputs)
    return folder / "written.yaml"


def conformance(*words):
    return subprocess.run([MARROW, "conformance", *map(str, words)], stdout=subprocess.PIPE, text=True)


class Suites(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="marrow-networks-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def test_edges(self):
        file = write(self.folder, [0.0], [1.0], "edge_strength: {layer: maps, activation: none}")
        checked = conformance("edges.network", "--set", "network=%s" % file, "--set", "threshold=4")
        self.assertEqual(checked.returncode, 0, checked.stdout)
        self.assertNotIn("n/a", checked.stdout)

    def test_mask(self):
        # Metal where the line integral is above 2.1, which no bone of the suite reaches.
        classes = "classes: {layer: maps, names: [other, metal], activation: softmax}"
        file = write(self.folder, [0.0, 50.0], [0.0, -105.0], classes)
        checked = conformance("mask.network", "--set", "network=%s" % file, "--set", "leave_out=[metal]")
        self.assertEqual(checked.returncode, 0, checked.stdout)
        self.assertNotIn("n/a", checked.stdout)

    def test_a_network_that_sees_nothing_fails(self):
        file = write(self.folder, [0.0], [0.0], "edge_strength: {layer: maps, activation: none}")
        checked = conformance("edges.network", "--set", "network=%s" % file, "--check", "disc_missed")
        self.assertEqual(checked.returncode, 1, checked.stdout)
        self.assertIn("FAIL disc_missed                100 %, limit 3", checked.stdout)

    def test_what_is_not_given(self):
        checked = conformance("edges.network")
        self.assertEqual(checked.returncode, 1)
        self.assertIn(
            "n/a  contract                   does not apply: it needs the option 'network'; give it with "
            "--set network=...",
            checked.stdout,
        )
        self.assertIn("FAIL nothing was checked", checked.stdout)
        checked = conformance("edges", "--check", "contract")
        self.assertEqual(checked.returncode, 0, checked.stdout)
        for given, said in (
            ("netwrk=x", "there is no option 'netwrk'; did you mean 'network'?"),
            ("network", "'network' is not of the form option=value"),
        ):
            refused = subprocess.run(
                [MARROW, "conformance", "edges.network", "--set", given], stderr=subprocess.PIPE, text=True
            )
            self.assertEqual(refused.returncode, 2)
            self.assertIn(said, refused.stderr)
        checked = conformance("edges.network", "--set", "network=x", "--set", "sigma_px=wide", "--check", "contract")
        self.assertIn("option 'sigma_px': expected a number", checked.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
