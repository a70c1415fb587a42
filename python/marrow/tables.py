# SPDX-License-Identifier: Apache-2.0
"""Tables as lists of dictionaries."""
import html
from typing import Any, Dict, List


class Table(List[Dict[str, Any]]):
    """Rows, each a dictionary with the same keys. In a notebook it is shown as a table."""

    def to_pandas(self) -> Any:
        """The rows as a pandas.DataFrame; needs pandas (Debian: python3-pandas)."""
        import pandas  # type: ignore[import]

        return pandas.DataFrame(list(self))

    def _repr_html_(self) -> str:
        if not self:
            return "<p>no rows</p>"
        columns = list(self[0])
        head = "".join("<th>%s</th>" % html.escape(column) for column in columns)
        rows = ("<tr>%s</tr>" % "".join("<td>%s</td>" % shown(row.get(column)) for column in columns) for row in self)
        return "<table><tr>%s</tr>%s</table>" % (head, "".join(rows))


def shown(value: Any) -> str:
    """A value of a cell as HTML."""
    if value is None:
        return ""
    return html.escape("%.4g" % value if isinstance(value, float) else str(value))
