# SPDX-License-Identifier: Apache-2.0
"""Simulated cases that the tests of whole commands run on, and small matrices."""
import json
import math
import os
import shutil

import yaml

from harness import SHARED_CACHE, SOURCE
from harness.program import marrow

FEMUR = SOURCE / "pipelines" / "femur" / "femur.yaml"
SMALL = ["--set", "ct.spacing_mm=[1.2, 1.2, 1.5]", "--set", "ct.range_mm=[0, 300]"]  # runs in 2 seconds instead of 7


def sets(changes):
    """The words that change options of nodes."""
    return [word for change in changes for word in ("--set", change)]


def simulate(folder, *arguments, pipeline="simulate/simulate.yaml"):
    """The folder of a simulated case. The same case is made once for all tests."""
    result = marrow(
        *["run", SOURCE / "pipelines" / pipeline, "--out", folder, "--quiet", *arguments],
        extra_environment={"MARROW_CACHE": str(SHARED_CACHE)},
    )
    assert result.returncode == 0, result.stderr
    return folder / "outputs" / "case"


def copy_case(case, to, change=lambda description: None):
    """A copy whose case.yaml is changed. The other files are links: replace them, do not write into them."""
    shutil.copytree(case, to, copy_function=os.link)
    description = yaml.safe_load((case / "case.yaml").read_text())
    change(description)
    replace(to / "case.yaml", yaml.safe_dump(description, sort_keys=False).encode())
    return to


def replace(path, data):
    path.unlink(missing_ok=True)
    path.write_bytes(data)


def contents(folder):
    """Every file below a folder with its bytes."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def metrics(path):
    return {metric["name"]: metric["value"] for metric in json.loads(path.read_text())["metrics"]}


def times(matrix, vector):
    return [sum(a * b for a, b in zip(row, vector)) for row in matrix]


def matrix_product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def transposed(matrix):
    return [list(row) for row in zip(*matrix)]


def rotation_vector_deg(r):
    """Axis times angle of a rotation by less than half a turn."""
    axis = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    sine = 0.5 * math.sqrt(sum(x * x for x in axis))
    angle = math.atan2(sine, 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1))
    return [math.degrees(0.5 * x * (angle / sine if sine > 1e-12 else 1)) for x in axis]
