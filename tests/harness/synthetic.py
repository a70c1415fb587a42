# SPDX-License-Identifier: Apache-2.0
"""Made-up data of a report, the same at every call."""
import hashlib
import json
import math
import random

from harness import SOURCE, shapes
from harness.synthetic_figures import METRICS, VARIANTS, comparison_of, summary_of

AXES = [
    ("rotation about the frontal axis", "deg"),
    ("rotation about the lateral axis", "deg"),
    ("rotation about the long axis", "deg"),
    ("shift along the frontal axis", "mm"),
    ("shift along the lateral axis", "mm"),
    ("shift along the long axis", "mm"),
]
GRAPH = {
    "case": ("read.case", ""),
    "bone": ("segment.level_set", "case"),
    "model": ("mesh.marching_cubes", "bone"),
    "edges": ("edges.adaptive_relaxation", "case"),
    "shaft": ("shaft.hough_pairs", "edges case"),
    "start": ("initial.shaft_axis", "model shaft case"),
    "outline": ("project.silhouette_edges", "model case"),
    "cost": ("similarity.contour_distance", "outline case edges model"),
    "optimizer": ("optimizer.nelder_mead", ""),
    "pose": ("register.multiresolution", "cost optimizer start"),
    "errors": ("evaluate.pose_error", "pose case model"),
    "overlay": ("render.overlay", "pose start outline case edges shaft"),
    "landscape": ("render.landscape", "cost pose"),
    "scene": ("render.scene", "model pose case"),
}
REASONS = [
    "shaft: 0 pairs of borders in view 'lateral', got 1 edge, expected 2 or more: lower edges.low or widen the view",
    "start: the model's axis and the shaft's differ by more than 90 degrees",
]


def make_cell(chance, variant, case, start, far_mm, hardness):
    _, _, reach_mm, median_mm, seconds, evaluations = VARIANTS[variant]
    number = "%s-%d-%d" % ("abcdefghij"[variant], case + 1, start)
    cell = {"id": number, "variant": variant, "case": case, "start": start, "folder": "cells/" + number}
    cell.update(status="done", tries=1, success=False, initial_error=far_mm, cached_nodes=4 if start else 0)
    cell.update(values=[None] * 3, pictures=[], convergence=None, landscape=None, scene=None)
    cell["seconds"] = seconds * math.exp(chance.gauss(0, 0.15))
    cell["evaluations"] = int(evaluations * math.exp(chance.gauss(0, 0.12)))
    if chance.random() < 0.012:
        cell.update(status="failed", reason=chance.choice(REASONS), tries=2, seconds=None, evaluations=None)
        return cell
    captured = chance.random() < 1 / (1 + math.exp((far_mm - reach_mm) / 1.2))
    if captured:
        error = median_mm * hardness * math.exp(chance.gauss(0, 0.35))
    else:
        error = far_mm * chance.uniform(0.45, 1.1) + 2
    values = [error, error * chance.uniform(0.5, 0.9), error * chance.uniform(0.8, 1.9)]
    cell.update(values=values, success=error < METRICS[0]["success_below"])
    return cell


def small_motion(chance, size):
    return [chance.gauss(0, size) for _ in range(3)], [chance.gauss(0, size) for _ in range(3)]


def landscape(axis, unit, variant):
    steep = 0.02 if "long" in axis else 0.12
    cost = lambda i: min(4.0, steep * (0.5 * i - 5 - 0.1 * variant) ** 2 + 0.1 * math.sin(2 * i) ** 2)
    offsets, costs = zip(*((round(0.5 * i - 5, 2), 0.4 + 0.4 * (variant % 2) + cost(i)) for i in range(21)))
    return {"axis": axis, "unit": unit, "offsets": list(offsets), "costs": list(costs)}


