# SPDX-License-Identifier: Apache-2.0
"""What the tests of sequences on the page "Place" need: a femur that moves through small X-rays. Its pose in each frame
is known."""
import pathlib
import shutil
import struct
import tempfile
import unittest

from bench import simulate

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
        MADE["outputs"] = simulate(scratch / "made", pipeline=scratch / "moving.yaml")
    return MADE["outputs"]


def truth(frame):
    import yaml

    return yaml.safe_load((made() / "truths" / ("%04d" % frame) / "bone.yaml").read_text())["matrix"]


def write_tiff(path, images):
    """Pages of 16 bits, one strip each."""
    data, at = b"", []
    for image in images:
        pixels, (height, width) = image.astype("<u2").tobytes(), image.shape
        entries = [(256, 4, width), (257, 4, height), (258, 3, 16), (259, 3, 1), (262, 3, 1), (273, 4, 8 + len(data))]
        entries += [(277, 3, 1), (278, 4, height), (279, 4, len(pixels))]
        data += pixels
        at.append(8 + len(data))
        data += struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", a, b, 1, c) for a, b, c in entries)
        data += b"NEXT"
    for page, begin in enumerate(at):
        end = begin - 8 + 2 + 12 * 9
        data = data[:end] + struct.pack("<I", at[page + 1] if page + 1 < len(at) else 0) + data[end + 4 :]
    path.write_bytes(struct.pack("<2sHI", b"II", 42, at[0]) + data)


NONE = ",".join(["NaN"] * 16)  # of a .tra file: no pose in this frame


def line(pose):
    """A line of a .tra file."""
    return ",".join("%.17g" % value for row in pose for value in row)


def shifted(pose, x_mm):
    return [[*row[:3], row[3] + (x_mm if i == 0 else 0)] for i, row in enumerate(pose)]


class Moving:
    """The open folder holds the case `case` and the images of its sequence in `film`."""

    def setUp(self):
        super().setUp()
        shutil.copytree(made() / "case", self.folder / "case")
        shutil.copytree(made() / "views", self.folder / "film")
