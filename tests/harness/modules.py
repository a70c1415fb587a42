# SPDX-License-Identifier: Apache-2.0
"""Modules of the pages for tests that call their functions, in a browser or in node."""
import json
import os
import subprocess

from harness import SOURCE

TOOLS = SOURCE / "tools"


def modules(**paths):
    """A script that puts modules into variables: modules(Dom="report/page/dom.js") makes one that is called Dom."""
    entry = "".join("export * as %s from './%s';" % item for item in paths.items())
    bundled = subprocess.run(
        ["esbuild", "--bundle", "--format=iife", "--global-name=modules", "--log-level=warning", "--loader:.md=text"],
        cwd=TOOLS,
        input=entry,
        capture_output=True,
        encoding="utf-8",
        check=True,
        env={**os.environ, "NODE_PATH": "/usr/share/nodejs:/usr/share/javascript"},
    ).stdout
    return "%s\nconst {%s} = modules;\n" % (bundled, ", ".join(paths))


def value(expression, given=None, **paths):
    """The value in node of an expression that may call functions of modules, and that knows `given`."""
    script = modules(**paths) + "const given = %s;\nconsole.log(JSON.stringify(%s));" % (json.dumps(given), expression)
    ended = subprocess.run(["node", "-"], input=script, capture_output=True, encoding="utf-8")
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)
