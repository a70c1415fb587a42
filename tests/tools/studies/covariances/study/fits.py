# SPDX-License-Identifier: Apache-2.0
"""Poses by nodes that fit points or filter motions. The data have the noise that the nodes' options state."""
import pathlib
import tempfile

import numpy as np
import scene
import yaml
from costs import bone

import marrow

POINTS, NOISE_MM, NOISE_PX = 6, 0.5, 1.0
MARKERS, MARKER_MM, COMMON_DEG, COMMON_MM = 5, 2.0, 5.0, 3.0
FRAMES, RATE_HZ, START_DEG, START_MM = 20, 30.0, 1.0, 1.0
SPEED_DEG, SPEED_MM, ACCELERATION_DEG, ACCELERATION_MM = 20.0, 20.0, 200.0, 200.0
POSE_DEG, POSE_MM = np.array([0.2, 0.3, 0.8]), np.array([0.2, 0.3, 0.1])


def read(reader, name, content):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, name)
        path.write_text(yaml.safe_dump(content))
        return reader(path=str(path))


def a_pose(random):
    return scene.rigid(np.radians(30) * random.uniform(-1, 1, 3), 30 * random.uniform(-1, 1, 3))


def moved(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def named(points):
    return {"point %d" % i: [float(x) for x in point] for i, point in enumerate(points)}


def landmarks(points, seen=None, tracked=None):
    content = {"points": named(points)}
    if seen:
        content["seen"] = {view: named(pixels) for view, pixels in seen.items()}
    if tracked is not None:
        content["tracked"] = named(tracked)
    return read(marrow.read.landmarks, "landmarks.yaml", {"marrow-landmarks": 1, "fragments": {"bone": content}})[
        "bone"
    ]


def surface_points(random, count):
    vertices = np.array(bone().mesh.vertices_mm)
    return vertices[random.choice(len(vertices), count, replace=False)]


def fiducials(random, **options):
    truth, points = a_pose(random), surface_points(random, POINTS)
    tracked = moved(points, truth) + NOISE_MM * random.normal(size=points.shape)
    pose = marrow.initial.fiducials(model=bone().mesh, landmarks=landmarks(points, tracked=tracked), **options)
    return scene.error(truth, pose), pose.covariance


def projected(camera, points):
    seen = moved(points, np.array(camera.camera_from_world)) @ np.array(camera.intrinsics).T
    return seen[:, :2] / seen[:, 2:]


def marked(random, count):
    truth = scene.rigid(np.radians(15) * random.uniform(-1, 1, 3), 10 * random.uniform(-1, 1, 3))
    points, blank, views, seen = surface_points(random, POINTS), np.ones((scene.SIDE_PX,) * 2, "uint16"), {}, {}
    for angle_deg in scene.ANGLES_DEG[:count]:
        name, camera = "at_%d" % angle_deg, scene.camera(angle_deg)
        views[name] = marrow.View(blank, camera, name=name)
        seen[name] = projected(camera, moved(points, truth)) + NOISE_PX * random.normal(size=(POINTS, 2))
    pose = marrow.initial.landmarks(
        model=bone().mesh, landmarks=landmarks(points, seen=seen), views=views, noise_px=NOISE_PX
    )
    return scene.error(truth, pose), pose.covariance


def skin_markers(random):
    truth, axes, origin = a_pose(random), bone().axes, bone().origin_mm
    angles = 2 * np.pi * (np.arange(MARKERS) + random.uniform(0, 0.5, MARKERS)) / MARKERS
    around = np.stack([60 * np.cos(angles), 60 * np.sin(angles), random.uniform(-50, 50, MARKERS)], axis=1)
    slid = around @ scene.rigid([0, 0, np.radians(COMMON_DEG) * random.normal()], [0, 0, 0])[:3, :3].T
    slid += COMMON_MM * random.normal(size=3)
    tracked = moved(origin + slid @ axes.T, truth) + MARKER_MM * random.normal(size=around.shape)
    pose = marrow.initial.skin_markers(
        model=bone().mesh,
        landmarks=landmarks(origin + around @ axes.T, tracked=tracked),
        noise_mm=[MARKER_MM],
        common_rotation_deg=COMMON_DEG,
        common_shift_mm=COMMON_MM,
    )
    return scene.error(truth, pose), pose.covariance


def with_covariance(matrix, deviations):
    """A pose about the bone's axes, with deviations in rad and mm."""
    return read(
        marrow.read.pose,
        "pose.yaml",
        {
            "marrow-pose": 1,
            "target": "world",
            "source": "ct",
            "matrix": matrix.tolist(),
            "cost": 1.0,
            "evaluations": 1,
            "fragment_frame": {"origin_mm": bone().origin_mm.tolist(), "axes": bone().axes.tolist()},
            "covariance": np.diag(deviations**2).tolist(),
        },
    )


def moved_by(matrix, motion):
    """A pose after a motion (rad, mm) about and along the bone's axes, as in scene.error()."""
    axes, origin = bone().axes, bone().origin_mm
    turn = scene.rigid(axes @ motion[:3], [0, 0, 0])
    turn[:3, 3] = origin - turn[:3, :3] @ origin + axes @ motion[3:]
    return matrix @ turn


def in_units(degrees, millimetres):
    return np.concatenate([np.radians(degrees) * np.ones(3), millimetres * np.ones(3)])


def sequence(random):
    """The true and the tracked poses of a bone whose velocity changes by white acceleration."""
    of_pose = np.concatenate([np.radians(POSE_DEG), POSE_MM])
    truth, velocity = a_pose(random), in_units(SPEED_DEG, SPEED_MM) * random.normal(size=6)
    state = marrow.track.begin(
        start=with_covariance(moved_by(truth, in_units(START_DEG, START_MM) * random.normal(size=6)), of_pose),
        frame_rate_hz=RATE_HZ,
        start_deg=START_DEG,
        start_mm=START_MM,
        speed_deg_s=SPEED_DEG,
        speed_mm_s=SPEED_MM,
        acceleration_deg_s2=ACCELERATION_DEG,
        acceleration_mm_s2=ACCELERATION_MM,
    )
    truths, states, poses = [], [], []
    for frame in range(FRAMES):
        if frame > 0:
            truth, velocity = flown(truth, velocity, random)
            state = marrow.track.predict(state=state).state
        seen = with_covariance(moved_by(truth, of_pose * random.normal(size=6)), of_pose)
        filtered = marrow.track.filter(state=state, pose=seen)
        state = filtered.state
        truths.append(truth), states.append(state), poses.append(filtered.pose)
    return truths, states, poses


def flown(truth, velocity, random):
    """The state one frame later. The acceleration changes ten times in between."""
    parts = 10
    for _ in range(parts):
        truth = moved_by(truth, velocity / RATE_HZ / parts)
        velocity = velocity + in_units(ACCELERATION_DEG, ACCELERATION_MM) / RATE_HZ / np.sqrt(parts) * random.normal(
            size=6
        )
    return truth, velocity


def filtered(random):
    truths, _, poses = sequence(random)
    return scene.error(truths[-1], poses[-1]), poses[-1].covariance


def smoothed(random):
    truths, states, _ = sequence(random)
    pose = list(marrow.track.smooth(states={"%02d" % i: state for i, state in enumerate(states)}).poses.values())
    return scene.error(truths[FRAMES // 2], pose[FRAMES // 2]), pose[FRAMES // 2].covariance


FITS = {
    "initial.fiducials": lambda random: fiducials(random, noise_mm=NOISE_MM),
    "initial.fiducials, noise_mm: 0": fiducials,
    "initial.landmarks, 1 view": lambda random: marked(random, 1),
    "initial.landmarks, 2 views": lambda random: marked(random, 2),
    "initial.landmarks, 3 views": lambda random: marked(random, 3),
    "initial.skin_markers": skin_markers,
    "track.filter": filtered,
    "track.smooth": smoothed,
}
