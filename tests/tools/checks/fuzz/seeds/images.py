# SPDX-License-Identifier: Apache-2.0
"""Images, for the target `image`: the frame, then the format, then the file."""
import struct
import zlib

from tiff import tiff


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(bits=8, colour=0, width=6, height=5, interlaced=0, extra=b""):
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    row = (width * bits * channels + 7) // 8
    data = b"".join(
        bytes([y % 5 if not interlaced else 0]) + bytes((x * 31 + y * 17) % 256 for x in range(row))
        for y in range(height * (3 if interlaced else 1))
    )
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, interlaced))
        + extra
        + chunk(b"IDAT", zlib.compress(data))
        + chunk(b"IEND", b"")
    )


# 16 x 8 grey pixels.
JPEG = bytes.fromhex(
    "ffd8ffe000104a46494600010100000100010000ffdb00430001010101010101010101010101010101010101010101010101010101010101"
    "010101010101010101010101010101010101010101010101010101010101010101ffc0000b080008001001011100ffc40015000101000000"
    "00000000000000000000000a0bffc40014100100000000000000000000000000000000ffda0008010100003f0031ea583fffd9"
)


def bmp(bits, colours=0, height=3, method=0):
    width, palette = 5, b"".join(bytes([i % 256] * 3 + [0]) for i in range(colours))
    rows = bytes(i % max(1, colours) for i in range((width * bits + 31) // 32 * 4 * abs(height)))
    masks = struct.pack("<III", 0xFF0000, 0xFF00, 0xFF) if method == 3 else b""
    start = 54 + len(palette) + len(masks)
    return (
        struct.pack("<2sIII", b"BM", start + len(rows), 0, start)
        + struct.pack("<IiiHHIIIIII", 40, width, height, 1, bits, method, len(rows), 0, 0, colours, 0)
        + masks
        + palette
        + rows
    )


def seeds():
    palette = chunk(b"PLTE", bytes(range(48)))
    files = {
        "png": png(),
        "png_16": png(16),
        "png_1": png(1),
        "png_4": png(4),
        "png_colour": png(8, 2),
        "png_palette": png(4, 3, extra=palette),
        "png_alpha": png(8, 4),
        "png_interlaced": png(8, interlaced=1),
        "png_text": png(extra=chunk(b"tEXt", b"Title\0a") + chunk(b"gAMA", struct.pack(">I", 45455))),
        "png_transparent": png(8, 3, extra=chunk(b"PLTE", bytes(range(256)) * 3) + chunk(b"tRNS", bytes(range(16)))),
    }
    result = {name: b"1c" + content for name, content in files.items()}
    result["png_as_it_is"] = b"1p" + png()
    tiffs = {
        "tif": tiff([(6, 5)]),
        "tif_8": tiff([(6, 5)], bits=8),
        "tif_float": tiff([(6, 5)], bits=32, kind=3),
        "tif_signed": tiff([(6, 5)], kind=2),
        "tif_big_endian": tiff([(6, 5)], order=">"),
        "tif_packed": tiff([(6, 5)], compression=32773),
        "tif_deflate": tiff([(6, 5)], compression=8),
        "tif_big": tiff([(6, 5)], big=True),
        "tif_1": tiff([(8, 5)], bits=1),
        "tif_colour": tiff([(4, 3)], bits=8, samples=3),
        "tif_spacing": tiff([(6, 5)], extra=[(296, 3, 3)]),
    }
    result.update({name: b"1t" + content for name, content in tiffs.items()})
    result["jpeg"] = b"1j" + JPEG
    result["jpeg_turned"] = b"1j" + JPEG[:2] + b"\xff\xe1\0\x22Exif\0\0II*\0\x08\0\0\0\1\0" + bytes(18) + JPEG[2:]
    bmps = {"1": bmp(1, 2), "4": bmp(4, 16), "8": bmp(8, 256), "24": bmp(24), "32": bmp(32, height=-3)}
    result.update({"bmp_" + name: b"1b" + content for name, content in bmps.items()})
    result["bmp_masks"] = b"1b" + bmp(32, method=3)
    result["tif_pages"] = b"2t" + tiff([(6, 5), (6, 5), (6, 5)])
    result["tif_circle"] = b"2t" + tiff([(6, 5), (6, 5)], circle=True)
    return result
