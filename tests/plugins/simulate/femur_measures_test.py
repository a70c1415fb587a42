#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A simulated femur has the measures it is asked for, as a radiologist would measure them on its surface: numpy finds
the head's sphere, the neck's axis through the middles of its sections, and the line that touches both condyles at the
back. Nothing of the femur's shape functions is used."""
import sys
import unittest

import numpy as np

from harness import BUILD

sys.path.insert(0, str(BUILD / "python"))
import marrow  # noqa: E402  (the path to it is set above)


def surface(side, **options):
    """Vertices, with x to the medial side, y to the back and z up."""
    bone = marrow.simulate.femur(side=side, ripple_mm=0, resolution_mm=1.5, **options)
    vertices = np.array(marrow.simulate.truth(phantom=marrow.simulate.whole(bone=bone)).models["bone"].vertices_mm)
    return vertices * [-1 if side == "left" else 1, 1, 1]


def sphere(points):
    """Centre and radius by least squares: |p|^2 = 2 p . c + r^2 - |c|^2."""
    solution = np.linalg.lstsq(np.c_[2 * points, np.ones(len(points))], (points**2).sum(1), rcond=None)[0]
    return solution[:3], np.sqrt(solution[3] + solution[:3] @ solution[:3])


def head(vertices):
    top = vertices[vertices[:, 2] > vertices[:, 2].max() - 10]
    centre, radius = top.mean(0) - [0, 0, 18], 23.0
    for _ in range(20):
        from_centre = vertices - centre
        is_on_it = np.abs(np.linalg.norm(from_centre, axis=1) - radius) < 1
        centre, radius = sphere(vertices[is_on_it & (from_centre @ [0.6, -0.2, 0.5] > 0)])
    return centre, radius


def neck_axis(vertices, centre):
    """The direction from the head's centre along which the middles of the neck's sections lie. A section's middle is
    that of the circle through its outline."""
    axis = np.array([-0.8, 0.2, -0.55])
    for _ in range(30):
        axis /= np.linalg.norm(axis)
        across = np.linalg.svd(axis[None])[2][1:]
        middles = []
        for distance in (24, 26, 28, 30, 32):
            at = vertices - centre - distance * axis
            plane = at[(np.abs(at @ axis) < 1.2) & (np.linalg.norm(at, axis=1) < 28)] @ across.T
            circle = np.linalg.lstsq(np.c_[2 * plane, np.ones(len(plane))], (plane**2).sum(1), rcond=None)[0]
            middles.append(distance * axis + circle[:2] @ across)
        axis = np.mean(middles, axis=0)
    return axis / np.linalg.norm(axis)


def condyles_line_deg(vertices):
    """Angle from x to the back of the line that touches both condyles at the back."""
    low = vertices[vertices[:, 2] < vertices[:, 2].min() + 50][:, :2]
    low = low - [0.5 * (low[:, 0].min() + low[:, 0].max()), 0]
    medial, lateral = low[low[:, 0] > 10], low[low[:, 0] < -10]

    def is_ahead(angle):
        """How much farther back the medial condyle reaches, across a line at this angle."""
        back = np.array([-np.sin(angle), np.cos(angle)])
        return (medial @ back).max() - (lateral @ back).max()

    least, most = np.radians([-25, 25])
    for _ in range(50):
        middle = 0.5 * (least + most)
        least, most = (middle, most) if is_ahead(middle) > 0 else (least, middle)
    return np.degrees(least)


class FemurMeasures(unittest.TestCase):
    def measure(self, vertices):
        centre, radius = head(vertices)
        axis = neck_axis(vertices, centre)
        line_deg = condyles_line_deg(vertices)
        along = np.array([np.cos(np.radians(line_deg)), np.sin(np.radians(line_deg))])
        low = vertices[vertices[:, 2] < vertices[:, 2].min() + 60][:, :2] @ along
        return {
            "anteversion_deg": np.degrees(np.arctan2(axis[1], -axis[0])) + line_deg,
            "neck_shaft_deg": np.degrees(np.arccos(axis[2])),
            "bicondylar_width_mm": low.max() - low.min(),
            "head_diameter_mm": 2 * radius,
            "length_mm": np.ptp(vertices[:, 2]),
        }

    def test_stated_measures_are_those_of_the_surface(self):
        near = {
            "anteversion_deg": 0.6,  # the trochanters' fillets draw the neck's sections a little aside
            "neck_shaft_deg": 1.2,
            "bicondylar_width_mm": 0.15,
            "head_diameter_mm": 0.15,
            "length_mm": 0.3,
        }
        asked = {"neck_shaft_deg": 122, "head_diameter_mm": 46.6, "length_mm": 446}
        for side, anteversion, width in (("left", 14, 82), ("right", 14, 82), ("left", 30, 75), ("right", -5, 92)):
            options = {"anteversion_deg": anteversion, "bicondylar_width_mm": width}
            found = self.measure(surface(side, **options))
            for name, value in (asked | options).items():
                self.assertAlmostEqual(found[name], value, delta=near[name], msg=f"{name}, {side} femur, {options}")


if __name__ == "__main__":
    unittest.main()
