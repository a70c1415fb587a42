# SPDX-License-Identifier: Apache-2.0
"""How the nodes are called that run programs: each copies a file of its output's type, by a script."""
from files_of_scene import written
from harness.package import SCRATCH

# It lasts long enough that a limit of its time or memory is noticed.
COPY = "import shutil, sys, time\ntime.sleep(0.3)\nshutil.copy(sys.argv[1], sys.argv[2])\n"
FORMATS = {"field": "mha", "image": "png", "mesh": "ply", "metrics": "json", "volume": "mha"}


def copied(name):
    script, figures = SCRATCH / "copy.py", SCRATCH / "figures.json"
    script.write_text(COPY)
    figures.write_text('{"a": 1}')
    case = written() / "case"
    sources = {"mesh": written() / "model.ply", "metrics": figures, "image": case / "frontal.png"}
    options = {
        "command": ["python3", "{files.1}", "{files.2}", "{output.%s}" % FORMATS[name]],
        "version_command": ["python3", "--version"],
        "files": [str(script), str(sources.get(name, case / "ct.mha"))],
    }
    return lambda: ({}, options)


def calls(s):
    return {"run.program_" + name: copied(name) for name in FORMATS}
