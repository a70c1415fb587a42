# SPDX-License-Identifier: Apache-2.0
"""DICOM files element by element, for the target `dicom`: the way of reading, then the file."""
import struct

import codestreams

LONG = {"OB", "OW", "SQ", "UN", "UT", "OF"}


def element(tag, kind, value, explicit=True, order="<"):
    group, number = tag >> 16, tag & 0xFFFF
    if isinstance(value, int):
        value = struct.pack(order + ("I" if kind == "UL" else "H"), value)
    if isinstance(value, str):
        value = value.encode()
    if len(value) % 2:
        value += b"\0" if kind == "UI" else b" "
    head = struct.pack(order + "HH", group, number)
    if not explicit:
        return head + struct.pack(order + "I", len(value)) + value
    if kind in LONG:
        return head + kind.encode() + b"\0\0" + struct.pack(order + "I", len(value)) + value
    return head + kind.encode() + struct.pack(order + "H", len(value)) + value


def item(content, order="<", delimited=False):
    if delimited:
        return (
            struct.pack(order + "HHI", 0xFFFE, 0xE000, 0xFFFFFFFF)
            + content
            + struct.pack(order + "HHI", 0xFFFE, 0xE00D, 0)
        )
    return struct.pack(order + "HHI", 0xFFFE, 0xE000, len(content)) + content


def delimited_sequence(tag, items):
    head = struct.pack("<HH2sHI", tag >> 16, tag & 0xFFFF, b"SQ", 0, 0xFFFFFFFF)
    return head + b"".join(items) + struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)


def dicom(elements, syntax="1.2.840.10008.1.2.1", extra=b""):
    explicit, order = syntax != "1.2.840.10008.1.2", ">" if syntax == "1.2.840.10008.1.2.2" else "<"
    meta = element(0x00020001, "OB", b"\0\1") + element(0x00020010, "UI", syntax)
    body = b"".join(
        element(tag, kind, value, explicit, order)
        for tag, (kind, value) in sorted(elements.items())
        if tag < 0x7FE00000
    )
    pixels = b"".join(
        element(tag, kind, value, explicit, order) for tag, (kind, value) in elements.items() if tag >= 0x7FE00000
    )
    return b"\0" * 128 + b"DICM" + element(0x00020000, "UL", len(meta)) + meta + body + extra + pixels


