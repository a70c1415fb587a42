# SPDX-License-Identifier: Apache-2.0
"""Files of other programs: what they hold by those programs' own readers, and what marrow makes of them. Here are
those that come with the Debian packages of pydicom, nibabel and SciPy."""
import dataclasses
import gzip
import importlib
import pathlib
import re
import subprocess
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


def scaled(data, pixels):
    """Values as the header says, in the float that marrow keeps; whole numbers without sign stay as they are."""
    slope, intercept = float(data.get("RescaleSlope", 1)), float(data.get("RescaleIntercept", 0))
    if slope == 1 and intercept == 0:
        return pixels
    return (pixels * slope + intercept).astype("f4")


def dicom_pixels(path, number=1):
    """The grey levels of one frame as pydicom decodes them. Where the lowest stored value is white, they are inverted
    in the range of the stored bits, as PS3.3 C.7.6.3.1.2 defines MONOCHROME1."""
    data = pydicom.dcmread(path, force=True)
    pixels = data.pixel_array
    if data.PhotometricInterpretation == "MONOCHROME1":
        pixels = (-1 if data.PixelRepresentation else 2**data.BitsStored - 1) - pixels.astype("i4")
    return scaled(data, pixels[number - 1] if int(data.get("NumberOfFrames", 1)) > 1 else pixels)


def decoded(path, scratch, number=1):
    """The same where pydicom lacks a decoder (JPEG-LS, JPEG with 12 bits): decoded by GDCM before."""
    try:
        return dicom_pixels(path, number)
    except Exception:
        raw = scratch / ("raw " + path.name)
        subprocess.run(["gdcmconv", "--raw", str(path), str(raw)], check=True, capture_output=True)
        return dicom_pixels(raw, number)


def of_pydicom(scratch):
    if not pydicom:
        return "python3-pydicom"
    folder = pathlib.Path(pydicom.__file__).parent / "data" / "test_files"
    samples = []
    for path in sorted(folder.glob("*.dcm")) + sorted(folder.glob("dicomdirtests/*/*/*")):
        if not path.is_file():
            continue
        has_frames = path.name.startswith("rtdose") and "1frame" not in path.name
        number = 2 if has_frames else 1
        samples.append(Sample("pydicom", path, lambda path=path, number=number: decoded(path, scratch, number)))
        samples[-1].options = {"frame": number} if has_frames else {}
        if path.parent.name.startswith("CR"):  # scaled and inverted, which rounds twice in single precision
            samples[-1].rounding = 5e-4
    for path in sorted(folder.glob("dicomdirtests/*/*")):
        if path.is_dir():
            samples.append(Sample("pydicom", path, lambda path=path: dicom_volume(path), "volume"))
    return samples


def dicom_volume(folder):
    """The slices of a folder by their places, after the standard (PS3.3 C.7.6.2.1.1), with pydicom's values."""
    slices = [pydicom.dcmread(path) for path in folder.iterdir() if path.is_file() and path.name != "DICOMDIR"]
    slices = [part for part in slices if "ImageOrientationPatient" in part and part.Modality == "CT"]
    row, column = numpy.array(slices[0].ImageOrientationPatient, float).reshape(2, 3)
    normal = numpy.cross(row, column)
    slices.sort(key=lambda part: normal @ numpy.array(part.ImagePositionPatient, float))
    places = [numpy.array(part.ImagePositionPatient, float) for part in slices]
    affine = numpy.eye(4)
    spacing = [float(x) for x in slices[0].PixelSpacing]
    affine[:3, 0], affine[:3, 1] = row * spacing[1], column * spacing[0]
    affine[:3, 2], affine[:3, 3] = (places[-1] - places[0]) / (len(places) - 1), places[0]
    return numpy.stack([scaled(part, part.pixel_array) for part in slices]), affine


def nibabel_volume(path):
    """NIfTI's world is RAS, marrow's is LPS. nibabel's values are [x, y, z]."""
    image = nibabel.load(path)
    return image.get_fdata().T.astype("f4"), numpy.diag([-1, -1, 1, 1]) @ image.affine


def of_nibabel(scratch):
    if not nibabel:
        return "python3-nibabel"
    top = pathlib.Path(nibabel.__file__).parent
    folder, dicom = top / "tests" / "data", top / "nicom" / "tests" / "data"
    samples = []
    for path in sorted(folder.iterdir()):
        if path.suffix in (".nii", ".gz", ".hdr", ".mgz", ".mnc") and not path.name.startswith("example4d+orig"):
            samples.append(Sample("nibabel", path, lambda path=path: nibabel_volume(path), "volume", rounding=1e-3))
    for path in sorted(dicom.glob("*.dcm*")):
        if path.suffix == ".gz":
            plain = scratch / path.stem
            plain.write_bytes(gzip.decompress(path.read_bytes()))
            path = plain
        if pydicom:
            number = 2 if "philips" in path.name else 1  # the only one with several frames
            samples.append(Sample("nibabel", path, lambda path=path, number=number: dicom_pixels(path, number)))
            samples[-1].options = {"frame": number} if number > 1 else {}
    return samples


def of_scipy(scratch):
    if not scipy or not PIL:
        return "python3-scipy, python3-pil"
    paths = sorted(pathlib.Path(scipy.__file__).parent.rglob("*.png"))
    # Its red, green and blue are equal.
    return [Sample("scipy", path, lambda path=path: numpy.array(PIL.open(path))[..., 0]) for path in paths]
