# SPDX-License-Identifier: Apache-2.0
"""CTs, X-ray images and cases that the tests of the page "Case" choose: small ones whose content is known."""
import math
import struct
import zlib


def mha(grid, values, kind="MET_SHORT"):
    """A MetaImage. grid: {size, spacing_mm, origin_mm, direction: rows}; values: x runs fastest."""
    columns = [grid["direction"][row][column] for column in range(3) for row in range(3)]
    header = (
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        "TransformMatrix = %s\nOffset = %s\nElementSpacing = %s\nDimSize = %s\nElementType = %s\n"
        "ElementDataFile = LOCAL\n"
        % (
            " ".join(map(repr, columns)),
            " ".join(map(repr, grid["origin_mm"])),
            " ".join(map(repr, grid["spacing_mm"])),
            " ".join(map(str, grid["size"])),
            kind,
        )
    )
    return header.encode() + struct.pack("<%d%s" % (len(values), "h" if kind == "MET_SHORT" else "f"), *values)


def straight(size, spacing_mm=(1.0, 1.0, 1.0), origin_mm=(0.0, 0.0, 0.0)):
    return {
        "size": list(size),
        "spacing_mm": list(spacing_mm),
        "origin_mm": list(origin_mm),
        "direction": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    }


def turned(angles_deg):
    """A rotation about x, then y, then z, as rows."""
    (cx, cy, cz), (sx, sy, sz) = (
        [f(math.radians(a)) for a in angles_deg] for f in (math.cos, math.sin)
    )  # fmt: skip
    return [
        [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
        [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
        [-sy, sx * cy, cx * cy],
    ]


def point_of(grid, index):
    """Where a voxel's centre is, in mm."""
    return [
        grid["origin_mm"][row] + sum(grid["direction"][row][k] * index[k] * grid["spacing_mm"][k] for k in range(3))
        for row in range(3)
    ]


def ball(index, centre, radius):
    return sum((a - b) ** 2 for a, b in zip(index, centre)) <= radius**2


def two_balls(size, first, second, radius):
    """Air with two balls of bone, given by indices."""
    return [
        900 if ball((x, y, z), first, radius) or ball((x, y, z), second, radius) else -1000
        for z in range(size[2])
        for y in range(size[1])
        for x in range(size[0])
    ]


def dicom_series(folder, size, values, patient="A^PATIENT", spacing_mm=1, series="7", origin_mm=(0, 0, 0)):
    """A CT series in explicit little endian; `spacing_mm` is one number or three. Values: a list, or an array of numpy
    in 16 bits."""
    spacing_mm = spacing_mm if hasattr(spacing_mm, "__len__") else (spacing_mm,) * 3

    def element(group, tag, kind, value):
        if isinstance(value, str):
            value = value.encode()
        if len(value) % 2:
            value += b"\0" if kind == b"UI" else b" "
        length = struct.pack("<2xI", len(value)) if kind in (b"OB", b"OW") else struct.pack("<H", len(value))
        return struct.pack("<HH2s", group, tag, kind) + length + value

    def short(tag, value):
        return element(0x28, tag, b"US", struct.pack("<H", value))

    storage, series = "1.2.840.10008.5.1.4.1.1.2", "1.2.826.0.1.3680043.2.1143." + series
    folder.mkdir(parents=True, exist_ok=True)
    plane = size[0] * size[1]
    for number in range(size[2]):
        name = "%s.%d" % (series, number)
        meta = (
            element(2, 1, b"OB", b"\0\1")
            + element(2, 2, b"UI", storage)
            + element(2, 3, b"UI", name)
            + element(2, 16, b"UI", "1.2.840.10008.1.2.1")
            + element(2, 18, b"UI", series)
        )
        part = values[number * plane : (number + 1) * plane]
        (folder / ("slice%s-%03d.dcm" % (series, number))).write_bytes(
            b"\0" * 128
            + b"DICM"
            + element(2, 0, b"UL", struct.pack("<I", len(meta)))
            + meta
            + element(0x8, 0x16, b"UI", storage)
            + element(0x8, 0x18, b"UI", name)
            + element(0x8, 0x60, b"CS", "CT")
            + element(0x10, 0x10, b"PN", patient)
            + element(0x20, 0xD, b"UI", series + ".1")
            + element(0x20, 0xE, b"UI", series + ".2")
            + element(0x20, 0x13, b"IS", str(number))
            + element(0x20, 0x32, b"DS", "%.9g\\%.9g\\%.9g" % (*origin_mm[:2], origin_mm[2] + number * spacing_mm[2]))
            + element(0x20, 0x37, b"DS", "1\\0\\0\\0\\1\\0")
            + short(2, 1)
            + element(0x28, 4, b"CS", "MONOCHROME2")
            + short(0x10, size[1])
            + short(0x11, size[0])
            + element(0x28, 0x30, b"DS", "%g\\%g" % (spacing_mm[1], spacing_mm[0]))
            + short(0x100, 16)
            + short(0x101, 16)
            + short(0x102, 15)
            + short(0x103, 1)
            + element(0x28, 0x1052, b"DS", "0")
            + element(0x28, 0x1053, b"DS", "1")
            + element(
                0x7FE0, 0x10, b"OW", part.tobytes() if hasattr(part, "tobytes") else struct.pack("<%dh" % plane, *part)
            )
        )


def png(width, height, grey=128):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = (b"\0" + bytes([grey]) * width) * height
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 0, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )


CAMERA = {
    "width_px": 64,
    "height_px": 64,
    "c_arm": {
        "alpha_deg": 0,
        "beta_deg": 0,
        "source_to_detector_mm": 1000,
        "source_to_isocentre_mm": 600,
        "pixel_mm": 1,
    },
}
