# SPDX-License-Identifier: Apache-2.0
"""TIFF and BigTIFF, page by page."""
import struct
import zlib


def tiff(sizes, bits=16, kind=1, order="<", compression=1, circle=False, big=False, samples=1, extra=()):
    place, count, width = ("Q", "Q", 8) if big else ("I", "H", 4)
    version = struct.pack(order + "HHH", 43, 8, 0) if big else struct.pack(order + "H", 42)
    bytes_ = {"<": b"II", ">": b"MM"}[order] + version
    first = len(bytes_) + width
    bytes_ += struct.pack(order + place, first)
    for i, (columns, rows) in enumerate(sizes):
        pixels = bytes((k * 29 + i) % 256 for k in range(columns * rows * samples * bits // 8))
        if compression == 32773:
            parts = [pixels[k : k + 100] for k in range(0, len(pixels), 100)]
            pixels = b"".join(bytes([len(part) - 1]) + part for part in parts)
        if compression == 8:
            pixels = zlib.compress(pixels)
        tags = [
            (256, 3, columns),
            (257, 3, rows),
            (258, 3, bits),
            (259, 3, compression),
            (273, 4, 0),
            (277, 3, samples),
        ]
        tags += [(262, 3, 2 if samples == 3 else 1), (278, 3, rows), (279, 4, len(pixels)), (339, 3, kind), *extra]
        begin = len(bytes_) + struct.calcsize(order + count) + len(tags) * (20 if big else 12) + width
        bytes_ += struct.pack(order + count, len(tags))
        for tag, type_, value in sorted(tags):
            value = begin if tag == 273 else value
            packed = struct.pack(order + {3: "H", 4: "I"}[type_], value).ljust(width, b"\0")
            bytes_ += struct.pack(order + "HH" + place, tag, type_, 1) + packed
        more = i + 1 < len(sizes)
        bytes_ += struct.pack(order + place, begin + len(pixels) if more else first if circle else 0) + pixels
    return bytes_
