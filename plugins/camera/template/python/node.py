# SPDX-License-Identifier: Apache-2.0
"""Cameras of an isocentric C-arm from its two angles."""
from typing import Annotated, List

import marrow
import numpy as np


@marrow.node(
    "camera.new_node",
    summary="Cameras of an isocentric C-arm from its angles, which have the signs of DICOM's positioner angles",
    relations=[
        marrow.at_least_one("names"),
        marrow.distinct("names"),
        marrow.same_length("names", "alpha_deg", "beta_deg"),
        marrow.below("source_to_isocentre_mm", "source_to_detector_mm"),
    ],
)
def new_node(
    *,
    names: Annotated[List[str], "one name per view"] = ["frontal", "lateral"],
    alpha_deg: Annotated[List[float], marrow.at_least(-90), marrow.at_most(90), "cranio-caudal angle of each view"] = [
        0,
        0,
    ],
    beta_deg: Annotated[List[float], marrow.at_least(-180), marrow.at_most(180), "anterior angle of each view"] = [
        0,
        90,
    ],
    source_to_detector_mm: Annotated[float, marrow.at_least(1), "from the source to the detector"] = 1000,
    source_to_isocentre_mm: Annotated[float, marrow.at_least(1), "from the source to the centre of rotation"] = 600,
    size_px: Annotated[int, marrow.at_least(1), marrow.at_most(16384), "rows and columns of an image"] = 512,
    pixel_mm: Annotated[float, marrow.at_least(0.001), "size of a pixel on the detector"] = 0.586,
) -> Annotated[marrow.Items[marrow.Camera], marrow.over("view"), marrow.named("camera"), "camera of each view"]:
    focal_px, middle_px = source_to_detector_mm / pixel_mm, (size_px - 1) / 2
    intrinsics = [[focal_px, 0, middle_px], [0, focal_px, middle_px], [0, 0, 1]]
    cameras = {}
    for name, alpha, beta in zip(names, np.radians(alpha_deg), np.radians(beta_deg)):
        camera_from_world = np.eye(4)
        camera_from_world[:3, :3] = world_from_camera(alpha, beta).T
        camera_from_world[2, 3] = source_to_isocentre_mm  # the isocentre is the world's origin
        cameras[name] = marrow.Camera(size_px, size_px, intrinsics, camera_from_world)
    return cameras


def world_from_camera(alpha_rad: float, beta_rad: float) -> np.ndarray:
    """At (0, 0) the rays run along -y, the image's rows along -x and its columns along -z: the head is up."""
    start = np.array([[-1, 0, 0], [0, 0, -1], [0, -1, 0]], float)
    sine, cosine = np.sin(-alpha_rad), np.cos(alpha_rad)
    about_x = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    sine, cosine = np.sin(beta_rad), np.cos(beta_rad)
    about_z = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    return about_z @ about_x @ start
