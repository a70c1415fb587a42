# SPDX-License-Identifier: Apache-2.0
"""A small U-Net with heads (Ronneberger et al., MICCAI 2015), of layers that OpenCV 4.6 reads from an ONNX file:
convolutions with batch norm, maxima of 2 x 2 pixels, and transposed convolutions of 2 x 2 pixels."""
import dataclasses

import torch
from torch import nn
from torch.nn import functional


@dataclasses.dataclass(frozen=True)
class Head:
    """One output: so many maps, each pixel as large as stride pixels of the input (a power of 2)."""

    channels: int
    stride: int = 1


def double(before, after):
    """Two convolutions of 3 x 3 pixels."""
    layers = []
    for inside in (before, after):
        layers += [nn.Conv2d(inside, after, 3, padding=1, bias=False), nn.BatchNorm2d(after), nn.ReLU(inplace=True)]
    return nn.Sequential(*layers)


class UNet(nn.Module):
    """Takes (batch, channels, rows, columns); rows and columns are multiples of 2 ** (len(widths) - 1). Gives a tuple
    with one tensor for each head, in their order, before any sigmoid or softmax. Values of the input are cut to
    `limits`, so that what is far beyond the scale of an image, such as a collimator's blades, cannot dominate."""

    def __init__(self, channels, heads, widths=(8, 16, 32, 48, 64), limits=(-1, 5)):
        super().__init__()
        self.limits = limits
        self.heads = dict(heads)
        self.widths = tuple(widths)
        self.down = nn.ModuleList(double(a, b) for a, b in zip((channels, *widths[:-1]), widths))
        self.smaller = nn.MaxPool2d(2)
        self.larger = nn.ModuleList(nn.ConvTranspose2d(a, b, 2, stride=2) for a, b in zip(widths[1:], widths[:-1]))
        self.up = nn.ModuleList(double(2 * width, width) for width in widths[:-1])
        levels = {name: head.stride.bit_length() - 1 for name, head in self.heads.items()}
        for name, head in self.heads.items():
            if head.stride != 2 ** levels[name] or levels[name] >= len(widths):
                raise ValueError("head %s: the stride must be 1, 2, 4 ... %d" % (name, 2 ** (len(widths) - 1)))
        self.finest = min(levels.values())
        self.out = nn.ModuleDict(
            {name: nn.Conv2d(widths[levels[name]], head.channels, 1) for name, head in self.heads.items()}
        )
        self.levels = levels

    def forward(self, image):
        low, high = self.limits
        image = functional.relu(image - low) - functional.relu(image - high)  # OpenCV 4.6 does not read Clip
        kept = []
        for level, block in enumerate(self.down):
            image = block(image if level == 0 else self.smaller(image))
            kept.append(image)
        at = {len(self.widths) - 1: image}
        for level in reversed(range(self.finest, len(self.widths) - 1)):
            image = self.up[level](torch.cat([kept[level], self.larger[level](image)], 1))
            at[level] = image
        return tuple(self.out[name](at[level]) for name, level in self.levels.items())


def size_mb(network):
    """Size of the weights as 32-bit floats."""
    return 4e-6 * sum(weight.numel() for weight in network.parameters())
