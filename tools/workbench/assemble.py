#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Joins the scripts and styles of the workbench, and those that it shares with the report, for `marrow open`.

    tools/workbench/assemble.py FOLDER     # writes index.html, workbench.js and workbench.css

The page loads these files from the server, because its policy allows no script or style in the page itself.
"""
import pathlib
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
REPORT = FOLDER.parent / "report"
THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")  # Debian's libjs-three
# In this order. Scripts of pages come before main.js, which starts them.
SCRIPTS = [
    *(REPORT / name for name in ("dom.js", "orbit.js", "graph.js")),
    *(FOLDER / name for name in ("server.js", "geometry.js", "shell.js", "home.js", "draft.js", "case.js")),
    *(FOLDER / ("place_%s.js" % name) for name in ("motion", "paint", "view", "steps", "controls", "case")),
    FOLDER / "place.js",
    FOLDER / "main.js",
]
STYLES = [REPORT / "report.css", FOLDER / "workbench.css"]


def main():
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    scripts = [THREE] * THREE.exists() + SCRIPTS
    (target / "workbench.js").write_text("\n".join(path.read_text() for path in scripts))
    (target / "workbench.css").write_text("\n".join(path.read_text() for path in STYLES))
    (target / "index.html").write_text((FOLDER / "index.html").read_text())


if __name__ == "__main__":
    main()
