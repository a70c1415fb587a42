# SPDX-License-Identifier: Apache-2.0
"""What a call gave, as a text that changes with it. Functions are asked for values."""
import numpy
from harness.package import marrow

_OFFSETS = ([0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 2], [1, -2, 4])


def digest_of(value, scene):
    if value is None:
        return "nothing"
    if isinstance(value, marrow.Items):
        return "|".join("%s=%s" % (name, digest_of(value[name], scene)) for name in value)
    if isinstance(value, tuple):  # several outputs
        return "; ".join("%s: %s" % (name, digest_of(getattr(value, name), scene)) for name in value._fields)
    if isinstance(value, marrow._core.Cost):
        return numpy.asarray(value(poses_near(scene))).tobytes().hex()
    if isinstance(value, marrow._core.OutlineProjector):
        return numpy.asarray(value(scene.case.views["frontal"], poses_near(scene)[1])).tobytes().hex()
    if isinstance(value, marrow._core.RadiographProjector):
        return numpy.asarray(value(scene.case.views["frontal"], poses_near(scene)[1], step_px=6)).tobytes().hex()
    if isinstance(value, marrow._core.Optimizer):
        return minimum_of(value)
    return marrow._core.digest_of(value)


def poses_near(scene):
    poses = []
    for offset in _OFFSETS:
        pose = numpy.array(scene.truth)
        pose[:3, 3] += offset
        poses.append(pose)
    return numpy.array(poses)


def minimum_of(optimizer):
    """Of a bowl with ripples, so that ways differ."""
    asked = []

    def value(x):
        asked.append(tuple(x))
        return float(((x - 0.3) ** 2).sum() + 0.2 * numpy.sin(5 * x).sum())

    found = optimizer.minimise(value, [0.9, -0.4], [0.5, 0.5], max_evaluations=120)
    return "%r %r" % (found.x.tolist(), asked)
