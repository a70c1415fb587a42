# SPDX-License-Identifier: Apache-2.0
"""How the nodes are called that read files, and those that run programs: each of these copies a file of its output's
type, by a script. Inputs and options by the node's name."""
from files_of_scene import labels_of, surface_of, written
from harness.package import SCRATCH

# It lasts long enough that a limit of its time or memory is noticed.
COPY = "import shutil, sys, time\ntime.sleep(0.3)\nshutil.copy(sys.argv[1], sys.argv[2])\n"
FORMATS = {"field": "mha", "image": "png", "mesh": "ply", "metrics": "json", "volume": "mha"}


def copied(name):
    script, figures = SCRATCH / "copy.py", SCRATCH / "figures.json"
    script.write_text(COPY)
    figures.write_text('{"a": 1}')
    case = written() / "case"
    sources = {"mesh": written() / "model.ply", "metrics": figures, "image": case / "frontal.png"}
    return lambda: dict(
        command=["python3", "{files.1}", "{files.2}", "{output.%s}" % FORMATS[name]],
        version_command=["python3", "--version"],
        files=[str(script), str(sources.get(name, case / "ct.mha"))],
    )


def calls(s):
    def case(name):
        return str(written() / "case" / name)

    def at(name):
        return str(written() / name)

    size = dict(image_size_px=[96, 96])
    return {
        **{"run.program_" + name: copied(name) for name in FORMATS},
        "read.camera": lambda: dict(path=at("matrix.txt"), **size),
        "read.cameras": lambda: dict(path=at("rtk.xml"), names=["a", "b"], **size, pixel_mm=[3], mirror="upside_down"),
        "read.case": lambda: dict(path=at("case")),
        "read.image": lambda: dict(path=case("frontal.png")),
        "read.images": lambda: dict(paths=[case("frontal.png"), case("lateral.png")]),
        "read.implant": lambda: dict(holes=at("nail/holes.yaml"), surface=at("nail/surface.stl")),
        "read.labels": lambda: dict(path=labels_of(1, 2)),
        "read.landmarks": lambda: dict(path=at("landmarks.yaml")),
        "read.mesh": lambda: dict(path=at("model.ply")),
        "read.pose": lambda: dict(path=at("transform.tfm")),
        "read.seeds": lambda: dict(path=at("seeds.yaml")),
        "read.view": lambda: dict(image=case("frontal.png"), camera=at("matrix.txt")),
        "read.views": lambda: dict(
            names=["a", "b"],
            images=[case("frontal.png"), case("lateral.png")],
            cameras=[at("matrix.txt"), at("matrix.txt")],
        ),
        "read.volume": lambda: dict(path=case("ct.mha")),
        "simulate.surface": lambda: dict(outer=str(surface_of(s.coarse_mesh, "outer")), cortex_mm=[4]),
    }
