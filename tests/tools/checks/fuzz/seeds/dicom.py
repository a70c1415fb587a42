# SPDX-License-Identifier: Apache-2.0
"""DICOM files element by element, for the target `dicom`: the way of reading, then the file."""
import struct

import codestreams

LONG = {"OB", "OW", "SQ", "UN", "UT", "OF"}
END = struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)  # of a sequence, or of compressed pixels


def element(tag, kind, value, explicit=True, order="<"):
    if isinstance(value, int):
        value = struct.pack(order + ("I" if kind == "UL" else "H"), value)
    if isinstance(value, str):
        value = value.encode()
    if len(value) % 2:
        value += b"\0" if kind == "UI" else b" "
    head = struct.pack(order + "HH", tag >> 16, tag & 0xFFFF)
    if not explicit:
        return head + struct.pack(order + "I", len(value)) + value
    if kind in LONG:
        return head + kind.encode() + b"\0\0" + struct.pack(order + "I", len(value)) + value
    return head + kind.encode() + struct.pack(order + "H", len(value)) + value


def item(content, delimited=False):
    length = 0xFFFFFFFF if delimited else len(content)
    end = struct.pack("<HHI", 0xFFFE, 0xE00D, 0) if delimited else b""
    return struct.pack("<HHI", 0xFFFE, 0xE000, length) + content + end


def of_unknown_length(tag, kind, *items):
    return struct.pack("<HH2sHI", tag >> 16, tag & 0xFFFF, kind, 0, 0xFFFFFFFF) + b"".join(items) + END


def pixels_in_parts(*parts):
    """Compressed pixels: an empty table of offsets, then the parts."""
    return of_unknown_length(0x7FE00010, b"OB", item(b""), *map(item, parts))


def dicom(elements, syntax="1.2.840.10008.1.2.1", extra=b""):
    explicit, order = syntax != "1.2.840.10008.1.2", ">" if syntax == "1.2.840.10008.1.2.2" else "<"
    meta = element(0x00020001, "OB", b"\0\1") + element(0x00020010, "UI", syntax)
    written = {tag: element(tag, *value, explicit, order) for tag, value in sorted(elements.items())}
    body = b"".join(content for tag, content in written.items() if tag < 0x7FE00000)
    pixels = b"".join(content for tag, content in written.items() if tag >= 0x7FE00000)
    return b"\0" * 128 + b"DICM" + element(0x00020000, "UL", len(meta)) + meta + body + extra + pixels


def elements(text):
    """From texts 'TAG KIND VALUE' with semicolons between them."""
    words = [one.split() for one in text.split(";")]
    return {int(tag, 16): (kind, int(value) if kind == "US" else value) for tag, kind, value in words}


