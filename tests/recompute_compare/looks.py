# SPDX-License-Identifier: Apache-2.0
"""The levels at which a comparison is looked at while cases are added (Lan and DeMets 1983)."""
import math

import numpy
from scipy.optimize import brentq
from scipy.stats import norm

NODES, WEIGHTS = numpy.polynomial.legendre.leggauss(200)


def spent(share, alpha, is_even):
    if is_even:
        return alpha * math.log(1 + (math.e - 1) * share)
    return 4 * norm.sf(norm.isf(alpha / 4) / math.sqrt(share))


def levels(shares, alpha, is_even):
    """Two-sided levels. The test's sum is a Brownian motion; Gauss and Legendre's rule carries its density from look to
    look, as long as it stays within the bounds."""
    found, before, time = [], 0.0, 0.0
    places = masses = None
    for share in shares:
        chance, sd = spent(share, alpha, is_even) - before, math.sqrt(share - time)

        def beyond(z):
            end = z * math.sqrt(share)
            if places is None:
                return 2 * norm.sf(end / sd)
            return masses @ (norm.sf((end - places) / sd) + norm.sf((end + places) / sd))

        z = brentq(lambda z: beyond(z) - chance, 0, 40, xtol=1e-12)
        found.append(2 * norm.sf(z))
        end = min(z, 8.5) * math.sqrt(share)
        new = end * NODES
        density = norm.pdf(new, scale=sd) if places is None else norm.pdf(new[:, None] - places, scale=sd) @ masses
        places, masses = new, end * WEIGHTS * density
        before, time = spent(share, alpha, is_even), share
    return found


def looks(first, every, most):
    return sorted(set(range(first, most, every)) | {most})
