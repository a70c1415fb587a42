# SPDX-License-Identifier: Apache-2.0
"""The real wrist as a trial of Autoscoper, and how pipelines/wrist is run on it."""
import subprocess

from harness import SOURCE

PARTS = SOURCE.parent / "shared" / "data" / "wrist"  # not part of marrow; see tools/studies/wrist_trial
POSES = SOURCE / "pipelines" / "wrist"


def real_trial(folder):
    """The file of the trial, made in a new folder; None if its data are not on this machine."""
    if not PARTS.is_dir():
        return None
    subprocess.run([str(SOURCE / "tools" / "studies" / "wrist_trial"), str(PARTS), str(folder)], check=True)
    return folder / "wrist.cfg"


def radius_inputs(trial, inputs, frame="0002"):
    """The arguments for the radius, of those inputs that a pipeline has."""
    given = {
        "trial": trial,
        "bone": "rad",
        "frame": frame,
        "start": POSES / ("radius-%s.pose.yaml" % frame),
        "points": POSES / ("beads-%s.points.yaml" % frame),
    }
    return ["%s=%s" % (name, value) for name, value in given.items() if name in inputs]
