# SPDX-License-Identifier: Apache-2.0
"""Errors of a calibration (docs/method.md, "Calibration")."""
import numpy as np

from figures import exactly
from values import read_yaml


def calibration(call):
    found, truth = call.one("calibration", read_yaml), call.one("true_calibration", read_yaml)
    k, exact = (np.asarray(one["intrinsics"], float) for one in (found, truth))
    focal = [100 * abs(k[i, i] - exact[i, i]) / exact[i, i] for i in (0, 1)]
    # A shift of the principal point is nearly a turn of the device, so the mean shift over the image does not count.
    u, v = np.meshgrid(np.linspace(0, truth["width_px"] - 1, 21), np.linspace(0, truth["height_px"] - 1, 21))
    shifts = seen(found, u, v) - seen(truth, u, v)
    rest = shifts - shifts.mean(axis=(1, 2), keepdims=True)
    return {
        "focal_error": exactly(max(focal)),
        "principal_u_error": exactly(abs(k[0, 2] - exact[0, 2])),
        "principal_v_error": exactly(abs(k[1, 2] - exact[1, 2])),
        "distortion_error": exactly(np.sqrt((rest**2).sum(axis=0).mean())),
        "residual": exactly(found["residual_px"]),
    }


def seen(calibration, u, v):
    """Where distortion puts the pixels (u, v) of a pinhole camera."""
    k = np.asarray(calibration["intrinsics"], float)
    x, y = np.linalg.solve(k[:2, :2], np.stack([u - k[0, 2], v - k[1, 2]]).reshape(2, -1)).reshape(2, *u.shape)
    squared = x**2 + y**2
    factor = 1 + sum(term * squared ** (power + 1) for power, term in enumerate(calibration["radial_distortion"]))
    return np.einsum("ij,jrc->irc", k[:2, :2], factor * np.stack([x, y])) + k[:2, 2][:, None, None]


def report(call):
    """What the report says of a calibration is what its file says."""
    found = read_yaml(call.beside("calibration"))
    k, deviation = np.asarray(found["intrinsics"], float), found["deviation"]
    result = {"residual": found["residual_px"]}
    for axis, name in enumerate("uv"):
        result |= {
            "focal_" + name: k[axis, axis],
            "focal_%s_deviation" % name: deviation["focal_px"][axis],
            "principal_" + name: k[axis, 2],
            "principal_%s_deviation" % name: deviation["principal_px"][axis],
        }
    for number, (term, spread) in enumerate(zip(found["radial_distortion"], deviation["radial_distortion"]), 1):
        if term or spread:
            result |= {"k%d" % number: term, "k%d_deviation" % number: spread}
    return {name: exactly(value) for name, value in result.items()}
