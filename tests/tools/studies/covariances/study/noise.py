#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws noise, and compares the errors of poses with the covariances that they come with: of each cost with 1, 2 and 3
views, and of each other node that gives a covariance. Prints a table. A draw has its own seed, so the table is the same
with any number of jobs.

    PYTHONPATH=build/python tests/tools/studies/covariances/study/noise.py                    # 20 draws each
    PYTHONPATH=build/python tests/tools/studies/covariances/study/noise.py --draws 200 --jobs 8
    PYTHONPATH=build/python tests/tools/studies/covariances/study/noise.py contour --draws 50 # with this name

Right are: ratios of 1 (predicted over real, both as root mean squares), 68 and 95 % of the errors within one and two
deviations, and a squared Mahalanobis distance of 1 for each degree of freedom. A ratio of n draws of one axis is known
to about 0.7 / sqrt(n) of itself.
"""
import argparse
import functools
import multiprocessing

import cameras
import costs
import figures
import fits
import numpy as np

import marrow

CAMERA = {"focal lengths": (0, 1), "principal point": (2, 3)}
VIEWS = (1, 2, 3)


def studies():
    """Functions of a random generator by their names. Each returns an error and its covariance."""
    found = {}
    for name in costs.names():
        for views in VIEWS:
            found["%s, %d view%s" % (name, views, "s" * (views > 1))] = functools.partial(costs.draw, name, views)
    found.update(fits.FITS)
    found.update(cameras.FITS)
    return found


def draw(task):
    """One draw; None if no pose was found."""
    name, seed, number = task
    try:
        return studies()[name](np.random.default_rng([seed, number]))
    except marrow.Error:
        return None


def row(name, draws):
    found = [one for one in draws if one is not None]
    groups = CAMERA if name.startswith("camera.") else figures.GROUPS
    of = figures.of(found, groups)
    counts = "%d / %d / %d" % (len(draws), len(found), of["known"])
    if "mahalanobis" not in of:
        return [name, counts] + ["-"] * 6
    ratios = ["%.2f" % of[group] for group in groups] + ["-"] * (4 - len(groups))
    within = "%.0f, %.0f %%" % (100 * of["within one"], 100 * of["within two"])
    return [name, counts] + ratios + [within, "%.2f" % of["mahalanobis"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="only what has one of these in its name")
    parser.add_argument("--draws", type=int, default=20, help="number of draws of each (default 20)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="number of processes (default 1)")
    arguments = parser.parse_args()
    header = ["of", "draws / poses / known", *figures.GROUPS, "within one, two", "Mahalanobis^2 / dof"]
    print("| %s |\n|---|%s" % (" | ".join(header), "---:|" * (len(header) - 1)), flush=True)
    with multiprocessing.get_context("spawn").Pool(arguments.jobs) as pool:
        for name in studies():
            if arguments.names and not any(one in name for one in arguments.names):
                continue
            tasks = [(name, arguments.seed, number) for number in range(arguments.draws)]
            print("| %s |" % " | ".join(row(name, pool.map(draw, tasks, chunksize=1))), flush=True)


if __name__ == "__main__":
    main()
