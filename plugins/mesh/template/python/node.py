# SPDX-License-Identifier: Apache-2.0
"""A surface by marching cubes, whose vertices are then smoothed. It shows how a node in Python uses one in C++."""
from typing import Annotated

import marrow
import numpy as np


@marrow.node("mesh.new_node", summary="Marching cubes, then smoothing that does not shrink (Taubin 1995)")
def new_node(
    field: marrow.SignedField,
    *,
    passes: Annotated[int, marrow.at_least(0), marrow.at_most(100), "how often the vertices are smoothed"] = 2,
    weight: Annotated[float, marrow.at_least(0), marrow.at_most(0.6), "how far to the mean of the neighbours"] = 0.3,
) -> marrow.Mesh:
    surface = marrow.mesh.marching_cubes(field)
    vertices, triangles = surface.vertices_mm.copy(), surface.triangles
    for _ in range(passes):
        for factor in (weight, -1.02 * weight):
            vertices += factor * (mean_of_neighbours(vertices, triangles) - vertices)
    return marrow.Mesh(vertices, triangles, frame=surface.frame)


def mean_of_neighbours(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    total, count = np.zeros_like(vertices), np.zeros(len(vertices))
    for a, b in ((0, 1), (1, 2), (2, 0)):  # each edge of a closed surface is in two triangles, once in each direction
        np.add.at(total, triangles[:, a], vertices[triangles[:, b]])
        np.add.at(count, triangles[:, a], 1)
    return total / np.maximum(count, 1)[:, None]
