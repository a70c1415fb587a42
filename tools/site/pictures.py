# SPDX-License-Identifier: Apache-2.0
"""A picture for each node of a kind: a pipeline in docs/pictures, run with each node that fits in place of its node
`shown`. The name of the file begins with the kind. Its help is the legend."""
import concurrent.futures
import json
import shutil
import struct
import subprocess

import yaml

# Types of outputs that are written as a picture.
PICTURES = {"picture", "image", "view", "edge_map"}
WRONG_VERDICT = 3  # marrow ends with it, but everything was made
AT_ONCE = 2


def kind_of(file):
    return file.stem.split("-")[0]


def files(root):
    return sorted((root / "docs" / "pictures").glob("*.yaml"))


def nodes_that_fit(marrow, file, catalogue):
    """The node that is `shown` in the file, and the others of the kind that fit there and end in a picture."""
    content = yaml.safe_load(file.read_text())
    shown = content["nodes"]["shown"]["uses"]
    told = subprocess.run(
        [marrow, "list", "--fits", file, "shown", "--json"], capture_output=True, text=True, check=True
    )
    fitting = [fit["node"] for fit in json.loads(told.stdout) if fit["fits"] == "yes"]
    names = [name for name in fitting if name.split(".")[0] == kind_of(file)]
    if content["outputs"]["picture"].split(".")[0] == "shown":
        names = [name for name in names if PICTURES & {port["type"] for port in catalogue.nodes[name]["outputs"]}]
    return [shown, *names], " ".join(content["help"].split())


def run(marrow, folder, file, *arguments):
    """The folder of the outputs of a run, or the first error that it ends with."""
    shutil.rmtree(folder, ignore_errors=True)
    command = [marrow, "run", file, *arguments, "--out", folder, "--quiet"]
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if result.returncode not in (0, WRONG_VERDICT):
        return None, result.stderr.strip().splitlines()[:1]
    return folder / "outputs", None


def make_one(marrow, folder, file, name, case):
    """(path of the picture, or None; why there is none)."""
    needs_case = "case" in (yaml.safe_load(file.read_text()).get("inputs") or {})
    inputs = ["case=%s" % case] if needs_case else []
    settings = ["--set", "shown.uses=" + name, "--only", "picture"]
    outputs, fault = run(marrow, folder / "runs" / name, file, *inputs, *settings)
    if fault is not None:
        return None, fault[0] if fault else "the run failed"
    found = sorted(outputs.rglob("*.png"))
    if not found:
        return None, "it made no picture"
    place = folder / (name + ".png")
    shutil.copy(found[0], place)
    return place, None


def is_wide(path):
    """Whether a PNG is more than 1.5 times as wide as it is high."""
    width, height = struct.unpack(">II", path.read_bytes()[16:24])
    return width > 1.5 * height


def make(marrow, root, catalogue, folder):
    """Makes folder/NAME.png for all nodes that can have one. Returns {name: (file, legend, whether it is
    much wider than high)} and [why a node has none]."""
    folder.mkdir(parents=True, exist_ok=True)
    outputs, fault = run(marrow, folder / "runs" / "case", root / "pipelines" / "simulate" / "simulate.yaml")
    if fault is not None:
        return {}, fault
    tasks = {}
    for file in files(root):
        names, legend = nodes_that_fit(marrow, file, catalogue)
        for name in names:
            tasks.setdefault(name, (file, legend))
    found, without = {}, []
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        makes = {
            name: pool.submit(make_one, marrow, folder, file, name, outputs / "case")
            for name, (file, _) in tasks.items()
        }
        for name, made in makes.items():
            path, why = made.result()
            if path:
                found[name] = (path.name, tasks[name][1], is_wide(path))
            else:
                without.append("%s: %s" % (name, why))
    shutil.rmtree(folder / "runs", ignore_errors=True)
    return found, without
