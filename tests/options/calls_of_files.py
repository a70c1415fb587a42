# SPDX-License-Identifier: Apache-2.0
"""How the nodes are called that read files: (inputs, options) by the node's name."""
from files_of_scene import labels_of, surface_of, written


def calls(s):
    def case(name):
        return str(written() / "case" / name)

    def at(name):
        return str(written() / name)

    size = dict(image_size_px=[96, 96])
    return {
        "read.camera": lambda: ({}, {"path": at("matrix.txt"), **size}),
        "read.cameras": lambda: (
            {},
            {"path": at("rtk.xml"), "names": ["a", "b"], **size, "pixel_mm": [3], "mirror": "upside_down"},
        ),
        "read.case": lambda: ({}, {"path": at("case")}),
        "read.image": lambda: ({}, {"path": case("frontal.png")}),
        "read.images": lambda: ({}, {"paths": [case("frontal.png"), case("lateral.png")]}),
        "read.implant": lambda: ({}, {"holes": at("nail/holes.yaml"), "surface": at("nail/surface.stl")}),
        "read.labels": lambda: ({}, {"path": labels_of(1, 2)}),
        "read.landmarks": lambda: ({}, {"path": at("landmarks.yaml")}),
        "read.mesh": lambda: ({}, {"path": at("model.ply")}),
        "read.pose": lambda: ({}, {"path": at("transform.tfm")}),
        "read.seeds": lambda: ({}, {"path": at("seeds.yaml")}),
        "read.view": lambda: ({}, {"image": case("frontal.png"), "camera": at("matrix.txt")}),
        "read.views": lambda: (
            {},
            {
                "names": ["a", "b"],
                "images": [case("frontal.png"), case("lateral.png")],
                "cameras": [at("matrix.txt"), at("matrix.txt")],
            },
        ),
        "read.volume": lambda: ({}, {"path": case("ct.mha")}),
        "simulate.surface": lambda: ({}, {"outer": str(surface_of(s.coarse_mesh, "outer")), "cortex_mm": [4]}),
    }
