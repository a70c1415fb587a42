# SPDX-License-Identifier: Apache-2.0
"""marrow's filter of a bone that only shifts, beside a Kalman filter of white acceleration in numpy. Its steady gain
comes from the Riccati equation (scipy.linalg.solve_discrete_are), its noise from the Lyapunov equation."""
import pathlib
import sys
import tempfile
import unittest

from harness import BUILD, need_scipy

need_scipy()
import numpy as np  # noqa: E402
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov  # noqa: E402

sys.path.insert(0, str(BUILD / "python"))
import marrow  # noqa: E402  (the path to it is set above)

ACCELERATION, NOISE, IMPULSE = 5000.0, 0.09, 0.1  # mm/s^2, mm, mm
WEIGHED = {
    "first_scale": 1,
    "added_deviation_deg": 0,
    "added_deviation_mm": 0,
    "gate": 1e12,
}  # nothing but the Kalman filter is left


def model(rate_hz):
    """Transition and covariance of (shift, velocity) over a frame. The velocity changes by ACCELERATION * dt."""
    dt = 1 / rate_hz
    covariance = ACCELERATION**2 * np.array([[dt**4 / 3, dt**3 / 2], [dt**3 / 2, dt**2]])
    return np.array([[1, dt], [0, 1]]), covariance


def steady_gain(rate_hz):
    transition, added = model(rate_hz)
    seen = np.array([[1.0, 0.0]])
    predicted = solve_discrete_are(transition.T, seen.T, added, [[NOISE**2]])
    return (predicted @ seen.T / (predicted[0, 0] + NOISE**2))[:, 0]


def registered(folder, mm):
    """A pose that was found this far along x, as a file says it."""
    deviations = np.array([1e-4] * 3 + [NOISE] * 3)
    covariance = [list(map(float, row)) for row in np.diag(deviations**2)]
    path = pathlib.Path(folder) / f"{mm}.yaml"
    path.write_text(
        "marrow-pose: 1\ntarget: world\nsource: ct\nrotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
        f"translation_mm: [{mm}, 0, 0]\ncovariance: {covariance}\n"
    )
    return marrow.read.pose(path=path)


class Followed:
    """A bone that is followed along x."""

    def __init__(self, rate_hz):
        self.state = marrow.track.begin(
            marrow.Pose(np.eye(4)), frame_rate_hz=rate_hz, acceleration_mm_s2=ACCELERATION, start_mm=1, speed_mm_s=1
        )

    def predict(self):
        """Where the bone is expected in the next frame [mm]."""
        self.state, pose = marrow.track.predict(self.state)
        return pose.matrix[0, 3]

    def see(self, pose):
        """Where the bone is then found [mm]."""
        self.state, found = marrow.track.filter(self.state, pose, **WEIGHED)
        return found.matrix[0, 3]


class Kalman(unittest.TestCase):
    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.at_rest, self.away = registered(folder, 0.0), registered(folder, IMPULSE)

    def steady(self, rate_hz):
        """A bone at rest that was seen so often that the covariance does not change any more."""
        bone = Followed(rate_hz)
        for _ in range(60):
            bone.predict()
            bone.see(self.at_rest)
        return bone

    def test_the_steady_gain_is_that_of_the_riccati_equation(self):
        for rate_hz in (25, 30, 62, 120):
            bone, expected = self.steady(rate_hz), steady_gain(rate_hz)
            bone.predict()
            after = bone.see(self.away)
            gain = np.array([after, (bone.predict() - after) * rate_hz]) / IMPULSE
            print(f"{rate_hz} Hz: gain {gain[0]:.6f}, {gain[1] / rate_hz:.6f} a frame; scipy {expected}")
            np.testing.assert_allclose(gain, expected, rtol=1e-6)
            self.assertLess(gain[1] / rate_hz, 3 - 3**0.5 + 1e-6)  # the limit for large accelerations

    def test_predictions_are_as_exact_as_the_lyapunov_equation_says(self):
        """The deviation of a prediction is that of the poses times the root of the sum of its squared responses."""
        for rate_hz in (25, 30, 62):
            transition, _ = model(rate_hz)
            gain = steady_gain(rate_hz)[:, None]
            closed = transition @ (np.eye(2) - gain @ np.array([[1.0, 0.0]]))
            kick = transition @ gain * NOISE
            expected = solve_discrete_lyapunov(closed, kick @ kick.T)[0, 0] ** 0.5
            bone, responses = self.steady(rate_hz), []
            for k in range(40):
                bone.predict()
                bone.see(self.at_rest if k else self.away)
                responses.append(marrow.track.predict(bone.state).pose.matrix[0, 3] / IMPULSE)
            found = NOISE * np.sum(np.square(responses)) ** 0.5
            print(
                f"{rate_hz} Hz: poses of {NOISE} mm predict one to {found:.5f} mm, "
                f"by the Lyapunov equation to {expected:.5f}"
            )
            self.assertAlmostEqual(found / expected, 1, delta=1e-4)


if __name__ == "__main__":
    unittest.main(verbosity=2)
