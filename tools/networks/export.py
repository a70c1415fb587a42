# SPDX-License-Identifier: Apache-2.0
"""Writes a network as marrow reads it: an ONNX file, and a YAML file with its card. Checks that OpenCV, by which marrow
computes it, gives PyTorch's own values."""
import hashlib

import cv2
import numpy as np
import torch
import yaml

WORST = 1e-4  # by which OpenCV's values may differ from PyTorch's
LARGEST_MB = 2


def write(network, card, folder):
    """Writes FOLDER/NAME.onnx and NAME.yaml, where NAME is card["file"]; the rest of the card is the YAML file as
    marrow reads it (docs/networks.md). The names of the heads are the layers. Returns the greatest difference of
    OpenCV's values from PyTorch's, in multiples of a layer's greatest value where that is above 1. Ends the program if
    it is above 1e-4."""
    card = dict(card)
    name = card.pop("file")
    folder.mkdir(parents=True, exist_ok=True)
    model = folder / (name + ".onnx")
    rows, columns = card["input"]["size_px"]
    channels = card["input"].get("slices", 1)
    network = network.eval()
    example = torch.zeros(1, channels, rows, columns)
    torch.onnx.export(
        network, example, str(model), opset_version=11, input_names=["image"], output_names=list(network.heads)
    )
    size_mb = model.stat().st_size / 1e6
    if size_mb > LARGEST_MB:
        raise SystemExit(
            "train: %s has %.1f MB, but a network has at most %d; use fewer maps" % (model, size_mb, LARGEST_MB)
        )
    worst = difference(network, model, (channels, rows, columns))
    if not worst <= WORST:
        raise SystemExit(
            "train: OpenCV's values of %s differ from PyTorch's by %g, more than %g" % (model, worst, WORST)
        )
    text = yaml.safe_dump(card, sort_keys=False, width=110, default_flow_style=None, allow_unicode=True)
    (folder / (name + ".yaml")).write_text(text)
    print("%s: %.2f MB, sha256 %s; OpenCV differs from PyTorch by %.1e" % (model, size_mb, digest(model), worst))
    return worst


def difference(network, model, shape):
    """The greatest difference of OpenCV's values from PyTorch's, for an image of noise and one that is smooth."""
    random = np.random.default_rng(1)
    noise = random.normal(0.5, 0.5, shape).astype(np.float32)
    smooth = np.stack([cv2.GaussianBlur(plane, (0, 0), 8) * 6 for plane in noise])
    net = cv2.dnn.readNetFromONNX(str(model))
    worst = 0
    for image in (noise, smooth):
        with torch.no_grad():
            expected = [values.numpy() for values in network(torch.from_numpy(image[None]))]
        net.setInput(image[None])
        for name, values in zip(network.heads, expected):
            off = np.abs(net.forward(name) - values).max() / max(1, np.abs(values).max())
            worst = max(worst, float(off))
    return worst


def digest(model):
    return hashlib.sha256(model.read_bytes()).hexdigest()[:16]
