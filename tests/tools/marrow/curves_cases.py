# SPDX-License-Identifier: Apache-2.0
"""Made sequences for tests of `marrow curves`."""
from harness.program import Case


class Curves(Case):
    def table(self, name, columns):
        """A CSV file of lists; None is an empty cell."""
        cell = lambda value: "" if value is None or value != value else repr(float(value))
        lines = [",".join(map(cell, row)) for row in zip(*columns.values())]
        return self.write(name, "\n".join([",".join(columns), *lines]) + "\n")

    def two(self, first, second):
        """The names of their files."""
        self.table("a.csv", first)
        self.table("b.csv", second)
        return "a.csv", "b.csv"

    def curves(self, *arguments):
        return self.printed("curves", *arguments)

    def answer_of(self, *arguments):
        return self.json_of("curves", *arguments)

    def compared(self, *arguments):
        """The figures of the only comparison, by their names."""
        (one,) = self.answer_of(*arguments)["sequences"]
        return {figure["name"]: figure for figure in one["figures"]}
