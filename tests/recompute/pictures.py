# SPDX-License-Identifier: Apache-2.0
"""Grey images in PNG, without a library."""
import struct
import zlib

import numpy as np


def read_grey(path):
    """Rows of values; of a picture in colour, its first channel."""
    data, at, packed, head = path.read_bytes(), 8, b"", None
    while at < len(data):
        (length,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + length]
        at += 12 + length
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
    width, height, bits, colour = head[:4]
    assert bits in (8, 16) and colour in (0, 2) and head[6] == 0, "%s: a kind of PNG that is not read here" % path
    channels = 3 if colour == 2 else 1
    rows = unfiltered(zlib.decompress(packed), width * channels * bits // 8, height, channels * bits // 8)
    values = rows.reshape(height, -1).view(">u2" if bits == 16 else "u1").reshape(height, width, channels)
    return values[:, :, 0].astype(float)


def unfiltered(data, row_bytes, height, step):
    """Undoes the filters of PNG: each byte is a difference from the bytes to the left and above."""
    rows, above = np.frombuffer(data, "u1").reshape(height, row_bytes + 1), np.zeros(row_bytes + step, int)
    result = np.zeros((height, row_bytes), "u1")
    for number, row in enumerate(rows):
        kind, line = row[0], np.concatenate([np.zeros(step, int), row[1:].astype(int)])
        if kind == 2:
            line += above
        elif kind == 1:
            for k in range(step):
                line[k::step] = np.cumsum(line[k::step])
        elif kind > 2:
            for k in range(step, len(line)):
                line[k] = (line[k] + guess(kind, line[k - step] % 256, above[k], above[k - step])) % 256
        above = line % 256
        result[number] = above[step:]
    return result


def guess(kind, left, above, corner):
    if kind == 3:
        return (left + above) // 2
    apart = [abs(above - corner), abs(left - corner), abs(left + above - 2 * corner)]
    return (left, above, corner)[apart.index(min(apart))]
