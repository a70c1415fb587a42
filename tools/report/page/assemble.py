#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Joins the template, style, scripts, three.js and the data of a report into one HTML file that needs no other file.

    tools/report/page/assemble.py data.json report.html
    tools/report/page/assemble.py --page page.html          # without data, as it is built into marrow

The markers of the template, <!-- marrow:style NAME -->, <!-- marrow:script NAME --> and <!-- marrow:data -->, are
replaced by the files or the data. So the template also gives the order of the scripts.
"""
import argparse
import json
import pathlib
import re
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")  # Debian's libjs-three


def script(path):
    text = path.read_text()
    if re.search(r"</script|<!--", text, re.IGNORECASE):
        raise SystemExit("%s contains '</script' or '<!--', which would end the script too early" % path)
    return "<script>\n%s</script>" % text


def assemble(data, three=THREE):
    """The text of the page. If `data` is None, its marker for data stays. Without three.js, the page shows everything
    but the 3D view, and says what is missing."""

    def part(marker):
        kind, name = marker.group(1), marker.group(2)
        if kind == "data" and data is None:
            return marker.group(0)
        if kind == "data":
            return '<script type="application/json" id="data">%s</script>' % json.dumps(
                data, separators=(",", ":"), allow_nan=False
            ).replace("<", "\\u003c")
        if kind == "style":
            return "<style>\n%s</style>" % (FOLDER / name).read_text()
        path = three if name == "three.min.js" else FOLDER / name
        return script(path) if path.exists() or path != three else ""

    return re.sub(r"<!-- marrow:(data|style|script)(?: (\S+))? -->", part, (FOLDER / "report.html").read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path, nargs="?", help="JSON, as data.js describes it")
    parser.add_argument("report", type=pathlib.Path, nargs="?", help="the HTML file to write")
    parser.add_argument("--page", type=pathlib.Path, help="write the page without data here")
    parser.add_argument("--three", type=pathlib.Path, default=THREE, help="three.min.js (default: %(default)s)")
    arguments = parser.parse_args()
    if not arguments.page and not arguments.report:
        parser.error("give data and report, or --page")
    if not arguments.three.exists():
        print(
            "%s is missing: reports will have no 3D view. Install the Debian package libjs-three or give --three."
            % arguments.three,
            file=sys.stderr,
        )
    data = None if arguments.page else json.loads(arguments.data.read_text())
    (arguments.page or arguments.report).write_text(assemble(data, arguments.three))


if __name__ == "__main__":
    main()
