# SPDX-License-Identifier: Apache-2.0
"""Cases that the tests of whole commands run on: simulated ones, and files in the formats of scanners, made without any
library."""
import json
import math
import os
import shutil
import struct
import zlib

import yaml

from harness import SHARED_CACHE, SOURCE
from harness.program import marrow

FEMUR = SOURCE / "pipelines" / "femur.yaml"
SMALL = ["--set", "ct.spacing_mm=[1.2, 1.2, 1.5]", "--set", "ct.range_mm=[0, 300]"]  # runs in 2 seconds instead of 7


def simulate(folder, *arguments, pipeline="simulate.yaml"):
    """The folder of a simulated case. The same case is made once for all tests."""
    result = marrow(
        *["run", SOURCE / "pipelines" / pipeline, "--out", folder, "--quiet", *arguments],
        extra_environment={"MARROW_CACHE": str(SHARED_CACHE)},
    )
    assert result.returncode == 0, result.stderr
    return folder / "outputs" / "case"


def copy_case(case, to, change=lambda description: None):
    """A copy whose case.yaml is changed. The other files are links: replace them, do not write into them."""
    shutil.copytree(case, to, copy_function=os.link)
    description = yaml.safe_load((case / "case.yaml").read_text())
    change(description)
    replace(to / "case.yaml", yaml.safe_dump(description, sort_keys=False).encode())
    return to


def replace(path, data):
    path.unlink(missing_ok=True)
    path.write_bytes(data)


def contents(folder):
    """Every file below a folder with its bytes."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def metrics(path):
    return {metric["name"]: metric["value"] for metric in json.loads(path.read_text())["metrics"]}


def png(width, height, grey):
    """A 16 bit grey PNG; grey(u, v) gives its values."""
    rows = b"".join(b"\0" + struct.pack(">%dH" % width, *(grey(u, v) for u in range(width))) for v in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def tiff(width, height, pages):
    """A TIFF of 16 bit grey pages, each a list of values in one strip; every page's directory stands before its
    values."""
    data = struct.pack("<2sHI", b"II", 42, 8)
    for number, page in enumerate(pages):
        values = struct.pack("<%dH" % len(page), *page)
        tags = [
            (256, 3, width),
            (257, 3, height),
            (258, 3, 16),
            (259, 3, 1),
            (262, 3, 1),
            (273, 4, 0),
            (277, 3, 1),
            (278, 3, height),
            (279, 4, len(values)),
        ]
        begin = len(data) + 2 + 12 * len(tags) + 4
        data += struct.pack("<H", len(tags))
        for tag, kind, value in tags:
            data += struct.pack("<HHII", tag, kind, 1, begin if tag == 273 else value)
        data += struct.pack("<I", begin + len(values) if number + 1 < len(pages) else 0) + values
    return data


def dicom_slice(width, height, number, values):
    """A CT slice in explicit little endian, 1 mm wide voxels, slices 1 mm apart."""

    def element(group, tag, kind, value):
        if isinstance(value, str):
            value = value.encode()
        if len(value) % 2:
            value += b"\0" if kind == b"UI" else b" "
        length = struct.pack("<2xI", len(value)) if kind in (b"OB", b"OW") else struct.pack("<H", len(value))
        return struct.pack("<HH2s", group, tag, kind) + length + value

    def short(group, tag, value):
        return element(group, tag, b"US", struct.pack("<H", value))

    ct_storage, series = "1.2.840.10008.5.1.4.1.1.2", "1.2.826.0.1.3680043.2.1143.1"
    meta = (
        element(2, 1, b"OB", b"\0\1")
        + element(2, 2, b"UI", ct_storage)
        + element(2, 3, b"UI", "%s.%d" % (series, number))
        + element(2, 16, b"UI", "1.2.840.10008.1.2.1")
        + element(2, 18, b"UI", series)
    )
    return (
        b"\0" * 128
        + b"DICM"
        + element(2, 0, b"UL", struct.pack("<I", len(meta)))
        + meta
        + element(0x8, 0x16, b"UI", ct_storage)
        + element(0x8, 0x18, b"UI", "%s.%d" % (series, number))
        + element(0x8, 0x60, b"CS", "CT")
        + element(0x18, 0x50, b"DS", "1")
        + element(0x20, 0xD, b"UI", series + ".1")
        + element(0x20, 0xE, b"UI", series + ".2")
        + element(0x20, 0x13, b"IS", str(number))
        + element(0x20, 0x32, b"DS", "0\\0\\%d" % number)
        + element(0x20, 0x37, b"DS", "1\\0\\0\\0\\1\\0")
        + short(0x28, 2, 1)
        + element(0x28, 4, b"CS", "MONOCHROME2")
        + short(0x28, 0x10, height)
        + short(0x28, 0x11, width)
        + element(0x28, 0x30, b"DS", "1\\1")
        + short(0x28, 0x100, 16)
        + short(0x28, 0x101, 16)
        + short(0x28, 0x102, 15)
        + short(0x28, 0x103, 1)
        + element(0x28, 0x1052, b"DS", "0")
        + element(0x28, 0x1053, b"DS", "1")
        + element(0x7FE0, 0x10, b"OW", struct.pack("<%dh" % len(values), *values))
    )


def mha(size, values):
    """A MetaImage of floats with 1 mm voxels."""
    header = (
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData ="
        " False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = 1 1 1\nDimSize = %d %d"
        " %d\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n" % size
    )
    return header.encode() + struct.pack("<%df" % len(values), *values)


def times(matrix, vector):
    return [sum(a * b for a, b in zip(row, vector)) for row in matrix]


def matrix_product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def transposed(matrix):
    return [list(row) for row in zip(*matrix)]


def rotation_vector_deg(r):
    """Axis times angle of a rotation by less than half a turn."""
    axis = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    sine = 0.5 * math.sqrt(sum(x * x for x in axis))
    angle = math.atan2(sine, 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1))
    return [math.degrees(0.5 * x * (angle / sine if sine > 1e-12 else 1)) for x in axis]
