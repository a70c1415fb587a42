# SPDX-License-Identifier: Apache-2.0
"""Reads the values that a run folder and a case hold (docs/case.md, docs/formats.md)."""
import csv
import dataclasses
import json
import zlib

import numpy as np
import yaml
from PIL import Image

from rigid import Camera, Frame, Transform, transform_of


class Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
    """YAML 1.2, in which `off` and `no` are words."""


Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if not tag.endswith(":bool") or first in "tTfF"]
    for first, resolvers in Loader.yaml_implicit_resolvers.items()
}


def read_yaml(path):
    return yaml.load(path.read_text(), Loader)


@dataclasses.dataclass
class Pose:
    world_from_ct: Transform
    frame: Frame  # None: the file names no axes
    covariance: np.ndarray  # None: nothing is predicted
    warnings: list
    deviations: list  # as the file prints them, degrees and mm; empty if it does not


def read_pose(path):
    values = read_yaml(path)
    frame = values.get("fragment_frame")
    printed = values.get("predicted_deviation", {})
    covariance = values.get("covariance")
    return Pose(
        transform_of(values),
        frame and Frame(np.asarray(frame["origin_mm"], float), np.asarray(frame["axes"], float)),
        None if covariance is None else np.asarray(covariance, float),
        values.get("warnings", []),
        printed.get("rotation_deg", []) + printed.get("translation_mm", []),
    )


def read_truth(source):
    """Of a file, or of an entry of a case."""
    return transform_of(source if isinstance(source, dict) else read_yaml(source))


def read_camera(source):
    """Of a camera's file, of the folder of a view, or of an entry of a case."""
    path = source["camera"] if isinstance(source, dict) else source
    return Camera.of_map(read_yaml(path / "camera.yaml" if path.is_dir() else path))


def read_grey(path):
    """Rows of values; of a picture in colour, its first channel."""
    pixels = np.asarray(Image.open(path), float)
    return pixels if pixels.ndim == 2 else pixels[:, :, 0]


def read_view_image(source):
    return read_grey(source["image"] if isinstance(source, dict) else source / "image.png")


def read_landmarks(path):
    """The landmarks of the one fragment of a file, in the CT."""
    (fragment,) = read_yaml(path)["fragments"].values()
    return np.array(list(fragment["points"].values()), float)


def number(value):
    """Of JSON, where a figure that is not known is null."""
    return float("nan") if value is None else float(value)


def read_metrics(path):
    return {metric["name"]: number(metric["value"]) for metric in json.loads(path.read_text())["metrics"]}


def read_verdict(path):
    """The figures of a verdict, its probability and its judgement."""
    values = read_yaml(path)
    figures = {"judgement": values["judgement"], "failure_probability": number(values["failure_probability"])}
    return figures | {figure["name"]: number(figure["value"]) for figure in values["figures"]}


@dataclasses.dataclass
class Field:
    """A grid of signed distances, negative inside."""

    values_mm: np.ndarray  # by x, y, z
    origin_mm: np.ndarray
    direction: np.ndarray  # columns: the axes of the grid
    spacing_mm: np.ndarray

    def points_mm(self, index):
        return self.origin_mm + (index * self.spacing_mm) @ self.direction.T

    def index(self, points_mm):
        return (points_mm - self.origin_mm) @ self.direction / self.spacing_mm


def read_field(path):
    """MetaImage in one file, compressed or not."""
    data = path.read_bytes()
    head = {}
    while "ElementDataFile" not in head:
        line, data = data.split(b"\n", 1)
        key, text = line.decode().split("=", 1)
        head[key.strip()] = text.split()
    kind = {"MET_FLOAT": "<f4", "MET_DOUBLE": "<f8", "MET_SHORT": "<i2"}[head["ElementType"][0]]
    data = zlib.decompress(data) if head.get("CompressedData") == ["True"] else data
    size = [int(text) for text in head["DimSize"]]
    direction = np.array(head["TransformMatrix"], float).reshape(3, 3).T  # the file has a row for each axis of the grid
    values = np.frombuffer(data, kind).reshape(size[::-1]).transpose(2, 1, 0)
    return Field(values, np.array(head["Offset"], float), direction, np.array(head["ElementSpacing"], float))


@dataclasses.dataclass
class Way:
    """A table of frames: its columns by name, and the poses."""

    columns: dict
    poses: list

    def is_found(self):
        return [text == "1" for text in self.columns["found"]]


def read_way(path):
    rows = list(csv.DictReader(path.read_text().splitlines()))
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    places = ["m%d%d%s" % (row, column, "_mm" * (column == 4)) for row in (1, 2, 3) for column in (1, 2, 3, 4)]
    matrices = [np.array([float(row[place]) for place in places]).reshape(3, 4) for row in rows]
    return Way(columns, [Transform.of_matrix(matrix) for matrix in matrices])
