# SPDX-License-Identifier: Apache-2.0
"""Made sequences for tests of `marrow curves`."""
import json

from harness.program import Case


def table(path, columns):
    """A CSV file of lists; None is an empty cell."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = zip(*columns.values())
    cells = ["" if value is None or value != value else repr(float(value)) for row in rows for value in row]
    width = len(columns)
    lines = [",".join(cells[i : i + width]) for i in range(0, len(cells), width)]
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    return path


class Curves(Case):
    def curves(self, *arguments):
        result = self.marrow("curves", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def answer_of(self, *arguments):
        return json.loads(self.curves(*arguments, "--json"))

    def compared(self, *arguments):
        """The figures of the only comparison, by their names."""
        (one,) = self.answer_of(*arguments)["sequences"]
        return {figure["name"]: figure for figure in one["figures"]}

    def refused(self, *arguments):
        result = self.marrow("curves", *arguments)
        self.assertEqual(result.returncode, 2, result.stdout)
        return result.stderr
