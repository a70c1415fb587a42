# SPDX-License-Identifier: Apache-2.0
"""The covariances of corrected cameras and of a calibration."""
import pathlib

import costs
import numpy as np
import scene

import marrow

ROOT = pathlib.Path(__file__).resolve().parents[5]
# The deviations of the cameras' errors: the defaults of refine.cameras.
CAMERA_DEG, CAMERA_MM, FOCAL_PERCENT, CENTRE_PX = 0.5 / np.sqrt(3), 1 / np.sqrt(3), 1.0, 5 / np.sqrt(2)
IMAGES = 8


def wrong_camera(camera, random):
    """The camera of an inexact calibration: turned a little about the world's origin, where the bone is."""
    off = scene.rigid(np.radians(CAMERA_DEG) * random.normal(size=3), CAMERA_MM * random.normal(size=3))
    middle = np.array(camera.camera_from_world)[:3, 3]
    off[:3, 3] += middle - off[:3, :3] @ middle
    intrinsics = np.array(camera.intrinsics)
    intrinsics[:2, :2] *= 1 + 0.01 * FOCAL_PERCENT * random.normal()
    intrinsics[:2, 2] += CENTRE_PX * random.normal(size=2)
    return marrow.Camera(camera.width_px, camera.height_px, intrinsics, off @ np.array(camera.camera_from_world))


def refined(name, count, random):
    """A pose from inexact cameras, and one from cameras that were corrected together with it."""
    truth = costs.a_pose(random)
    views = {}
    for view_name, view in scene.views_of(costs.bone(), truth, count, random).items():
        views[view_name] = marrow.View(view.image.array, wrong_camera(view.camera, random), name=view_name)
    cost = costs.cost_of(name, views)
    pose = costs.found(name, cost, truth)
    refined = marrow.refine.cameras(views=views, costs={"bone": cost}, poses={"bone": pose})
    corrected = refined.poses["bone"]
    return scene.error(truth, corrected), corrected.covariance


def bead_board(random):
    """Focal lengths and principal point of an X-ray device."""
    board, side_px, pixel_mm = str(ROOT / "pipelines/calibration/board.yaml"), 512, 0.6
    simulate = marrow.simulate.bead_board.using(seed=int(random.integers(1 << 31)))
    seen = simulate(board=board, views=IMAGES, width_px=side_px, height_px=side_px, pixel_mm=pixel_mm)
    report = marrow.camera.bead_board(images=seen.images, board=board).metrics
    right = {"focal_u": 1000 / pixel_mm, "focal_v": 1000 / pixel_mm}
    right.update(principal_u=(side_px - 1) / 2 + 7, principal_v=(side_px - 1) / 2 - 5)
    error = np.array([report[name] - value for name, value in right.items()])
    return error, np.diag([report[name + "_deviation"] ** 2 for name in right])


FITS = {
    "refine.cameras, contour_distance, 2 views": lambda random: refined("contour_distance", 2, random),
    "refine.cameras, patch_gradient_correlation, 2 views": lambda random: refined(
        "patch_gradient_correlation", 2, random
    ),
    "camera.bead_board": bead_board,
}
