# SPDX-License-Identifier: Apache-2.0
"""The shipped pipelines: their files, and each as a whole with what it extends and with its parts."""
import yaml

from harness import SOURCE
from harness.program import marrow

PIPELINES = SOURCE / "pipelines"


def shipped(folder=PIPELINES):
    """The files of pipelines that a user runs: those in the folders of families, sorted."""
    files = sorted(folder.glob("*/*.yaml"))
    others = ("experiments", "parts", "workbench")
    return [file for file in files if file.parent.name not in others and is_whole(yaml.safe_load(file.read_text()))]


def is_whole(content):
    return "marrow" in content and not content.get("only_inside", False)


def inputs_of(file):
    """The inputs of a pipeline, with those of the files that it extends."""
    content = yaml.safe_load(file.read_text())
    inputs = inputs_of(file.parent / content["extends"]) if "extends" in content else {}
    for name, given in content.get("inputs", {}).items():
        inputs[name] = {**inputs.get(name, {}), **(given or {})}
        if given is None:
            del inputs[name]
    return inputs


def nodes_of(file):
    """The nodes of a pipeline as a run has them: {name: {uses: ..., in: ..., with: ...}}."""
    resolved = marrow("show", file, "--resolved")
    assert resolved.returncode == 0, resolved.stderr
    return yaml.safe_load(resolved.stdout)["nodes"]
