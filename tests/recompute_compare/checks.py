# SPDX-License-Identifier: Apache-2.0
"""Counts the figures that were compared, by kind, and keeps those that differ."""
import collections
import math


class Checks:
    """`where` names the experiment that is looked at; it stands before each difference."""

    def __init__(self):
        self.counts = collections.Counter()
        self.differences = []
        self.where = ""

    def _note(self, kind, is_same, what, got, expected):
        self.counts[kind] += 1
        if not is_same:
            self.differences.append("%s: %s: %s: got %r, expected %r" % (self.where, kind, what, got, expected))

    def same(self, kind, what, got, expected):
        """Texts, counts, truth values, lists of these, or None."""
        self._note(kind, type(got) is type(expected) and got == expected, what, got, expected)

    def close(self, kind, what, got, expected, relative=1e-9, absolute=0.0):
        """Numbers; None where there is none."""
        if got is None or expected is None or isinstance(got, str):
            is_same = got is None and expected is None
        elif math.isinf(expected):
            is_same = got == expected
        else:
            is_same = abs(got - expected) <= max(relative * abs(expected), absolute)
        self._note(kind, is_same, what, got, expected if expected is None else float(expected))

    def shown(self, kind, what, text, expected, may_be_zero=False):
        """A number in words or in a table: no further from the value than it is rounded, and 0 only where that is 0."""
        try:
            got = float(text)
        except ValueError:
            return self._note(kind, False, what, text, expected)
        half = 0.5 * unit_of_last_place(text)
        is_zero = got == 0 and expected != 0 and not may_be_zero
        self._note(kind, abs(got - expected) <= half + 1e-9 * abs(expected) and not is_zero, what, text, expected)

    def percent(self, kind, what, text, share):
        """The same of a share in percent, which is also 100 only where it is."""
        self.shown(kind, what, text, 100 * share)
        self.that(kind, what + ", whether it is all", (float(text) == 100) == (share == 1), text)

    def report(self):
        lines = self.differences + ["%-26s %7d" % one for one in sorted(self.counts.items())]
        total = sum(self.counts.values())
        return "\n".join(lines + ["%d figures recomputed, %d of them different" % (total, len(self.differences))])

    def that(self, kind, what, holds, got):
        self._note(kind, bool(holds), what, got, "")


def unit_of_last_place(text):
    """0.01 for "1.25", 1 for "7", 1000 for "1.250e+06"."""
    number, _, power = text.lower().partition("e")
    decimals = len(number.partition(".")[2])
    return 10.0 ** (int(power or 0) - decimals)
