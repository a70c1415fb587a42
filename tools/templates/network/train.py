#!/usr/bin/python3
"""Trains a small network that says where borders of bone are, and exports it as marrow reads it. Takes a minute.

Put your own network and your own data in the place of Borders and example(). What must stay: fixed sizes, opset 11,
and the names of the layers, which @name@.yaml names, too.
"""
import pathlib

import numpy as np
import torch
from torch import nn

HERE = pathlib.Path(__file__).resolve().parent
SIDE_PX = 64  # of the images of the training
TILE_PX = (256, 256)  # rows and columns of what marrow gives the network; size_px in @name@.yaml
STEPS, BATCH = 300, 8


class Borders(nn.Module):
    """From an image (batch, 1, rows, columns) to the logit of a border in each pixel, of the same size."""

    def __init__(self, maps=12):
        super().__init__()
        layers = [nn.Conv2d(1, maps, 5, padding=2), nn.ReLU()]
        for step in (1, 2, 4):
            layers += [nn.Conv2d(maps, maps, 3, padding=step, dilation=step), nn.BatchNorm2d(maps), nn.ReLU()]
        self.layers = nn.Sequential(*layers, nn.Conv2d(maps, 1, 1))

    def forward(self, image):
        return self.layers(image)


def example(random):
    """An image and where its borders are: a band as bright as bone, which crosses uneven tissue, with noise."""
    rows, columns = np.mgrid[:SIDE_PX, :SIDE_PX]
    angle = random.uniform(0, np.pi)
    across = np.cos(angle) * (columns - SIDE_PX / 2) + np.sin(angle) * (rows - SIDE_PX / 2) + random.normal(0, 8)
    along = np.cos(angle) * (rows - SIDE_PX / 2) - np.sin(angle) * (columns - SIDE_PX / 2)
    from_border = abs(across + random.normal(0, 3e-3) * along**2) - random.uniform(
        6, 18
    )  # in pixels, negative inside
    wall = random.uniform(2, 6)  # a shaft is brightest in its wall
    bone = np.clip(-from_border, 0, wall) / wall
    slopes = random.normal(0, 0.5, 2)  # soft tissue may fall across the whole bone
    tissue = (slopes[0] * across + slopes[1] * along) / SIDE_PX
    image = random.uniform(0.1, 0.5) * bone + tissue + random.normal(0, random.uniform(0.005, 0.06), bone.shape)
    return image - image.min(), abs(from_border) < 1.5


def scaled(image):
    """As marrow scales it: 0 at the 2nd percentile, 1 at the 98th; `normalise` in @name@.yaml."""
    low, high = np.percentile(image, (2, 98))
    return (image - low) / (high - low)


def batch(random):
    images, borders = zip(*(example(random) for _ in range(BATCH)))
    return (
        torch.tensor(np.stack([scaled(one) for one in images])[:, None], dtype=torch.float32),
        torch.tensor(np.stack(borders)[:, None], dtype=torch.float32),
    )


def train(network, random):
    optimizer = torch.optim.Adam(network.parameters(), lr=3e-3)
    loss_of = nn.BCEWithLogitsLoss(pos_weight=torch.tensor(8.0))
    for step in range(STEPS):
        image, borders = batch(random)
        optimizer.zero_grad()
        loss = loss_of(network(image), borders)
        loss.backward()
        optimizer.step()
        if (step + 1) % 100 == 0:
            print("step %d of %d, loss %.3f" % (step + 1, STEPS, loss.item()), flush=True)


def export(network, file):
    """The call that matters: a tile of fixed size, opset 11 for OpenCV 4.6, and a name for each output."""
    network.eval()
    torch.onnx.export(
        network,
        torch.zeros(1, 1, *TILE_PX),
        str(file),
        opset_version=11,
        input_names=["image"],
        output_names=["borders"],
    )


def main():
    torch.manual_seed(1)
    torch.set_num_threads(1)
    network = Borders()
    train(network, np.random.default_rng(1))
    export(network, HERE / "@name@.onnx")
    print("wrote @name@.onnx; @name@.yaml beside it says what it takes and gives")


if __name__ == "__main__":
    main()