def pixel_module(columns, rows, signed=0, bits=16, data=None):
    return {
        0x00280002: ("US", 1),
        0x00280004: ("CS", "MONOCHROME2"),
        0x00280010: ("US", rows),
        0x00280011: ("US", columns),
        0x00280100: ("US", bits),
        0x00280101: ("US", bits),
        0x00280102: ("US", bits - 1),
        0x00280103: ("US", signed),
        0x7FE00010: ("OW", data if data is not None else bytes(i % 256 for i in range(columns * rows * bits // 8))),
    }


def fluoroscopy(**changes):
    elements = {
        0x00080016: ("UI", "1.2.840.10008.5.1.4.1.1.12.1"),
        0x00080060: ("CS", "XA"),
        0x00181110: ("DS", "1000"),
        0x00181111: ("DS", "600"),
        0x00181164: ("DS", "0.4\\0.3"),
        0x00181500: ("CS", "STATIC"),
        0x00181510: ("DS", "0"),
        0x00181511: ("DS", "0"),
        0x00185100: ("CS", "HFS"),
        0x00200020: ("CS", "R\\F"),
    }
    elements.update(pixel_module(6, 4))
    elements.update({int(tag, 16): value for tag, value in changes.items()})
    return elements


def slice_(position):
    elements = {
        0x00080016: ("UI", "1.2.840.10008.5.1.4.1.1.2"),
        0x00080060: ("CS", "CT"),
        0x0008103E: ("LO", "thorax"),
        0x0020000E: ("UI", "1.2.3"),
        0x00200032: ("DS", f"0\\0\\{position}"),
        0x00200037: ("DS", "1\\0\\0\\0\\1\\0"),
        0x00280030: ("DS", "0.5\\0.5"),
        0x00281052: ("DS", "-1024"),
        0x00281053: ("DS", "1"),
    }
    elements.update(pixel_module(4, 4, signed=1))
    return elements


def frames():
    """An enhanced file of two frames with the geometry in functional groups."""
    plane = element(0x00289110, "SQ", item(element(0x00280030, "DS", "0.5\\0.5")))
    arm = element(0x00189405, "SQ", item(element(0x00181510, "DS", "10") + element(0x00181511, "DS", "5")))
    shared = element(0x52009229, "SQ", item(plane))
    each = element(0x52009230, "SQ", item(arm) + item(arm))
    elements = fluoroscopy()
    elements[0x00280008] = ("IS", "2")
    elements[0x7FE00010] = ("OW", bytes(range(96)))
    for tag in (0x00181510, 0x00181511):
        del elements[tag]
    return dicom(elements, extra=shared + each)


def enhanced_ct():
    """Two slices of a tilted gantry in one file."""
    places = b"".join(
        item(element(0x00209113, "SQ", item(element(0x00200032, "DS", place)))) for place in ("0\\0\\0", "0\\1\\2")
    )
    elements = slice_(0)
    del elements[0x00200032]
    elements[0x00280008] = ("IS", "2")
    elements[0x7FE00010] = ("OW", bytes(range(64)))
    return dicom(elements, extra=element(0x52009230, "SQ", places))


def seeds():
    xa, ct = dicom(fluoroscopy()), dicom(slice_(0))
    nested = delimited_sequence(
        0x00081140,
        [
            item(element(0x00081150, "UI", "1.2"), delimited=True),
            item(delimited_sequence(0x00081140, []), delimited=True),
        ],
    )
    fragments = (
        struct.pack("<HH2sHI", 0x7FE0, 0x10, b"OB", 0, 0xFFFFFFFF)
        + item(b"")
        + item(b"\xff\xd8\xff\xe0" + bytes(60))
        + struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)
    )
    headless = {tag: value for tag, value in fluoroscopy().items() if tag != 0x7FE00010}
    files = {
        "xa": xa,
        "implicit": dicom(fluoroscopy(), "1.2.840.10008.1.2"),
        "big_endian": dicom(fluoroscopy(), "1.2.840.10008.1.2.2"),
        "nested": dicom(fluoroscopy(), extra=element(0x00081140, "SQ", item(element(0x00081150, "UI", "1.2")))),
        "private": dicom(fluoroscopy(**{"00091010": ("UN", bytes(10)), "00090010": ("LO", "maker")})),
        "signed_8": dicom({**fluoroscopy(), **pixel_module(6, 4, signed=1, bits=8)}),
        "palette": dicom(
            fluoroscopy(
                **{
                    "00280004": ("CS", "PALETTE COLOR"),
                    "00281101": ("US", struct.pack("<3H", 4, 0, 16)),
                    "00281201": ("OW", bytes(8)),
                }
            )
        ),
        "mirrored": dicom(fluoroscopy(**{"00200020": ("CS", "L\\F"), "00281041": ("SS", 0xFFFF)})),
        "scaled": dicom(fluoroscopy(**{"00281052": ("DS", "-10"), "00281053": ("DS", "0.5")})),
    }
    result = {f"{way}_{name}": way.encode() + content for name, content in files.items() for way in "ix"}
    for name, syntax in {
        "jpeg": "1.2.840.10008.1.2.4.50",
        "jpeg_lossless": "1.2.840.10008.1.2.4.70",
        "jpeg_ls": "1.2.840.10008.1.2.4.80",
        "jpeg_2000": "1.2.840.10008.1.2.4.90",
        "rle": "1.2.840.10008.1.2.5",
        "deflated": "1.2.840.10008.1.2.1.99",
        "unknown": "1.2.3.4",
    }.items():
        result["i_" + name] = b"i" + dicom(headless, syntax) + fragments
    bits_12 = {**headless, 0x00280101: ("US", 12), 0x00280102: ("US", 11)}
    for name, syntax, coded in (
        ("jpeg_12", "1.2.840.10008.1.2.4.51", codestreams.JPEG_EXTENDED),
        ("jpeg_lossless", "1.2.840.10008.1.2.4.57", codestreams.JPEG_LOSSLESS),
        ("jpeg_ls", "1.2.840.10008.1.2.4.80", codestreams.JPEG_LS),
        ("jpeg_2000", "1.2.840.10008.1.2.4.90", codestreams.JPEG_2000),
        ("jpeg_2000_in_boxes", "1.2.840.10008.1.2.4.90", codestreams.in_boxes(codestreams.JPEG_2000)),
    ):
        whole = coded + b"\0" * (len(coded) % 2)
        result["i_whole_" + name] = (
            b"i"
            + dicom(bits_12, syntax)
            + struct.pack("<HH2sHI", 0x7FE0, 0x10, b"OB", 0, 0xFFFFFFFF)
            + item(b"")
            + item(whole)
            + struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)
        )
    table = element(0x00283002, "US", struct.pack("<3H", 4, 1, 16)) + element(0x00283006, "OW", bytes(range(8)))
    result["i_table"] = b"i" + dicom(fluoroscopy(), extra=element(0x00283000, "SQ", item(table)))
    linear = element(0x00289422, "SQ", item(table + element(0x00289474, "CS", b"TO_LINEAR ")))
    result["i_logarithms"] = b"i" + dicom(fluoroscopy(**{"00281040": ("CS", "LOG")}), extra=linear)
    result["s_frames"] = b"s" + enhanced_ct()
    result["i_delimited"] = b"i" + dicom(headless, extra=nested) + element(0x7FE00010, "OW", bytes(48))
    result["f_frames"] = b"f" + frames()
    result["x_frames"] = b"x" + frames()
    result["s_slice"] = b"s" + ct
    result["s_other_place"] = b"s" + dicom({**slice_(0), 0x00200032: ("DS", "0\\0\\0")})
    return result
