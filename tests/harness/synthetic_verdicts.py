# SPDX-License-Identifier: Apache-2.0
"""Verdicts for the made-up runs and comparisons of synthetic.py."""
from harness.synthetic_figures import wilson

VERDICTS = {
    "trusted": (0.003, ["the grey values and the contour lead to the same pose"], []),
    "doubtful": (
        0.12,
        ["the rotation about the long axis is known to 7.1 degrees only", "half of the outline has no edge nearby"],
        ["a third view, or a landmark off the long axis"],
    ),
    "wrong": (0.84, ["the contour leads to a pose 6 mm away"], ["another start"]),
}


def add_verdict(cell, judgement):
    """A verdict on the fragment 'distal' of a cell, with its pose."""
    probability, reasons, remedies = VERDICTS[judgement]
    cell["verdict"], cell["failure_probability"] = judgement, probability
    cell["verdicts"] = [
        {
            "output": "verdict",
            "item": "distal",
            "judgement": judgement,
            "failure_probability": probability,
            "reasons": reasons,
            "remedies": remedies,
        }
    ]
    cell["poses"] = [
        {
            "name": "pose/" + item,
            "target": "world",
            "source": "ct",
            "matrix": [0.8, -0.6, 0, 12.5, 0.6, 0.8, 0, -7.25, 0, 0, 1, 803.1, 0, 0, 0, 1],
            "deviations": [0.1, 0.12, 7.1, 0.2, 0.21, 0.4],
        }
        for item in ("distal", "proximal")
    ]


def add_verdicts(data):
    """Verdicts on all cells of a comparison that are done: of each variant the first misses are trusted, and the first
    successes are not."""
    for variant, summary in enumerate(data["summary"]):
        cells = [cell for cell in data["cells"] if cell["variant"] == variant and cell["status"] == "done"]
        misses = [cell for cell in cells if not cell["success"]]
        good = [cell for cell in cells if cell["success"]]
        for i, cell in enumerate(misses):
            add_verdict(cell, "trusted" if i < variant else "wrong")
        for i, cell in enumerate(good):
            add_verdict(cell, "doubtful" if i < 3 else "trusted")
        summary["verdicts"] = {
            "cells": len(cells),
            "silent_failures": wilson(min(variant, len(misses)), len(misses)),
            "caught": len(misses) - min(variant, len(misses)),
            "false_alarms": wilson(3, len(good)),
        }
