# SPDX-License-Identifier: Apache-2.0
"""Files of YAML and text: of a case, pipelines, experiments."""

CAMERA = """width_px: 4
height_px: 4
intrinsics: [[1000, 0, 2], [0, 1001, 2], [0, 0, 1]]
camera_from_world: {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  translation_mm: [1, 2, 900]}
"""
MATRIX = "matrix: [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]"
PLACE = "{target: world, source: ct, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [0, 0, -15]}"
VIEWS = """views:
  - {name: frontal, image: a.png, camera: a.txt}
  - name: lateral
    image: a.png
    mask: a.png
    camera:
""" + "".join(
    "      " + line + "\n" for line in CAMERA.splitlines()
)
CASE = f"""marrow-case: 1
ct: ct.mha
{VIEWS}fragments:
  proximal: {{seeds: [[-3.1, 12, 240]], register: false}}
  distal:
    seeds: [[-1, 14, 80], [0, 13.5, 120]]
    start: {PLACE}
    truth: {{target: world, source: ct, {MATRIX}}}
"""
XMALAB = (
    "image size\n640,480\n\ncamera"
    " matrix\n1000,0,320\n0,1000,240\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\ntranslation\n0\n0\n900\n"
)
CALIBRATION = """marrow-calibration: 1
width_px: 640
height_px: 480
intrinsics: [[1000, 0, 320], [0, 1001, 240], [0, 0, 1]]
radial_distortion: [0.1, -0.01, 0]
residual_px: 0.2
deviation: {focal_px: [1, 1], principal_px: [0.5, 0.5], radial_distortion: [0.01, 0.01, 0]}
"""
BOARD = """marrow-bead-board: 1
sides:
  lower:
    landmarks: {diameter_mm: 3, at_mm: [[-23, -47.5, 0], [-16.5, 51.5, 0], [23, 46.5, 0], [50, 18, 0]]}
    beads: {diameter_mm: 1.5, at_mm: [[13.5, 76.5, 0], [-21.5, 73, 0], [-56.5, 56, 0], [-76.5, 19, 0]]}
  upper:
    landmarks: {diameter_mm: 3, at_mm: [[-40, -30, 80], [10.5, 33, 80], [45, -22, 80], [2, 61, 80]]}
    beads: {diameter_mm: 1.5, at_mm: [[30, 70, 80], [-50, 20, 80], [-10, -60, 80], [66, 4, 80]]}
"""
POINTS = """marrow-points: 1
points:
  - {name: A1, at_mm: [123.444, 147.521, 103.688], seen_px: {frontal: [859.48, 1293.81], lateral: [799.97, 1338.98]}}
  - {name: A2, seen_px: {frontal: [881.83, 1320.13], lateral: [781.28, 1363.47]}}
"""
LANDMARKS = """marrow-landmarks: 1
fragments:
  distal:
    points: {medial: [1, 2, 3], lateral: [4, 5, 6], notch: [7, 8, 9]}
    seen: {frontal: {medial: [10, 20], lateral: [30, 40]}}
    tracked: {medial: [1, 2, 3], notch: [3, 2, 1]}
"""
HOLES = """marrow-implant: 1
holes:
  distal: {centre_mm: [0, 0.1, 15], axis: [1, 0, 0], diameter_mm: 5}
  oblique: {centre_mm: [0, 0.7, 40], axis: [0, 1, -2], diameter_mm: 4.5}
"""
SEEDS = (
    "marrow-seeds: 1\nfragments:\n  radius: {seeds: [[12.68, 31.3038, 18.75], [1, 2, 3]]}\n  ulna: {seeds: [[0, 0, 0]],"
    " register: false}\n"
)
POSE = f"""marrow-pose: 1
target: world
source: ct
{MATRIX}
fragment_frame: {{origin_mm: [1, 2, 3], axes: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}
covariance: [{", ".join(str([int(row == column) for column in range(6)]) for row in range(6))}]
predicted_deviation: {{rotation_deg: [1, 1, 1]}}
warnings: [mind the gap]
cost: 0.5
evaluations: 12
"""
PIPELINE = """# a comment
marrow: 1
name: sums
help: adds
inputs:
  amount: {type: number, default: 2, help: how much}
  file: {type: path, default: a.yaml}
nodes:
  one: {uses: test.constant, with: {value: $amount, count: 3, flag: true, word: two, numbers: [1, 2.5],
    point: [1, 2, 3], path: $file}}
  sides: {uses: test.sides, with: {names: [a, b, "c d"]}}
  sum: {uses: test.add, in: {a: one, b: sides.both}}
  total: {uses: test.sum, in: {items: sum}}
  literal: {uses: test.sum, in: {items: [one, sides.left, sides.both.a]}}
  adder: {uses: test.adder, in: {amount: one}}
  applied: {uses: test.apply, in: {adder: adder, to: total.sum}}
  maybe: {uses: test.add, in: {a: one, b: sides.maybe}}
outputs: {sum: total, picked: sum.sum.a, applied: applied}
"""
SMALL = "marrow: 1\nnodes:\n  one: {uses: test.constant}\noutputs:\n  one: one\n"
EXPERIMENT = """experiment: 1
name: sums
help: >
  What is compared,
  and why.
pipeline: pipeline.yaml
inputs: {amount: 3}
set: {one.count: 2}
cases: {folders: [cases/*]}
variants:
  plain: {}
  more: {one.value: 7, one.flag: true}
  other: {one.uses: test.displaced}
matrix:
  one.word: [one, two]
starts: {node: start, count: 3, rotation_deg: 10, translation_mm: 5, distance_mm: 20, seed: 4}
metrics:
  - errors.value
  - {figure: sides.a.value, label: a, better: nearest_zero}
success: {errors.value: 2}
initial_error: errors.value
baseline: plain+one
pictures: [start]
timed_cells: 1
compare_all: true
"""
SIMULATED = """experiment: 1
pipeline: pipeline.yaml
cases:
  simulate: {pipeline: simulate.yaml, seeds: 1..5, seed_input: [seed], draw: {shift: [-10, 10]}, inputs: {},
    set: {one.flag: true}}
  input: case
variants: {plain: {}}
metrics: [errors.value]
"""