def pixel_module(columns, rows, signed=0, bits=16):
    module = elements(
        f"00280002 US 1; 00280004 CS MONOCHROME2; 00280010 US {rows}; 00280011 US {columns}; 00280100 US {bits};"
        f"00280101 US {bits}; 00280102 US {bits - 1}; 00280103 US {signed}"
    )
    return {**module, 0x7FE00010: ("OW", bytes(i % 256 for i in range(columns * rows * bits // 8)))}


def fluoroscopy(**changes):
    arm = elements(
        "00080016 UI 1.2.840.10008.5.1.4.1.1.12.1; 00080060 CS XA; 00181110 DS 1000; 00181111 DS 600;"
        "00181164 DS 0.4\\0.3; 00181500 CS STATIC; 00181510 DS 0; 00181511 DS 0; 00185100 CS HFS; 00200020 CS R\\F"
    )
    return {**arm, **pixel_module(6, 4), **{int(tag, 16): value for tag, value in changes.items()}}


def slice_(position):
    place = elements(
        "00080016 UI 1.2.840.10008.5.1.4.1.1.2; 00080060 CS CT; 0008103E LO thorax; 0020000E UI 1.2.3;"
        f"00200032 DS 0\\0\\{position}; 00200037 DS 1\\0\\0\\0\\1\\0; 00280030 DS 0.5\\0.5; 00281052 DS -1024;"
        "00281053 DS 1"
    )
    return {**place, **pixel_module(4, 4, signed=1)}


def frames():
    """An enhanced file of two frames with the geometry in functional groups."""
    plane = element(0x00289110, "SQ", item(element(0x00280030, "DS", "0.5\\0.5")))
    arm = element(0x00189405, "SQ", item(element(0x00181510, "DS", "10") + element(0x00181511, "DS", "5")))
    shared = element(0x52009229, "SQ", item(plane))
    each = element(0x52009230, "SQ", item(arm) + item(arm))
    all_ = fluoroscopy(**{"00280008": ("IS", "2"), "7FE00010": ("OW", bytes(range(96)))})
    del all_[0x00181510], all_[0x00181511]
    return dicom(all_, extra=shared + each)


def enhanced_ct():
    """Two slices of a tilted gantry in one file."""
    position = lambda text: element(0x00209113, "SQ", item(element(0x00200032, "DS", text)))
    places = item(position("0\\0\\0")) + item(position("0\\1\\2"))
    all_ = {**slice_(0), 0x00280008: ("IS", "2"), 0x7FE00010: ("OW", bytes(range(64)))}
    del all_[0x00200032]
    return dicom(all_, extra=element(0x52009230, "SQ", places))


SYNTAXES = {"jpeg": "4.50", "jpeg_lossless": "4.70", "jpeg_ls": "4.80", "jpeg_2000": "4.90", "rle": "5"}
CODED = {
    "jpeg_12": ("4.51", codestreams.JPEG_EXTENDED),
    "jpeg_lossless": ("4.57", codestreams.JPEG_LOSSLESS),
    "jpeg_ls": ("4.80", codestreams.JPEG_LS),
    "jpeg_2000": ("4.90", codestreams.JPEG_2000),
    "jpeg_2000_in_boxes": ("4.90", codestreams.in_boxes(codestreams.JPEG_2000)),
}


def seeds():
    name = item(element(0x00081150, "UI", "1.2"))
    nested = item(element(0x00081150, "UI", "1.2"), True), item(of_unknown_length(0x00081140, b"SQ"), True)
    headless = {tag: value for tag, value in fluoroscopy().items() if tag != 0x7FE00010}
    palette = {"00281101": ("US", struct.pack("<3H", 4, 0, 16)), "00281201": ("OW", bytes(8))}
    files = {
        "xa": dicom(fluoroscopy()),
        "implicit": dicom(fluoroscopy(), "1.2.840.10008.1.2"),
        "big_endian": dicom(fluoroscopy(), "1.2.840.10008.1.2.2"),
        "nested": dicom(fluoroscopy(), extra=element(0x00081140, "SQ", name)),
        "private": dicom(fluoroscopy(**{"00091010": ("UN", bytes(10)), "00090010": ("LO", "maker")})),
        "signed_8": dicom({**fluoroscopy(), **pixel_module(6, 4, signed=1, bits=8)}),
        "palette": dicom(fluoroscopy(**{"00280004": ("CS", "PALETTE COLOR"), **palette})),
        "mirrored": dicom(fluoroscopy(**{"00200020": ("CS", "L\\F"), "00281041": ("SS", 0xFFFF)})),
        "scaled": dicom(fluoroscopy(**{"00281052": ("DS", "-10"), "00281053": ("DS", "0.5")})),
    }
    result = {f"{way}_{name}": way.encode() + content for name, content in files.items() for way in "ix"}
    syntaxes = {name: "1.2.840.10008.1.2." + end for name, end in {**SYNTAXES, "deflated": "1.99"}.items()}
    for name, syntax in {**syntaxes, "unknown": "1.2.3.4"}.items():
        result["i_" + name] = b"i" + dicom(headless, syntax) + pixels_in_parts(b"\xff\xd8\xff\xe0" + bytes(60))
    bits_12 = {**headless, 0x00280101: ("US", 12), 0x00280102: ("US", 11)}
    for name, (end, coded) in CODED.items():
        whole = pixels_in_parts(coded + b"\0" * (len(coded) % 2))
        result["i_whole_" + name] = b"i" + dicom(bits_12, "1.2.840.10008.1.2." + end) + whole
    table = element(0x00283002, "US", struct.pack("<3H", 4, 1, 16)) + element(0x00283006, "OW", bytes(range(8)))
    result["i_table"] = b"i" + dicom(fluoroscopy(), extra=element(0x00283000, "SQ", item(table)))
    linear = element(0x00289422, "SQ", item(table + element(0x00289474, "CS", b"TO_LINEAR ")))
    result["i_logarithms"] = b"i" + dicom(fluoroscopy(**{"00281040": ("CS", "LOG")}), extra=linear)
    result["s_frames"] = b"s" + enhanced_ct()
    delimited = of_unknown_length(0x00081140, b"SQ", *nested)
    result["i_delimited"] = b"i" + dicom(headless, extra=delimited) + element(0x7FE00010, "OW", bytes(48))
    result["f_frames"] = b"f" + frames()
    result["x_frames"] = b"x" + frames()
    result["s_slice"] = b"s" + dicom(slice_(0))
    result["s_other_place"] = b"s" + dicom({**slice_(0), 0x00200032: ("DS", "0\\0\\0")})
    return result
