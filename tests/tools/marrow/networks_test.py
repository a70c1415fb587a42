# SPDX-License-Identifier: Apache-2.0
"""Networks as nodes, by marrow run: a model exported by PyTorch gives PyTorch's values, both of its files count in the
node's key, and a model that is damaged, hostile or described wrongly ends in a sentence of that node."""
import copy
import random
import re
import shutil
import subprocess

import numpy
import yaml
from PIL import Image

from harness import formats, onnx
from harness.program import Case, main

PIPELINE = """marrow: 1
nodes:
  seen: {uses: camera.pinhole, with: {width_px: 96, height_px: 80}}
  image: {uses: read.view, in: {camera: seen}, with: {image: image.mha}}
  masked: {uses: mask.network, in: {view: image}, with: {network: net.yaml, leave_out: [metal], margin_px: 0}}
outputs: {view: masked}
"""
CARD = {
    "marrow-network": 1,
    "name": "tested",
    "help": "a network of a test",
    "version": "1.0.0",
    "licence": "Apache-2.0",
    "trained": {"data": "nothing", "good_for": "tests", "not_for": "anything else"},
    "input": {
        "values": "grey_values",
        "bone": "dark",  # as in grey values, which the network then gets as they are
        "pixel_px": 1,
        "normalise": {"method": "fixed", "low": 0, "high": 1},
        "size_px": [48, 64],
        "overlap_px": 16,
    },
    "outputs": {"classes": {"layer": "maps", "names": ["bone", "metal"], "activation": "softmax"}},
}
ROWS, COLUMNS = CARD["input"]["size_px"]
TRAINS = """
import sys
import numpy, torch
from torch import nn
torch.manual_seed(3)
class Net(nn.Module):
    def __init__(self):
        super().__init__()
        self.first = nn.Sequential(nn.Conv2d(1, 6, 3, padding=1), nn.BatchNorm2d(6), nn.ReLU(), nn.MaxPool2d(2))
        self.up = nn.ConvTranspose2d(6, 4, 2, stride=2)
        self.last = nn.Conv2d(5, 2, 1)
    def forward(self, image):
        return self.last(torch.cat([image, self.up(self.first(image))], 1))
net = Net()
net(torch.randn(4, 1, 48, 64))  # the batch norm gets its statistics
net.eval()
net.last.weight.data *= 5  # so that its probabilities differ
torch.onnx.export(net, torch.zeros(1, 1, 48, 64), "net.onnx", opset_version=11, input_names=["image"],
                  output_names=["maps"])
image = torch.from_numpy(numpy.load("image.npy"))[None, None]
numpy.save("expected.npy", torch.softmax(net(image), 1)[0, 1].detach().numpy())
"""


COPIES = 300
MAY_FAIL = """  masked%d:
    uses: mask.network
    may_fail: true
    in: {view: image}
    with: {network: damaged/net%d.yaml, leave_out: [metal]}"""


def bytes_of(weights=(1.0, -1.0), bias=(0.0, 0.0), outputs=(2, ROWS, COLUMNS)):
    """A network of one convolution of 1 x 1 pixels."""
    layer, tensors = onnx.convolution("image", "maps", [[[[weight]]] for weight in weights], list(bias))
    return onnx.model([layer], tensors, {"maps": outputs}, ROWS, COLUMNS)


def changed(value, *place):
    """The description with another value, at a place such as "input", "size_px"."""
    card = copy.deepcopy(CARD)
    part = card
    for key in place[:-1]:
        part = part[key]
    part[place[-1]] = value
    return card


