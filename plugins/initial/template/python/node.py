# SPDX-License-Identifier: Apache-2.0
"""A start whose long axis is where the views show the shaft: each view gives a plane through the X-ray source, midway
between the shaft's borders, and the planes intersect in the axis. It shows how a node in Python uses one in C++, which
gives the fragment's own axes."""
from typing import Annotated, Optional

import marrow
import numpy as np


@marrow.node("initial.new_node", summary="The long axis of the fragment is moved to the shaft's axis in the views")
def new_node(
    model: marrow.Mesh,
    lines: Annotated[marrow.Items[marrow.ShaftLines], marrow.over("view")],
    views: Annotated[marrow.Items[marrow.View], marrow.over("view")],
    start: Optional[marrow.Pose] = None,
    *,
    most_turn_deg: Annotated[float, marrow.at_least(0), marrow.at_most(90), "a larger turn is refused"] = 45,
) -> marrow.Pose:
    if len(lines) < 2:
        raise marrow.Error("the axis needs the shaft's lines in two views; add a view, or take initial.shaft_axis")
    begin = marrow.initial.manual(model, start=start)
    planes = np.array([plane(lines[name], views[name].camera) for name in lines])
    normals, offsets = planes[:, :3], planes[:, 3]
    axis = np.linalg.svd(normals)[2][2]  # at right angles to all normals
    old_axis = begin.matrix[:3, :3] @ begin.axes[:, 2]
    axis = axis if axis @ old_axis > 0 else -axis
    turn = rotation_between(old_axis, axis)
    if np.degrees(np.arccos(np.clip(axis @ old_axis, -1, 1))) > most_turn_deg:
        raise marrow.Error("the shaft in the views is turned far from the start; give a start nearer to the bone")
    middle = (begin.matrix @ np.append(begin.origin_mm, 1))[:3]
    nearest = middle - np.linalg.lstsq(normals, normals @ middle - offsets, rcond=None)[0]
    matrix = np.eye(4)
    matrix[:3, :3] = turn @ begin.matrix[:3, :3]
    matrix[:3, 3] = nearest - matrix[:3, :3] @ begin.origin_mm
    return marrow.initial.manual(model, start=marrow.Pose(matrix, source=begin.source))


def plane(borders: marrow.ShaftLines, camera: marrow.Camera) -> np.ndarray:
    """Normal and offset of the plane through the source, midway between the planes of both borders."""
    rays_from_pixels = camera.camera_from_world[:3, :3].T @ np.linalg.inv(camera.intrinsics)
    normals = []
    for border in (borders.left, borders.right):
        first, last = (rays_from_pixels @ np.append(end, 1) for end in border)
        normals.append(np.cross(first, last) / np.linalg.norm(np.cross(first, last)))
    normal = (normals[0] + normals[1]) / np.linalg.norm(normals[0] + normals[1])
    source = -camera.camera_from_world[:3, :3].T @ camera.camera_from_world[:3, 3]
    return np.append(normal, normal @ source)


def rotation_between(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """The shortest rotation that takes one unit vector to another (Rodrigues)."""
    x, y, z = np.cross(old, new)
    turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + turn + turn @ turn / (1 + old @ new)
