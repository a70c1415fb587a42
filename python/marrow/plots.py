# SPDX-License-Identifier: Apache-2.0
"""Plots by matplotlib, for those who have it."""
import importlib
from typing import Any

from . import _core
from .errors import Error


def plot_landscape(landscape: Any, figure: Any = None) -> Any:
    """The cost along each axis in matplotlib, with a dashed line at the exact pose where it is known. `figure`: one to
    draw into. Returns the figure."""
    try:
        pyplot: Any = importlib.import_module("matplotlib.pyplot")
    except ImportError:
        raise Error("plots need matplotlib, which is missing: apt-get install python3-matplotlib") from None
    profiles = landscape.profiles
    columns = min(3, len(profiles)) or 1
    rows = -(-len(profiles) // columns) or 1
    if figure is None:
        figure = pyplot.figure(figsize=(4 * columns, 3 * rows), layout="constrained")
    for number, profile in enumerate(profiles):
        axes = figure.add_subplot(rows, columns, number + 1)
        axes.plot(profile.offsets, profile.costs)
        if profile.truth is not None:
            axes.axvline(profile.truth, color="grey", linestyle="--")
        axes.set_xlabel("%s / %s" % (profile.axis, profile.unit))
        axes.set_ylabel("cost")
    return figure


setattr(_core.Landscape, "plot", plot_landscape)
