# SPDX-License-Identifier: Apache-2.0
"""Sequences, for the target `sequence`: the range of frames, then the format, then the file."""
import struct

import dicom
from tiff import tiff


def chunk(name, data):
    return name + struct.pack("<I", len(data)) + data + bytes(len(data) % 2)


def rows(kind, *parts):
    return chunk(b"LIST", kind + b"".join(parts))


def avi(frames=3, width=8, height=6):
    """An uncompressed video with 24 bits a pixel."""
    size = 3 * width * height
    main = struct.pack("<14I", 100000, 0, 0, 0x10, frames, 0, 1, size, width, height, 0, 0, 0, 0)
    stream = b"vidsDIB " + struct.pack(
        "<IHHIIIIIIIIHHHH", 0, 0, 0, 0, 1, 10, 0, frames, size, 0, size, 0, 0, width, height
    )
    picture = struct.pack("<IiiHHIIiiII", 40, width, height, 1, 24, 0, size, 0, 0, 0, 0)
    pictures = [chunk(b"00db", bytes((k * 7 + i * 50) % 256 for k in range(size))) for i in range(frames)]
    header = rows(b"hdrl", chunk(b"avih", main), rows(b"strl", chunk(b"strh", stream), chunk(b"strf", picture)))
    return chunk(b"RIFF", b"AVI " + header + rows(b"movi", *pictures))


def tra():
    pose = "1,0,0,%d,0,1,0,-4.5,0,0,1,1e2,0,0,0,1"
    return "\n".join([pose % 1, ",".join(["NaN"] * 16), pose % 2]).encode() + b"\n"


def seeds():
    pages, video = tiff([(6, 5), (6, 5), (6, 5)]), avi()
    xray = dicom.seeds()["x_frames"][1:]
    result = {"tra": b"1t" + tra(), "tra_second": b"2t" + tra() + tra()}
    for number in "12":
        for letter, name, content in (("p", "pages", pages), ("d", "dicom", xray), ("v", "video", video)):
            result[name + "_" + number] = number.encode() + letter.encode() + content
    result["pages_unlike"] = b"1p" + tiff([(6, 5), (4, 5)])
    result["video_cut"] = b"1v" + video[:-100]
    return result
