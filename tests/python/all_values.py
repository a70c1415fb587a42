# SPDX-License-Identifier: Apache-2.0
"""A value of each class that Python makes, by the line that shows it."""
import numpy
from harness.package import marrow

MESH = "<marrow.Mesh of 4 vertices, 4 triangles, mm, frame 'ct'>"
TURN = numpy.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])  # 90 degrees about z


def camera():
    return marrow.Camera(4, 3, [[1700, 0, 1.5], [0, 1700, 1], [0, 0, 1]], TURN)


def values():
    """{what is expected of its line: a value} of all classes that Python makes."""
    grid = {"spacing_mm": (0.8, 0.8, 1.5), "origin_mm": (1, 2, 3), "frame": "ct"}
    samples = numpy.arange(24, dtype="float32").reshape(2, 3, 4)
    corners = [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]]
    grid_text = "4 x 3 x 2, %s, spacing 0.8 x 0.8 x 1.5 mm, frame 'ct'"
    return {
        "<marrow.Image 4 x 3 px, uint16>": marrow.Image(numpy.arange(12, dtype="uint16").reshape(3, 4)),
        "<marrow.Volume %s>" % (grid_text % "HU"): marrow.Volume(samples, **grid),
        "<marrow.SignedField %s>" % (grid_text % "mm"): marrow.SignedField(samples - 9, **grid),
        MESH: marrow.Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
        "<marrow.Camera 4 x 3 px, focal length 1700 px>": camera(),
        "<marrow.View frontal, 4 x 3 px, uint8, masked>": marrow.View(
            numpy.ones((3, 4), "uint8"), camera(), mask=numpy.ones((3, 4), bool), name="frontal"
        ),
        "<marrow.Pose world_from_ct, translation (1, 2, 3) mm>": marrow.Pose(TURN),
        "<marrow.Seeds of distal: 2 points, mm>": marrow.Seeds("distal", [[1, 2, 3], [4, 5, 6]]),
        "<marrow.Landmarks of 1 point, mm; seen 1 times>": marrow.Landmarks(
            {"tip": (1, 2, 3)}, {"ap": {"tip": (4, 5)}}
        ),
        "<marrow.EdgeMap of 1 pixels, 4 x 3 px>": marrow.EdgeMap([[1, 2, 1, 0, 50]], width_px=4, height_px=3),
        "<marrow.ShaftLines of a shaft of 27.25 mm, deviation 0.5 mm>": marrow.ShaftLines(
            ((0, 0), (0, 9)), ((5, 0), (5, 9)), width_mm=27.25, width_deviation_mm=0.5
        ),
        "<marrow.Metrics mtre_mm = 0.512 mm, share = 2>": marrow.Metrics(
            {"mtre_mm": 0.512, "share": 2}, {"mtre_mm": "mm"}
        ),
        "<marrow.Verdict doubtful, failure 25 %>": marrow.Verdict(
            "doubtful", failure_probability=0.25, reasons=["one view"], figures=marrow.Metrics({"mtre_mm": 3})
        ),
    }
