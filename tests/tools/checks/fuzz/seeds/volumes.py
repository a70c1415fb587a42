# SPDX-License-Identifier: Apache-2.0
"""Volumes of 4 x 3 x 2 samples in every format, for the target `volume`."""
import gzip
import struct
import zlib

from tiff import tiff

SIZE = (4, 3, 2)
SAMPLES = struct.pack("<24h", *[i * 37 % 1000 - 500 for i in range(24)])


def meta(data=SAMPLES, extra="", where="LOCAL", kind="MET_SHORT", packed=False):
    body = zlib.compress(data) if packed else data
    sizes = f"CompressedData = True\nCompressedDataSize = {len(body)}\n" if packed else "CompressedData = False\n"
    text = (
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
        + sizes
        + "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nCenterOfRotation = 0 0 0\nAnatomicalOrientation = RAI\n"
        f"ElementSpacing = 0.5 0.5 1\n{extra}DimSize = 4 3 2\nElementType = {kind}\nElementDataFile = {where}\n"
    )
    return text.encode() + (body if where == "LOCAL" else b"")


def nrrd(data=SAMPLES, extra="", encoding="raw", kind="short", where=""):
    body = gzip.compress(data, mtime=0) if encoding == "gzip" else data
    text = (
        f"NRRD0004\n# a comment\ntype: {kind}\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 2\n"
        "space directions: (0.5,0,0) (0,0.5,0) (0,0,1)\nkinds: domain domain domain\nendian: little\n"
        f"encoding: {encoding}\nspace origin: (0,0,0)\n{extra}" + (f"data file: {where}\n" if where else "") + "\n"
    )
    return text.encode() + (b"" if where else body)


def nifti(order="<", kind=4, bits=16, data=SAMPLES, dimensions=(3, 4, 3, 2, 1, 1, 1, 1), form=1):
    header = bytearray(352)
    struct.pack_into(order + "i", header, 0, 348)
    struct.pack_into(order + "8h", header, 40, *dimensions)
    struct.pack_into(order + "2h", header, 70, kind, bits)
    struct.pack_into(order + "8f", header, 76, 1, 0.5, 0.5, 1, 0, 0, 0, 0)
    struct.pack_into(order + "3f", header, 108, 352, 1, 0)
    header[123] = 2  # millimetres
    struct.pack_into(order + "2h", header, 252, form, form)
    struct.pack_into(order + "12f", header, 280, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 0)
    header[344:348] = b"n+1\0"
    return bytes(header) + data


def seeds():
    floats = struct.pack("<24f", *[i / 3 for i in range(24)])
    text = " ".join(str(i) for i in range(24)).encode()
    many = b"\n".join(b"# comment %d" % i for i in range(210))
    return {
        "mha": b"m" + meta(),
        "mha_packed": b"m" + meta(packed=True),
        "mha_float": b"m" + meta(floats, kind="MET_FLOAT"),
        "mha_skip": b"m" + meta(extra="HeaderSize = -1\n"),
        "mha_text": b"m" + meta(text).replace(b"BinaryData = True", b"BinaryData = False"),
        "mha_outside": b"m" + meta(where="../a.raw"),
        "mha_list": b"m" + meta(where="LIST") + b"a.raw\nb.raw\n",
        "mha_pattern": b"m" + meta(where="%03d.raw 1 2 1"),
        "mha_small_letters": b"m" + meta().replace(b"ElementDataFile", b"elementdatafile"),
        "mhd": b"d" + meta(where="a.raw"),
        "mhd_outside": b"d" + meta(where="../../a.raw"),
        "mhd_absolute": b"d" + meta(where="/dev/zero"),
        "nrrd": b"r" + nrrd(),
        "nrrd_gzip": b"r" + nrrd(encoding="gzip"),
        "nrrd_float": b"r" + nrrd(floats, kind="float"),
        "nrrd_text": b"r" + nrrd(text, encoding="ascii"),
        "nrrd_hex": b"r" + nrrd(SAMPLES.hex().encode(), encoding="hex"),
        "nrrd_skip": b"r" + nrrd(extra="byte skip: -1\nline skip: 0\n"),
        "nrrd_long_field": b"r" + nrrd(extra="content: " + "x" * 2000 + "\n"),
        "nrrd_long_kind": b"r" + nrrd(kind="short" + "t" * 2000),
        "nrrd_comments": b"r" + nrrd().replace(b"# a comment", many),
        "nrrd_key": b"r"
        + nrrd(extra='a key:=a value\nmeasurement frame: (1,0,0) (0,1,0) (0,0,1)\nspace units: "mm" "mm" "mm"\n'),
        "nhdr": b"h" + nrrd(where="a.raw"),
        "nhdr_list": b"h" + nrrd(where="LIST") + b"a.raw\n",
        "nhdr_pattern": b"h" + nrrd(where="a%d.raw 1 2 1"),
        "nii": b"n" + nifti(),
        "nii_big_endian": b"n" + nifti(">"),
        "nii_float": b"n" + nifti(kind=16, bits=32, data=floats),
        "nii_disagreeing": b"n" + nifti(kind=4, bits=8),
        "nii_4d": b"n" + nifti(dimensions=(4, 4, 3, 2, 1, 1, 1, 1)),
        "nii_no_form": b"n" + nifti(form=0),
        "nii_packed": b"z" + nifti(),
        "nii_gz": b"g" + gzip.compress(nifti(), mtime=0),
        "nii_gz_cut": b"g" + gzip.compress(nifti(), mtime=0)[:200],
        "tif": b"t" + tiff([(4, 3), (4, 3)]),
        "tif_big_endian": b"t" + tiff([(4, 3), (4, 3)], order=">"),
        "tif_float": b"t" + tiff([(4, 3), (4, 3)], bits=32, kind=3),
        "tif_packed": b"t" + tiff([(4, 3), (4, 3)], compression=32773),
        "tif_circle": b"t" + tiff([(4, 3), (4, 3)], circle=True),
        "tif_big": b"t" + tiff([(4, 3), (4, 3)], big=True),
    }
