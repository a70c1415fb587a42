# SPDX-License-Identifier: Apache-2.0
"""Figures from the errors and the predicted covariances of several draws."""
import numpy as np

GROUPS = {"tilt": (0, 1), "axial turn": (2,), "shift across": (3, 4), "axial shift": (5,)}
UNKNOWN = np.array([np.radians(100)] * 3 + [100] * 3)  # a pose with a deviation as large is said to be unknown


def is_known(covariance):
    if covariance is None or not np.isfinite(covariance).all():
        return False
    return len(covariance) != len(UNKNOWN) or bool((np.sqrt(np.diag(covariance)) < UNKNOWN).all())


def of(draws, groups):
    """draws: pairs of an error and its predicted covariance or None. Uses the median of the predicted variances, so
    that a single draw cannot decide."""
    known = [(error, covariance) for error, covariance in draws if is_known(covariance)]
    figures = {"known": len(known)}
    if len(known) < 2:
        return figures
    errors = np.array([error for error, _ in known])
    covariances = np.array([covariance for _, covariance in known])
    variances = np.einsum("kii->ki", covariances)
    for name, axes in groups.items():
        chosen = list(axes)
        figures[name] = np.sqrt(np.median(variances[:, chosen].mean(axis=1)) / np.mean(errors[:, chosen] ** 2))
    in_deviations = np.abs(errors) / np.sqrt(variances)
    figures["within one"], figures["within two"] = np.mean(in_deviations < 1), np.mean(in_deviations < 2)
    squares = [error @ np.linalg.solve(covariance, error) for error, covariance in known]
    figures["mahalanobis"] = np.mean(squares) / errors.shape[1]
    return figures