def add_material(data, chance, pairs):
    """Pictures, scene, convergence and landscapes of the first cells."""
    mesh, views = shapes.bone(), [shapes.camera("frontal", "frontal"), shapes.camera("lateral", "lateral")]
    entry = shapes.mesh_entry("distal", mesh)
    data["geometries"]["distal"] = {"vertices": entry["vertices"], "triangles": entry["triangles"]}
    by_key = {(cell["variant"], cell["case"], cell["start"]): cell for cell in data["cells"]}
    for case, start in pairs:
        truth = shapes.pose([chance.uniform(-8, 8) for _ in range(3)], [chance.uniform(-8, 8) for _ in range(3)])
        begin = shapes.multiply(truth, shapes.pose(*small_motion(chance, 6)))
        greys = []
        for view in views:
            greys.append(shapes.xray(shapes.thickness(mesh, truth, view), view, "%d %d" % (case, start)))
            data["pictures"]["xray %d %d %s" % (case, start, view["name"])] = shapes.picture(256, 256, greys[-1], 1)
        for variant in range(len(data["variants"])):
            cell = by_key[variant, case, start]
            if cell["status"] == "failed":
                continue
            result = shapes.multiply(truth, shapes.pose(*small_motion(chance, 0.45 * min(8, cell["values"][0]))))
            for view, grey in zip(views, greys):
                name = "%s %s" % (cell["id"], view["name"])
                data["pictures"][name] = shapes.picture(
                    256, 256, shapes.overlay(grey, shapes.thickness(mesh, result, view), view, (255, 190, 40)), 3
                )
                data["pictures"][name + " edges"] = shapes.picture(
                    256, 256, bytearray(255 if value > 150 else value // 3 for value in grey), 1
                )
                cell["pictures"] += [
                    {"name": "overlay/distal/" + view["name"], "picture": name},
                    {"name": "edges/" + view["name"], "picture": name + " edges"},
                ]
            cell["scene"] = "scene " + cell["id"]
            data["scenes"][cell["scene"]] = {
                "meshes": [{"name": "distal", "geometry": "distal"}],
                "poses": [
                    {"mesh": 0, "name": name, "world_from_model": shapes.flat(matrix)}
                    for name, matrix in (("result", result), ("truth", truth), ("start", begin))
                ],
                "views": [dict(view, image="xray %d %d %s" % (case, start, view["name"])) for view in views],
            }
            steps = cell["evaluations"]
            cell["convergence"] = [
                [int(steps * i / 40), 0.4 + 6 * math.exp(-i / (5 + variant)) + 0.4 * (variant % 2)] for i in range(41)
            ]
            cell["landscape"] = [landscape(axis, unit, variant) for axis, unit in AXES]


def experiment(kind):
    of_run = "marrow run pipelines/femur/femur.yaml case=case-01 --seed 7"
    return {
        "name": "edge detectors on the femur",
        "file": "experiments/edges.yaml",
        "help": "Does the edge detector or the optimizer change how far a start may lie and how close the result "
        "comes?",
        "text": "marrow: 1\npipeline: ../pipelines/femur/femur.yaml\nvariants:\n  canny: {edges.uses: edges.canny}\n",
        "pipeline_text": (SOURCE / "pipelines/femur/femur.yaml").read_text(),
        "seed": 7,
        "started": "2025-01-01T10:00:00",
        "finished": "2025-01-01T10:41:12",
        "command": "marrow compare experiments/edges.yaml --seed 7" if kind == "comparison" else of_run,
        "folder": "runs/edges",
        "machine": {"cpu": "Example CPU", "cores": 2, "cpu_level": "x86-64-v3"},
        "plugins": [
            {"file": "libmarrow_edges.so", "build_id": "0123456789abcdef"},
            {"file": "libmarrow_optimizer.so", "build_id": "fedcba9876543210"},
        ],
        "starts_protocol": "Drawn about the truth: directions uniform, mTRE uniform up to 20 mm.",
        "success_rule": "mTRE below 2 mm.",
        "time_rule": "2 jobs in parallel: times are not to be compared.",
    }


def graph(variants):
    nodes, edges = [], []
    for name, (uses, inputs) in GRAPH.items():
        differs = {
            variant["name"]: ", ".join(
                value if key.endswith("uses") else "%s = %s" % (key.split(".")[1], value)
                for key, value in variant["options"].items()
                if key.split(".")[0] == name
            )
            for variant in variants
        }
        differs = {key: value for key, value in differs.items() if value}
        options = {"low": 50, "high": 75} if name == "edges" else {}
        nodes.append({"id": name, "uses": uses, "options": options, "differs": differs})
        edges += [{"from": source, "to": name, "port": source} for source in inputs.split()]
    return {"nodes": nodes, "edges": edges}


def comparison(cases=12, starts=5, variants=4, looked_at=3):
    chance = random.Random("comparison %d %d" % (cases, starts))
    data = {"marrow": "0.1.0", "format": 1, "kind": "comparison", "experiment": experiment("comparison")}
    data.update(metrics=METRICS, initial_error={"name": "start.mtre_mm", "unit": "mm"})
    data["variants"] = [
        {"name": name, "is_baseline": i == 0, "options": options}
        for i, (name, options, *_) in enumerate(VARIANTS[:variants])
    ]
    data.update(cases=["case-%02d" % (i + 1) for i in range(cases)], starts=[str(i) for i in range(starts)])
    data.update(pictures={}, geometries={}, scenes={})
    hardness = [math.exp(chance.gauss(0, 0.3)) for _ in range(cases)]
    places = [(case, start, chance.uniform(0.5, 20)) for case in range(cases) for start in range(starts)]
    data["cells"] = [
        make_cell(chance, variant, case, start, far_mm, hardness[case])
        for variant in range(variants)
        for case, start, far_mm in places
    ]
    data["summary"] = [summary_of([cell for cell in data["cells"] if cell["variant"] == i]) for i in range(variants)]
    data["comparisons"] = [
        comparison_of(data["cells"], variant, metric)
        for metric in range(len(METRICS))
        for variant in range(1, variants)
    ]
    data["graph"] = graph(data["variants"])
    add_material(data, chance, [(case, start) for case, start, _ in places[:looked_at]])
    return data


def run(with_cube=True):
    """One run: a cube of 40 mm under two cameras of unlike focal lengths, its corners marked in the X-rays."""
    data = comparison(cases=1, starts=1, variants=1, looked_at=1)
    data.update(kind="run", experiment=experiment("run"), summary=[], comparisons=[])
    if not with_cube:
        return data
    cell, mesh = data["cells"][0], shapes.cube()
    views = [
        shapes.camera("frontal", "frontal", 360, 240, (1500.0, 1420.0), (171.3, 128.6)),
        shapes.camera("lateral", "lateral", 300, 300, (1500.0, 1500.0), (149.5, 149.5)),
    ]
    matrix = shapes.pose([25, -18, 40], [4, -7, 3])
    for view in views:
        pixels = bytearray(view["width_px"] * view["height_px"])
        for vertex in mesh[0]:
            u, v, _ = shapes.project(view, shapes.apply(matrix, vertex))
            pixels[round(v) * view["width_px"] + round(u)] = 255
        view["image"] = "cube " + view["name"]
        data["pictures"][view["image"]] = shapes.picture(view["width_px"], view["height_px"], pixels, 1)
    data["scenes"][cell["scene"]] = {
        "meshes": [shapes.mesh_entry("cube", mesh)],
        "views": views,
        "poses": [{"mesh": 0, "name": "result", "world_from_model": shapes.flat(matrix)}],
    }
    return data


FIELDS = ["variant", "case", "start", "status", "success", "tries", "initial_error", "seconds", "evaluations"]
FIELDS += ["cached_nodes", "reason", "absent", "verdict", "failure_probability"]
MATERIAL = ["pictures", "convergence", "landscape", "scene", "verdicts", "poses"]


def as_table(data):
    """The same comparison with its cells as a table, as the program writes it. The cells' ids become
    VARIANT/CASE/START."""
    texts, cells = {None: None}, data.pop("cells")
    place = lambda text: texts.setdefault(text, len(texts) - 1)
    value = lambda cell, name: (
        place(cell.get(name)) if name in ("status", "reason", "absent", "verdict") else cell.get(name)
    )
    data["cell_table"] = {
        "fields": FIELDS,
        "rows": [[value(cell, name) for name in FIELDS] + cell["values"] for cell in cells],
        "texts": list(texts)[1:],
    }
    material = lambda cell: {key: cell[key] for key in MATERIAL if cell.get(key)}
    data["materials"] = [
        {"variant": cell["variant"], "case": cell["case"], "start": cell["start"], **material(cell)}
        for cell in cells
        if material(cell)
    ]
    return data


def put_beside(data, folder, places):
    """Moves what is known of these cases and starts into files of a folder; the page without them."""
    folder.mkdir()
    data["parts"] = []
    for case, start in places:
        materials = [one for one in data["materials"] if (one["case"], one["start"]) == (case, start)]
        data["materials"] = [one for one in data["materials"] if one not in materials]
        scenes = {one["scene"]: data["scenes"].pop(one["scene"]) for one in materials if "scene" in one}
        names = [entry["picture"] for one in materials for entry in one["pictures"]]
        names += {view["image"] for scene in scenes.values() for view in scene["views"]}
        pictures = {name: data["pictures"].pop(name) for name in names}
        text = json.dumps({"materials": materials, "pictures": pictures, "geometries": {}, "scenes": scenes})
        name = hashlib.sha256(text.encode()).hexdigest()[:16] + ".js"
        (folder / name).write_text('Parts.take("%s",\n%s\n);\n' % (name, text))
        kinds = ["pictures", "scene", "convergence", "landscape"]
        data["parts"].append({"case": case, "start": start, "file": name, "bytes": len(text), "kinds": kinds})
    return data
