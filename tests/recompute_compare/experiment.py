# SPDX-License-Identifier: Apache-2.0
"""An experiment whose figures are known: what it compares, the table that its plugin reads, and what its cells are."""
import dataclasses
from fractions import Fraction
from typing import Dict, List, Optional, Tuple

FAILS = ("fail", "crash")


@dataclasses.dataclass
class Metric:
    node: str  # "main"; "may", which may fail
    name: str
    label: str
    better: str
    unit: str
    limit: Optional[float] = None

    @property
    def path(self):
        return self.node + "." + self.name

    @property
    def higher_is_better(self):
        return self.better == "higher"


@dataclasses.dataclass
class Variant:
    name: str
    column: str
    swept: List[float] = dataclasses.field(default_factory=list)  # the value of main.at, if it is swept
    swept_from: str = ""
    levels: List[int] = dataclasses.field(default_factory=list)  # of each of the experiment's factors
    other: Optional[str] = None  # the value of main.other, if the matrix varies it


@dataclasses.dataclass
class Row:
    variant: str
    case: str
    start: str
    failed: bool = False
    values: List[Optional[Fraction]] = dataclasses.field(default_factory=list)
    initial_error: Optional[Fraction] = None
    verdict: Optional[str] = None
    failure_probability: Optional[float] = None
    evaluations: int = 0
    tries: int = 1
    success: Optional[bool] = None  # None without limits

    @property
    def id(self):
        return "/".join((self.variant, self.case, self.start))


@dataclasses.dataclass
class Experiment:
    name: str
    metrics: List[Metric]
    variants: List[Variant]
    cases: List[str]
    starts: List[float]  # the displacement of each
    table: Dict[Tuple[str, str, int], Dict[str, str]]  # by case, column and start: name and text
    baseline: int = 0
    compare_all: bool = False
    factors: List[Tuple[str, List[str]]] = dataclasses.field(default_factory=list)  # of the matrix: name and levels
    has_initial_error: bool = False
    has_verdict: bool = False
    timed_cells: int = 0
    stop: Optional[dict] = None
    sweep: Optional[dict] = None
    tune: Optional[dict] = None
    most_cases: int = 0  # of which the table has lines, where cases are seeds

    @property
    def has_seeds(self):
        return self.stop is not None or self.tune is not None

    @property
    def has_limits(self):
        return any(metric.limit is not None for metric in self.metrics)

    def row(self, variant, case, start):
        """What the cell is, by the documented rules."""
        row = Row(variant.name, case, str(start))
        texts = self.table[case, variant.column, start]
        others = self.table[case, variant.column + variant.other, start] if variant.other else texts  # of main
        row.success = False if self.has_limits else None
        names = {node: [m.name for m in self.metrics if m.node == node] for node in ("main", "may")}
        names["main"] += ["start_error"] if self.has_initial_error else []
        of = {node: [(others if node == "main" else texts)[name] for name in own] for node, own in names.items()}
        may_failed = any(text in FAILS for text in of["may"])
        row.failed = any(text in FAILS + ("nan", "absent") for text in of["main"])
        row.failed |= not may_failed and any(text in ("nan", "absent") for text in of["may"])
        row.tries = 2 if "crash" in of["main"] + of["may"] else 1
        if row.failed:
            row.values = [None] * len(self.metrics)
            return row
        at = Fraction(variant.swept[0]) if variant.swept else Fraction(0)
        for metric in self.metrics:
            text = (others if metric.node == "main" else texts)[metric.name]
            value = None if metric.node == "may" and may_failed else Fraction(text.split()[0])
            if value is not None and metric.node == "main" and metric.name == names["main"][0]:
                value += at * at
            row.values.append(abs(value) if value is not None and metric.better == "nearest_zero" else value)
        row.evaluations = int(texts["evaluations"])
        if self.has_initial_error:
            row.initial_error = Fraction(texts["start_error"].split()[0])
        if self.has_verdict:
            judgement, *percent = texts["verdict"].split()
            row.verdict, row.failure_probability = judgement, float(percent[0]) / 100 if percent else None
        if self.has_limits:
            row.success = all(
                value is not None and (value > metric.limit if metric.higher_is_better else value < metric.limit)
                for metric, value in zip(self.metrics, row.values)
                if metric.limit is not None
            )
        return row

    def rows(self, cases=None, variants=None):
        """Of all cells, by case, start and variant."""
        return [
            self.row(variant, case, start)
            for case in (self.cases if cases is None else cases)
            for start in range(len(self.starts))
            for variant in (self.variants if variants is None else variants)
        ]
