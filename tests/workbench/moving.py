# SPDX-License-Identifier: Apache-2.0
"""What the test of sequences on the page "Place" needs: a femur that moves through small X-rays, whose pose is known in
each frame."""
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from bench import MARROW

FRAMES = 6
MADE = {}
PIPELINE = """
marrow: 1
nodes:
  femur:   {uses: simulate.femur, with: {isocentre_from_distal_end_mm: 40}}
  whole:   {uses: simulate.whole, in: {bone: femur}}
  ct:      {uses: simulate.ct, in: {phantom: whole}, with: {spacing_mm: [1.5, 1.5, 1.5]}}
  cameras:
    uses: camera.carm
    with: {names: [frontal, lateral], alpha_deg: [0, 0], beta_deg: [0, 90], source_to_detector_mm: 1000,
      source_to_isocentre_mm: 600, width_px: 256, height_px: 256, pixel_mm: 1.1}
  motion:  {uses: simulate.bone_motion, in: {phantom: whole}, with: {frames: %d, frame_rate_hz: 60}}
  views:   {uses: simulate.fluoroscopy, in: {phantom: whole, posture: motion, cameras: cameras}}
  still:   {uses: simulate.fluoroscopy, in: {phantom: whole, cameras: cameras}}
  truths:  {uses: simulate.truth, in: {phantom: whole, posture: motion}}
  case:    {uses: simulate.case, in: {volume: ct, views: still, phantom: whole}, with: {register: [bone]}}
outputs: {case: case, views: views, truths: truths.truths}
"""
VIEWS = {name: {"images": "film", "pattern": "*/%s/image.png" % name} for name in ("frontal", "lateral")}


def made():
    """The folder of the simulated run, made once: case, views and truths."""
    if not MADE:
        scratch = pathlib.Path(tempfile.mkdtemp(prefix="marrow-moving-"))
        unittest.addModuleCleanup(shutil.rmtree, scratch, ignore_errors=True)
        (scratch / "moving.yaml").write_text(PIPELINE % FRAMES)
        subprocess.run([MARROW, "run", scratch / "moving.yaml", "--out", scratch / "made", "--quiet"], check=True)
        MADE["outputs"] = scratch / "made" / "outputs"
    return MADE["outputs"]


def truth(frame):
    import yaml

    return yaml.safe_load((made() / "truths" / ("%04d" % frame) / "bone.yaml").read_text())["matrix"]


class Moving:
    """The open folder holds the case `case` and the images of its sequence in `film`."""

    def setUp(self):
        super().setUp()
        shutil.copytree(made() / "case", self.folder / "case")
        shutil.copytree(made() / "views", self.folder / "film")
