# SPDX-License-Identifier: Apache-2.0
"""Comparisons of variants, as `marrow compare` makes them."""
import json
import os
import pathlib
from typing import Any, Dict, List, Union

from . import _core, program
from .pipeline import checked_pipeline
from .tables import Table

__all__ = ["Comparison", "compare"]


class Comparison:
    """The answer of a comparison, as tables.

    cells: one row for each run. variants: one row for each variant and figure. differences: one row for each variant
    and figure, compared with the baseline.
    """

    def __init__(self, folder: Union[str, "os.PathLike[str]"]) -> None:
        self.folder = pathlib.Path(folder)
        with open(self.folder / "cells.jsonl", encoding="utf-8") as file:
            self.cells = Table(_cell(json.loads(line)) for line in file)
        answer = json.loads((self.folder / "comparison.json").read_text(encoding="utf-8"))
        self.variants = Table(_variants(answer["variants"]))
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


def _variants(variants: List[Dict[str, Any]]) -> List[Dict[str, Any]]:
    rows = []
    for variant in variants:
        for metric, figures in variant["metrics"].items():
            success = {"success_" + name: variant["success"][name] for name in ("rate", "low", "high")}
            start = {"variant": variant["name"], "metric": metric, "runs": variant["runs"], "failed": variant["failed"]}
            rows.append({**start, **success, **figures})
    return rows
