# SPDX-License-Identifier: Apache-2.0
"""A tetrahedron in every format of surfaces, for the target `mesh`."""
import struct

POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def stl_bytes(name=b"a surface", count=4):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *[x for i in face for x in POINTS[i]], 0) for face in FACES)
    return name.ljust(80) + struct.pack("<I", count) + body


def stl_text():
    lines = ["solid a"]
    for face in FACES:
        lines += (
            ["facet normal 0 0 0", "outer loop"]
            + ["vertex {} {} {}".format(*POINTS[i]) for i in face]
            + ["endloop", "endfacet"]
        )
    return "\n".join(lines + ["endsolid a", ""]).encode()


def ply_header(kind, vertices="float x y z", faces="list uchar int vertex_indices", more=""):
    type_, *names = vertices.split()
    return (
        f"ply\nformat {kind} 1.0\ncomment made here\nelement vertex 4\n"
        + "".join(f"property {type_} {name}\n" for name in names)
        + f"element face 4\nproperty {faces}\n{more}end_header\n"
    ).encode()


def ply_text(more=""):
    body = [" ".join(map(str, point)) for point in POINTS] + ["3 {} {} {}".format(*face) for face in FACES]
    return ply_header("ascii", more=more) + "\n".join(body + [""]).encode()


def ply_bytes(order="<", vertices="float x y z", code="f", faces="list uchar int vertex_indices", face_code="Bi"):
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    count = len(vertices.split()) - 1
    body = b"".join(struct.pack(order + code * count, *(list(point) + [7] * (count - 3))) for point in POINTS)
    body += b"".join(struct.pack(order + face_code[0] + face_code[1] * 3, 3, *face) for face in FACES)
    return ply_header(kind, vertices, faces) + body


def seeds():
    return {
        "stl": b"s" + stl_bytes(),
        "stl_solid": b"s" + stl_bytes(b"solid"),
        "stl_text": b"s" + stl_text(),
        "stl_short": b"s" + stl_bytes(count=5),
        "ply_text": b"p" + ply_text(),
        "ply": b"p" + ply_bytes(),
        "ply_big_endian": b"p" + ply_bytes(">"),
        "ply_double": b"p" + ply_bytes(vertices="double x y z nx ny nz", code="d"),
        "ply_uint": b"p" + ply_bytes(faces="list uint uint vertex_index", face_code="II"),
        "ply_short": b"p" + ply_bytes(faces="list uchar short vertex_indices", face_code="Bh"),
        "ply_quality": b"p" + ply_bytes(vertices="float x y z quality"),
        "ply_empty_element": b"p" + ply_text(more="element empty 1000000000\n"),
        "ply_edges": b"p" + ply_text(more="element edge 1\nproperty int v1\nproperty int v2\n") + b"0 1\n",
    }
