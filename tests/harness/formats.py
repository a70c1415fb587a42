# SPDX-License-Identifier: Apache-2.0
"""Files in the formats of scanners, made without any library."""
import struct
import zlib


def png(width, height, pixels, bits=8, channels=1):
    """A grey or RGB PNG. The pixels are bytes or small numbers, row by row."""
    step = width * channels * bits // 8
    rows = b"".join(b"\0" + bytes(pixels[step * v : step * (v + 1)]) for v in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, bits, {1: 0, 3: 2}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def grey_png(width, height, grey):
    """A grey PNG of 16 bits; grey(u, v) gives its values."""
    values = [grey(u, v) for v in range(height) for u in range(width)]
    return png(width, height, struct.pack(">%dH" % len(values), *values), bits=16)


def tiff(width, height, pages):
    """A TIFF of 16 bit grey pages, each a list of values in one strip; every page's directory stands before its
    values."""
    data = struct.pack("<2sHI", b"II", 42, 8)
    for number, page in enumerate(pages):
        values = struct.pack("<%dH" % len(page), *page)
        tags = [(256, 3, width), (257, 3, height), (258, 3, 16), (259, 3, 1), (262, 3, 1), (273, 4, 0), (277, 3, 1)]
        tags += [(278, 3, height), (279, 4, len(values))]
        begin = len(data) + 2 + 12 * len(tags) + 4
        data += struct.pack("<H", len(tags))
        for tag, kind, value in tags:
            data += struct.pack("<HHII", tag, kind, 1, begin if tag == 273 else value)
        data += struct.pack("<I", begin + len(values) if number + 1 < len(pages) else 0) + values
    return data


def straight(size, spacing_mm=(1.0, 1.0, 1.0), origin_mm=(0.0, 0.0, 0.0)):
    """The grid of a CT along the axes of the world."""
    grid = {"size": list(size), "spacing_mm": list(spacing_mm), "origin_mm": list(origin_mm)}
    return {**grid, "direction": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}


def mha(grid, values, kind="MET_SHORT"):
    """A MetaImage. grid: {size, spacing_mm, origin_mm, direction: rows}; values: x runs fastest."""
    columns = [grid["direction"][row][column] for column in range(3) for row in range(3)]
    words = [" ".join(map(repr, part)) for part in (columns, grid["origin_mm"], grid["spacing_mm"])]
    words.append(" ".join(map(str, grid["size"])))
    header = (
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        "TransformMatrix = %s\nOffset = %s\nElementSpacing = %s\nDimSize = %s\nElementType = %s\n"
        "ElementDataFile = LOCAL\n" % (*words, kind)
    )
    return header.encode() + struct.pack("<%d%s" % (len(values), {"MET_SHORT": "h", "MET_FLOAT": "f"}[kind]), *values)


def element(group, number, kind, value):
    """A DICOM element in explicit little endian. The value of a US is a number, of others a text or bytes."""
    value = struct.pack("<H", value) if kind == "US" else value.encode() if isinstance(value, str) else value
    value += (b"\0" if kind == "UI" else b" ") * (len(value) % 2)
    length = struct.pack("<2xI", len(value)) if kind in ("OB", "OW") else struct.pack("<H", len(value))
    return struct.pack("<HH", group, number) + kind.encode() + length + value


def dicom(width, height, values, elements, meta=()):
    """A grey DICOM image of 16 bits from its bytes. Further elements, also of the meta header: {tag: (kind, value)}."""
    numbers = {2: 1, 0x10: height, 0x11: width, 0x100: 16, 0x101: 16, 0x102: 15, 0x103: 0}
    image = {(0x28, number): ("US", value) for number, value in numbers.items()}
    image.update({(0x28, 4): ("CS", "MONOCHROME2"), (0x7FE0, 0x10): ("OW", values)})
    elements = {**image, **elements}
    meta = {(2, 1): ("OB", b"\0\1"), (2, 16): ("UI", "1.2.840.10008.1.2.1"), **dict(meta)}
    written = lambda part: b"".join(element(*tag, *value) for tag, value in sorted(part.items()))
    length = element(2, 0, "UL", struct.pack("<I", len(written(meta))))
    return b"\0" * 128 + b"DICM" + length + written(meta) + written(elements)


def dicom_series(folder, size, values, patient="A^PATIENT", spacing_mm=1, series="7", origin_mm=(0, 0, 0)):
    """Writes a CT series; `spacing_mm` is one number or three. Values: a list, or an array of numpy in 16 bits."""
    spacing_mm = spacing_mm if hasattr(spacing_mm, "__len__") else (spacing_mm,) * 3
    storage, uid = "1.2.840.10008.5.1.4.1.1.2", "1.2.826.0.1.3680043.2.1143." + series
    folder.mkdir(parents=True, exist_ok=True)
    plane = size[0] * size[1]
    for number in range(size[2]):
        name = "%s.%d" % (uid, number)
        part = values[number * plane : (number + 1) * plane]
        elements = {
            (0x8, 0x16): ("UI", storage),
            (0x8, 0x18): ("UI", name),
            (0x8, 0x60): ("CS", "CT"),
            (0x10, 0x10): ("PN", patient),
            (0x20, 0xD): ("UI", uid + ".1"),
            (0x20, 0xE): ("UI", uid + ".2"),
            (0x20, 0x13): ("IS", str(number)),
            (0x20, 0x32): ("DS", "%.9g\\%.9g\\%.9g" % (*origin_mm[:2], origin_mm[2] + number * spacing_mm[2])),
            (0x20, 0x37): ("DS", "1\\0\\0\\0\\1\\0"),
            (0x28, 0x30): ("DS", "%g\\%g" % (spacing_mm[1], spacing_mm[0])),
            (0x28, 0x103): ("US", 1),
            (0x28, 0x1052): ("DS", "0"),
            (0x28, 0x1053): ("DS", "1"),
        }
        meta = {(2, 2): ("UI", storage), (2, 3): ("UI", name), (2, 18): ("UI", uid)}
        signed = part.tobytes() if hasattr(part, "tobytes") else struct.pack("<%dh" % plane, *part)
        path = folder / ("slice%s-%03d.dcm" % (series, number))
        path.write_bytes(dicom(size[0], size[1], signed, elements, meta))