def case_seeds():
    bomb = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [" + ", ".join([f"*a{i - 1}"] * 9) + "]\n" for i in range(1, 8))
    files = {
        "c_case": CASE,
        "c_ct_map": CASE.replace(
            "ct: ct.mha", "ct: {file: ct.mha, voxel_size_mm: [1, 1, 1], flip: [z], value_offset_hu: -1024}"
        ),
        "c_outside": CASE.replace("ct.mha", "../a.yaml"),
        "m_camera": "marrow-camera: 1\n" + CAMERA,
        "m_distorted": "marrow-camera: 1\nradial_distortion: [0.1, 0, 0]\n" + CAMERA,
        "m_aliases": bomb,
        "m_deep": "intrinsics: " + "[" * 2000,
        "x_xmalab": XMALAB,
        "k_calibration": CALIBRATION,
        "b_board": BOARD,
        "p_points": POINTS,
        "l_landmarks": LANDMARKS,
        "h_holes": HOLES,
        "s_seeds": SEEDS,
        "o_pose": POSE,
        "m_unknown_keys": "marrow-camera: 1\n" + CAMERA + "".join(f"key{i}: {i}\n" for i in range(300)),
        "l_many": (
            "marrow-landmarks: 1\nfragments:\n  f:\n    points:\n"
            + "".join(f"      p{i}: [1, 2, {i}]\n" for i in range(300))
            + "    tracked:\n"
            + "".join(f"      q{i}: [1, 2, 3]\n" for i in range(300))
        ),
    }
    return {name: (name[0] + text).encode() for name, text in files.items()}


def pipeline_seeds():
    files = {
        "all": PIPELINE,
        "small": SMALL,
        "overrides": (
            PIPELINE + "\0amount=7\none.value=3\none.uses=test.draw\nsum.in.b=sides.right\nsides.names=[x, y]\n"
        ),
        "faults": (
            PIPELINE.replace("count: 3", "count: -1")
            .replace("test.sum", "test.sun")
            .replace("b: sides.both", "c: sides.bot")
        ),
        "circle": (
            "marrow: 1\nnodes:\n  a: {uses: test.add, in: {a: b}}\n  b: {uses: test.add, in: {a: a}}\noutputs: {a: a}\n"
        ),
        "unclosed": SMALL.replace("}", ""),
        "merge": "marrow: 1\n<<: {nodes: {}}\n",
        "name": SMALL + "name: ../../x\n",
        "quotes": SMALL.replace("one", '"o: \\x1b[31m\\n"'),
        "truth": (
            "marrow: 1\nnodes:\n  t: {uses: test.truth}\n  e: {uses: judge.test, in: {of: t, truth: t}}\n  s: {uses:"
            " test.add, in: {a: t}}\noutputs: {e: e}\n"
        ),
    }
    return {name: text.encode() for name, text in files.items()}


def experiment_seeds():
    files = {
        "all": EXPERIMENT,
        "simulated": SIMULATED,
        "seeds": SIMULATED.replace(
            SIMULATED[SIMULATED.index("  simulate") : SIMULATED.index("variants")], "  seeds: [1, 2, 9]\n"
        ),
        "many_seeds": SIMULATED.replace("1..5", "1..100000"),
        "many_starts": EXPERIMENT.replace("count: 3", "count: 1000000"),
        "wide_matrix": EXPERIMENT.replace(
            "one.word: [one, two]", "\n  ".join(f"one.n{i}: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]" for i in range(8))
        ),
        "outside": EXPERIMENT.replace("plain: {}", "../../x: {}").replace("name: sums", "name: ../x"),
    }
    return {name: text.encode() for name, text in files.items()}
