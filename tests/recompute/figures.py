# SPDX-License-Identifier: Apache-2.0
"""Figures as they are printed and as they are recomputed, and the table of both."""
import dataclasses
import math


@dataclasses.dataclass
class Expected:
    """A recomputed figure, and how far the printed one may be from it."""

    value: object  # a number, or a word
    allowed: float


def exactly(value):
    """For figures that both programs compute from the same numbers: what rounding leaves."""
    return value if isinstance(value, str) else Expected(float(value), 1e-9 + 1e-6 * abs(value))


def within(value, allowed):
    return Expected(float(value), float(allowed) + 1e-9 + 1e-6 * abs(value))


class NotRecomputed(Exception):
    """Why a figure cannot be recomputed."""


@dataclasses.dataclass
class Row:
    place: str  # output and item
    name: str
    printed: object
    expected: object  # Expected, a word, or None
    reason: str = ""  # why it is not recomputed

    def is_recomputed(self):
        return self.expected is not None

    def difference(self):
        if isinstance(self.expected, str) or isinstance(self.printed, str) or self.printed is None:
            return 0.0 if self.printed == self.expected else math.inf
        if math.isnan(self.expected.value) or math.isnan(self.printed):
            return 0.0 if math.isnan(self.expected.value) and math.isnan(self.printed) else math.inf
        return abs(self.printed - self.expected.value)

    def is_right(self):
        if self.difference() == 0:  # both may be unknown
            return True
        return not isinstance(self.expected, str) and self.difference() <= self.expected.allowed


def rows_of(place, printed, expected, reason):
    """Rows of the figures of one value. A figure that is expected but not printed is a wrong one."""
    rows = [Row(place, name, value, expected.get(name), reason) for name, value in printed.items()]
    return rows + [Row(place, name, None, value) for name, value in expected.items() if name not in printed]


def shown(value):
    return value if isinstance(value, str) else "-" if value is None else "%.7g" % value


def table(rows):
    """Lines of text: the recomputed figures, then the names of the others."""
    lines = ["%-44s %-34s %14s %14s %10s %10s" % ("value", "figure", "marrow", "recomputed", "apart", "allowed")]
    for row in rows:
        if row.is_recomputed():
            is_word = isinstance(row.expected, str)
            numbers = (row.expected, "") if is_word else (shown(row.expected.value), "%.2g" % row.expected.allowed)
            columns = (row.place, row.name, shown(row.printed), numbers[0], "%.2g" % row.difference(), numbers[1])
            lines.append("%-44s %-34s %14s %14s %10s %10s" % columns + ("" if row.is_right() else "  DIFFERENT"))
    others = {}
    for row in rows:
        if not row.is_recomputed():
            others.setdefault((row.place, row.reason), []).append(row.name)
    for (place, reason), names in others.items():
        lines.append("not recomputed: %s: %s: %s" % (place, ", ".join(names), reason))
    recomputed = [row for row in rows if row.is_recomputed()]
    wrong = [row for row in recomputed if not row.is_right()]
    counts = (len(recomputed), len(wrong), len(rows) - len(recomputed))
    lines.append("%d figures recomputed, %d of them different; %d not recomputed" % counts)
    return lines
