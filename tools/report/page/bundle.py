#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Bundles a script with all that it imports, or a style, by esbuild. Into an HTML page it puts the scripts and styles
that the page names, so that the page needs no other file.

    tools/report/page/bundle.py main.js OUT.js
    tools/report/page/bundle.py report.html OUT.html

Without three.js, pages show everything but the 3D views, and say what is missing.
"""
import argparse
import os
import pathlib
import re
import subprocess

THREE = pathlib.Path("/usr/share/javascript/three/three.module.js")  # Debian's libjs-three
LIBRARIES = "/usr/share/nodejs:/usr/share/javascript"  # where Debian's packages put the libraries that scripts import
FLAGS = "--bundle --minify --format=iife --target=es2020 --charset=utf8 --log-level=warning --loader:.md=text".split()


def bundle(entry, three=THREE):
    """The text of the bundle. What esbuild warns of, such as a name that no module exports, is an error."""
    given = ["--alias:three=%s" % three]
    if not three.exists():
        given = ["--alias:three=data:text/javascript,", "--log-override:import-is-undefined=silent"]
    environment = {**os.environ, "NODE_PATH": LIBRARIES}
    command = ["esbuild", str(entry), *FLAGS, *given]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", env=environment)
    if done.returncode or done.stderr:
        raise SystemExit(done.stderr)
    return done.stdout


def html(page, three=THREE):
    """The text of an HTML page with its scripts and styles in it."""
    text = page.read_text()
    for pattern, tag in (r'<link rel="stylesheet" href="(.*)">', "style"), (r'<script src="(.*)"></script>', "script"):
        text = re.sub(
            pattern, lambda found: "<%s>\n%s</%s>" % (tag, bundle(page.parent / found.group(1), three), tag), text
        )
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("entry", type=pathlib.Path, help="a script, a style or an HTML page")
    parser.add_argument("out", type=pathlib.Path, help="the file to write")
    arguments = parser.parse_args()
    if not THREE.exists():
        print("%s is missing: there will be no 3D view. Install the Debian package libjs-three." % THREE)
    make = html if arguments.entry.suffix == ".html" else bundle
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(make(arguments.entry))


if __name__ == "__main__":
    main()