class Networks(Case):
    plugins = []

    def setUp(self):
        super().setUp()
        self.image = numpy.random.default_rng(1).normal(0.5, 0.3, (80, 96)).astype(numpy.float32)
        self.write_image(self.image)
        self.write("pipeline.yaml", PIPELINE)
        self.put(bytes_of())

    def write_image(self, values):
        grid = formats.straight((values.shape[1], values.shape[0], 1))
        self.write("image.mha", formats.mha(grid, values.ravel(), "MET_FLOAT"))

    def put(self, model=None, card=CARD):
        """Writes the two files; without a model only the description."""
        if model is not None:
            self.write("net.onnx", model)
        self.write("net.yaml", yaml.safe_dump(card))

    def run_it(self, *more, code=0):
        shutil.rmtree(self.scratch / "out", ignore_errors=True)
        return self.expect(code, "run", "pipeline.yaml", "--out", "out", *more)

    def mask(self, probability, *more):
        self.run_it("--set", "masked.probability=%.7f" % probability, *more)
        with Image.open(self.scratch / "out/outputs/view/mask.png") as picture:
            return numpy.asarray(picture) == 0

    def refused_by_node(self, model=None, card=CARD):
        """What the run says of the node."""
        self.put(model, card)
        told = self.run_it(code=1).stderr
        self.assertNotRegex(told, r"(?i)signal|core dumped|terminate called|traceback")
        self.assertIn("masked", told, "the node is named")
        return told

    def test_a_model_of_pytorch_gives_its_values(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import torch, onnx"], capture_output=True).returncode:
            self.skipTest("PyTorch is not installed (python3-torch, python3-onnx)")
        image = self.image[:ROWS, :COLUMNS]
        self.write_image(image)
        numpy.save(self.scratch / "image.npy", image)
        subprocess.run(["/usr/bin/python3", "-c", TRAINS], cwd=self.scratch, check=True, capture_output=True)
        expected = numpy.load(self.scratch / "expected.npy")
        self.put(None, changed(0, "input", "overlap_px"))
        self.assertGreater(expected.max() - expected.min(), 0.2)
        size = ["--set", "seen.width_px=%d" % COLUMNS, "--set", "seen.height_px=%d" % ROWS]
        # A mask says of each pixel whether the value is above the threshold.
        for threshold in numpy.quantile(expected, [0.02, 0.2, 0.5, 0.8, 0.98]):
            above = self.mask(threshold, *size)
            sure = abs(expected - threshold) > 1e-4
            self.assertGreater(sure.mean(), 0.9)
            numpy.testing.assert_array_equal(above[sure], expected[sure] > threshold)

    def test_both_files_count_in_the_key(self):
        for model, card, is_computed, why in (
            (None, CARD, True, "never before"),
            (None, CARD, False, "as before"),
            (bytes_of(weights=(1.0, -1.0000001)), CARD, True, "a bit of the ONNX file"),
            (None, changed("1.0.1", "version"), True, "a character of the description"),
            (bytes_of(), CARD, False, "as in the first run"),
        ):
            self.put(model, card)
            self.run_it()
            masked = self.nodes()["masked"]
            self.assertEqual((masked["calls"], masked["cached"]), (1, 0) if is_computed else (0, 1), why)

    def test_the_same_bytes_at_any_number_of_threads(self):
        masks = [self.mask(0.4, "--threads", threads, "--no-cache") for threads in (1, 3)]
        numpy.testing.assert_array_equal(*masks)
        self.assertTrue(0.1 < masks[0].mean() < 0.9)

    def test_a_model_or_a_description_that_cannot_be(self):
        """tests/plugins/toolbox/network has the other faults of each."""
        told = self.refused_by_node(bytes_of(weights=(1.0, 1.0, 1.0), bias=(0, 0, 0)))
        shape = "output 'maps' has the shape 1 x 3 x 48 x 64, but net.yaml describes 1 x 2 x 48 x 64"
        self.assertIn(shape, told)
        card = changed("white", "input", "bone")
        card["input"]["size_px"] = [48, 2]
        card["outputs"]["classes"]["names"] = ["metal", "metal"]
        del card["licence"]
        told = self.refused_by_node(bytes_of(), card)
        for said in (
            "expected bright, dark; got 'white'",
            "whole numbers of rows and columns, 8 to 4096, got 2",
            "names: one occurs twice",
            "licence",
        ):
            self.assertIn(said, told)
        (self.scratch / "net.onnx").unlink()
        self.assertIn("net.onnx", self.refused_by_node())

    def test_a_model_that_declares_huge_sizes(self):
        convolution, _ = onnx.convolution("image", "maps", [[[[1.0]]], [[[1.0]]]], [0, 0])
        for side in (1 << 20, 1 << 31, (1 << 62) + 1):
            weights, bias = onnx.tensor("maps_w", [side, 1, 1, 1], [0] * 4), onnx.tensor("maps_b", [2], [0, 0])
            self.refused_by_node(onnx.model([convolution], [weights, bias], {"maps": (2, side, side)}, side, side))

    def test_damaged_models_are_refused_or_computed(self):
        """Bytes that change at random: no crash ends the run otherwise than by a sentence of the node."""
        good, draw = bytes_of(), random.Random(5)
        for i in range(COPIES):
            model = bytearray(good)
            for _ in range(draw.choice([1, 1, 2, 8])):
                model[draw.randrange(len(model))] = draw.randrange(256)
            self.write("damaged/net%d.onnx" % i, bytes(model))
            self.write("damaged/net%d.yaml" % i, yaml.safe_dump(CARD))
        nodes = "\n".join(MAY_FAIL % (i, i) for i in range(COPIES))
        outputs = ", ".join("v%d: masked%d" % (i, i) for i in range(COPIES))
        head = PIPELINE.split("  masked")[0]
        self.write("pipeline.yaml", "%s%s\noutputs: {%s}\n" % (head, nodes, outputs))
        told = self.expect(0, "run", "pipeline.yaml", "--out", "out", "--no-cache", timeout=900).stderr
        faults = re.findall(r"node '(masked\d+)' \(mask.network\) failed: (.*)", told)
        made = [i for i in range(COPIES) if (self.scratch / ("out/outputs/v%d" % i)).exists()]
        self.assertEqual(len(faults) + len(made), COPIES)
        self.assertGreater(len(faults), COPIES / 4)
        self.assertGreater(len(made), 0)
        for node, fault in faults:
            self.assertRegex(fault, r"net\d+\.(onnx|yaml): \S", "%s says which file is at fault" % node)


if __name__ == "__main__":
    main()
