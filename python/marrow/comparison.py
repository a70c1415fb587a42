# SPDX-License-Identifier: Apache-2.0
"""Comparisons of variants, as `marrow compare` makes them."""
import json
import os
import pathlib
from typing import Any, Dict, List, Union

from . import _core, program
from .pipeline import checked_pipeline
from .tables import Table


class Comparison:
    """The answer of a comparison, as tables.

    cells: one row for each run. variants: one row for each variant and figure; count of `of` runs have the figure.
    differences: one row for each variant and figure, compared with the baseline. What is not known is None, such as the
    success rate of an experiment without limits, or an interval of too few cases.
    """

    def __init__(self, folder: Union[str, "os.PathLike[str]"]) -> None:
        self.folder = pathlib.Path(folder)
        with open(self.folder / "cells.jsonl", encoding="utf-8") as file:
            self.cells = Table(_cell(json.loads(line)) for line in file)
        answer = json.loads((self.folder / "comparison.json").read_text(encoding="utf-8"))
        self.variants = Table(_variants(answer))
        self.differences = Table(answer["comparisons"])

    @property
    def report(self) -> pathlib.Path:
        """The page with all figures and pictures."""
        return self.folder / "report.html"

    @property
    def sentences(self) -> List[str]:
        """What is to be said of each variant."""
        return [row["sentence"] for row in self.differences]

    def _repr_html_(self) -> str:
        return self.variants._repr_html_() + self.differences._repr_html_()

    def __repr__(self) -> str:
        return "<marrow.Comparison of %d runs in %s>" % (len(self.cells), self.folder)


def compare(
    file: Union[str, "os.PathLike[str]"],
    *,
    folder: Union[None, str, "os.PathLike[str]"] = None,
    jobs: int = 0,
    threads: int = 1,
    time_limit_s: float = 600,
    memory_limit_mb: float = 4000,
    keep: bool = True,
    progress: bool = False,
) -> Comparison:
    """Runs an experiment file and returns its tables. A comparison that was interrupted goes on where it stopped.

    folder: new, or one to be continued; None for runs/compare/NAME. jobs: runs at once; 0 for all processors.
    threads: of each run. Raises PipelineError with all faults of the file.
    """
    name = checked_pipeline(_core.read_experiment(os.fspath(file)))
    place = pathlib.Path(folder) if folder is not None else pathlib.Path("runs", "compare", name)
    arguments = ["compare", os.fspath(file), "--out", str(place), "--threads", str(threads)]
    arguments += ["--time-limit", str(time_limit_s), "--memory-limit", str(memory_limit_mb)]
    if jobs:
        arguments += ["--jobs", str(jobs)]
    if not keep:
        arguments.append("--no-cache")
    if not progress:
        arguments.append("--quiet")
    program.call(arguments, progress)
    return Comparison(place)


def _cell(row: Dict[str, Any]) -> Dict[str, Any]:
    """A row without the parts that are tables of their own."""
    return {name: value for name, value in row.items() if not isinstance(value, (dict, list))}


# Of a figure where higher is better, p5 is the value that 95 % of the runs reach; of the others, p95.
_FIGURES = ("count", "of", "median", "median_low", "median_high", "q1", "q3", "p95", "p5", "worst", "mean")


def _variants(answer: Dict[str, Any]) -> List[Dict[str, Any]]:
    rows = []
    for variant in answer["variants"]:
        success = variant["success"] or {}
        for metric in answer["metrics"]:
            figures = variant["metrics"][metric["name"]]
            row = {"variant": variant["name"], "metric": metric["name"], "unit": metric["unit"]}
            row.update({name: variant[name] for name in ("runs", "failed", "incomplete")})
            row.update({"success_" + name: success.get(name) for name in ("rate", "low", "high")})
            row.update({name: figures.get(name) for name in _FIGURES})
            rows.append(row)
    return rows
