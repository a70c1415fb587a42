# SPDX-License-Identifier: Apache-2.0
"""The poses that each cost of the kind similarity finds. Each draw has new noise and another pose."""
import functools
import inspect

import numpy as np
import scene

import marrow

# The searches use only the finest level, from a start that is nearly right.
SEARCH = {
    "scan_rotation_deg": 0,
    "scan_translation_mm": 0,
    "candidates": 1,
    "contour_spacing_px": [2],
    "reach_px": [6],
    "pixel_step": [2],
    "step_deg": [0.5],
    "step_axial_deg": [1],
    "step_mm": [0.5],
    "step_tolerance": [0.01],
}
WITH_DERIVATIVES = ("contour_distance", "ray_to_surface")
START_DEG, START_MM, RANGE_DEG, RANGE_MM = 0.3, 0.3, 6, 5


@functools.lru_cache(maxsize=None)
def bone():
    return scene.Bone()


def names():
    """All costs, except the one that adds a known pose to another cost."""
    return [name for name in dir(marrow.similarity) if "cost" not in inputs_of(name)]


def inputs_of(name):
    return list(inspect.signature(getattr(marrow.similarity, name)).parameters)


def found(name, cost, start):
    optimizer = marrow.optimizer.levenberg_marquardt if name in WITH_DERIVATIVES else marrow.optimizer.bobyqa
    register = marrow.register.multiresolution.using(threads=1)
    initial = marrow.initial.manual(model=bone().mesh, start=marrow.Pose(start))
    return register(cost=cost, optimizer=optimizer(), start=initial, **SEARCH).pose


def cost_of(name, views):
    wanted = inputs_of(name)
    # The rendered bone has soft edges, so the shift for sharp surfaces is switched off.
    given = {port: value for port, value in bone().inputs(views, marrow.edges.canny(views)).items() if port in wanted}
    if "projector" in wanted and "model" not in wanted:
        given["projector"] = bone().outlines if "edges" in wanted and "outline" not in wanted else bone().radiographs
    return getattr(marrow.similarity, name)(**given)


def a_pose(random):
    return scene.rigid(np.radians(RANGE_DEG) * random.uniform(-1, 1, 3), RANGE_MM * random.uniform(-1, 1, 3))


def draw(name, views, random):
    """The error of a pose, and its covariance or None."""
    truth = a_pose(random)
    start = truth @ scene.rigid(np.radians(START_DEG) * random.normal(size=3), START_MM * random.normal(size=3))
    pose = found(name, cost_of(name, scene.views_of(bone(), truth, views, random)), start)
    return scene.error(truth, pose), pose.covariance
