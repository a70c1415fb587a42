#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Joins the template, style, scripts, three.js and a report's data into one HTML file that needs nothing else.

    tools/report/assemble.py data.json report.html

The scripts may stand in any order: each only defines things, and main.js starts when the page has been read.
"""
import argparse
import json
import pathlib
import re
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")  # Debian's libjs-three


def script(text, name):
    if re.search(r"</script|<!--", text, re.IGNORECASE):
        raise SystemExit("%s contains '</script' or '<!--', which would end the script too early" % name)
    return "<script>\n%s</script>\n" % text


def assemble(data, three=THREE):
    """The page's text. Without three.js the page says what is missing and shows all but the 3D view."""
    page = (FOLDER / "report.html").read_text()
    scripts = [path for path in [three] if path and path.exists()] + sorted(FOLDER.glob("*.js"))
    parts = {
        "style": "<style>\n%s</style>" % (FOLDER / "report.css").read_text(),
        "scripts": "".join(script(path.read_text(), path.name) for path in scripts),
        "data": '<script type="application/json" id="data">%s</script>' % json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
    }
    for name, text in parts.items():
        page = page.replace("<!-- marrow:%s -->" % name, text, 1)
    return page


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path, help="JSON, as data.js describes it")
    parser.add_argument("report", type=pathlib.Path, help="the HTML file to write")
    parser.add_argument("--three", type=pathlib.Path, default=THREE, help="three.min.js (default: %(default)s)")
    arguments = parser.parse_args()
    if not arguments.three.exists():
        print("%s is missing: the report will have no 3D view. Install the Debian package libjs-three or give --three." % arguments.three, file=sys.stderr)
    arguments.report.write_text(assemble(json.loads(arguments.data.read_text()), arguments.three))


if __name__ == "__main__":
    main()
