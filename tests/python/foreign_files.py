# SPDX-License-Identifier: Apache-2.0
"""Files of other programs: what they hold by those programs' own readers, and what marrow makes of them."""
import dataclasses
import importlib
import pathlib
import re
import typing

import numpy
from harness.package import marrow


def module(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


pydicom, nibabel, tifffile, PIL, vtk, scipy = map(
    module, ("pydicom", "nibabel", "tifffile", "PIL.Image", "vtkmodules.all", "scipy")
)


@dataclasses.dataclass
class Sample:
    """A file, and a function that gives what it holds, by another program or by hand: the pixels of an image, values
    [z, y, x] and the 4 x 4 matrix from indices to LPS of a volume, the corners [triangle, corner, xyz] of a mesh."""

    group: str
    path: pathlib.Path
    right: typing.Callable
    node: str = "image"
    options: dict = dataclasses.field(default_factory=dict)
    rounding: float = 0  # largest difference that is allowed

    @property
    def name(self):
        return self.path.name + "".join(" %s=%s" % pair for pair in self.options.items())


def affine_of(volume):
    affine = numpy.eye(4)
    affine[:3, :3] = volume.direction @ numpy.diag(volume.spacing_mm)
    affine[:3, 3] = volume.origin_mm
    return affine


def right_handed(values, affine):
    """marrow reads a left-handed grid from the other end of its last axis."""
    if numpy.linalg.det(affine[:3, :3]) > 0:
        return values, affine
    turned = numpy.array(affine, float)
    turned[:3, 3] += turned[:3, 2] * (values.shape[0] - 1)
    turned[:3, 2] *= -1
    return values[::-1], turned


def difference(one, other):
    if one.shape != other.shape:
        return "shape %s, expected %s" % (one.shape, other.shape)
    return float(numpy.abs(numpy.asarray(one, float) - numpy.asarray(other, float)).max())


def compared(sample, value):
    """The largest difference from the right values, or a text where they cannot be compared."""
    if sample.node == "image":
        return difference(value.array, sample.right())
    if sample.node == "mesh":
        return difference(value.vertices_mm[value.triangles], sample.right())
    values, affine = right_handed(*sample.right())
    apart = difference(affine_of(value), affine)
    if apart > 1e-3:  # mm; headers have single precision
        return "lies elsewhere, by %g mm: %s, expected %s" % (apart, affine_of(value).tolist(), affine.tolist())
    return difference(value.array, values)


def row_of(sample, is_right_to_refuse):
    """What marrow makes of a file, and whether that is a fault. `is_right_to_refuse(sample, message)`."""
    try:
        value = getattr(marrow.read, sample.node)(path=str(sample.path), **sample.options)
    except marrow.Error as error:
        message = re.sub(r"\s+", " ", str(error).replace(str(sample.path.parent) + "/", ""))
        return "refused: " + message, not is_right_to_refuse(sample, message)
    try:
        apart = compared(sample, value)
    except Exception as error:
        return "READ, BUT NOT BY THE OTHER PROGRAM: %s" % error, True
    if isinstance(apart, str) or apart > sample.rounding:
        return "READ WITH OTHER VALUES: %s" % apart, True
    return "read and equal (largest difference %g)" % apart, False
