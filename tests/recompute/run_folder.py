# SPDX-License-Identifier: Apache-2.0
"""What a run has written: its nodes and wires (pipeline.yaml), and where the value of each wire lies.

A value that a wire carries is found among the outputs of the run, in the case that the run has read, or in a second
folder with further outputs of the same pipeline (further_outputs.py)."""
import dataclasses
import json
import pathlib

from figures import NotRecomputed
from values import read_yaml


class Missing(Exception):
    """A value that no folder holds. Its text is the reference, such as `model` or `pose.stages`."""


@dataclasses.dataclass
class Node:
    name: str
    uses: str
    wires: dict
    options: dict


def nodes_of(pipeline):
    return {
        name: Node(name, node.get("uses", ""), node.get("in") or {}, node.get("with") or {})
        for name, node in pipeline["nodes"].items()
    }


class Run:
    def __init__(self, folder, further=None, case=None):
        self.folder, self.case = pathlib.Path(folder), case
        self.pipeline = read_yaml(self.folder / "pipeline.yaml")
        self.record = json.loads((self.folder / "run.json").read_text())
        self.nodes = nodes_of(self.pipeline)
        self.bodies = {name: node for name, node in self.pipeline["nodes"].items() if "repeat" in node}
        self.files = self.outputs_of(self.folder)  # reference: {item: file}
        self.further = {}
        if further:
            more = self.outputs_of(pathlib.Path(further))
            self.further = {reference: files for reference, files in more.items() if reference not in self.files}

    def made(self):
        """References to all values that the nodes have made."""
        nodes = self.record["nodes"]  # those of a body have its name and a slash before their own
        done = [node for node in nodes if node["status"] == "done" and "/" not in node["id"]]
        made = ["%s.%s" % (node["id"], port) for node in done for port in node.get("keys", {})]
        return [reference for reference in made if ".last_" not in reference]  # the same as that of the last pass

    def outputs_of(self, folder):
        references = read_yaml(folder / "pipeline.yaml")["outputs"]
        record = json.loads((folder / "run.json").read_text())
        return {
            self.whole(references[output["name"]]): dict(
                zip((item for item, _ in output["items"]), (folder / file for file in output["files"]))
            )
            for output in record["outputs"]
            if output.get("files")
        }

    def whole(self, reference):
        """With the port, where a node has only one and the pipeline leaves it out."""
        if "." in reference:
            return reference
        ports = next((node.get("keys", {}) for node in self.record["nodes"] if node["id"] == reference), {})
        return "%s.%s" % (reference, next(iter(ports))) if len(ports) == 1 else reference

    def inside(self, reference):
        """(node, port) that make a value. In a body, the wires become those of the whole pipeline: what was given to
        the body, or an output of it, which may have to be added (further_outputs.py)."""
        name, _, port = self.whole(reference).partition(".")
        if name not in self.bodies:
            return self.nodes[name], port.partition(".")[0]
        body = self.bodies[name]
        inner = nodes_of(body["repeat"])
        made = body["repeat"]["outputs"]
        added = {for_output(wire): wire for node in inner.values() for wire in node.wires.values()}
        inner_name, _, inner_port = (added | made)[port.removeprefix("last_")].partition(".")
        node = inner[inner_name]
        shown = {value: "%s.%s" % (name, key) for key, value in made.items()}
        given = body.get("in") or {}
        wires = {
            port: given.get(wire) or shown.get(wire) or "%s.%s" % (name, for_output(wire))
            for port, wire in node.wires.items()
        }
        return dataclasses.replace(node, wires=wires), inner_port

    def wire(self, node, port):
        """The reference that an input takes; None if it is not wired. `projector.model` is the model of the node that
        is wired to the projector, and `@model` stands for the reference itself."""
        if port[0] == "@":
            return port[1:]
        first, _, then = port.partition(".")
        wire = node.wires.get(first)
        return self.wire(self.inside(wire)[0], then) if wire and then else wire

    def values(self, reference):
        """{item: file} of a wire."""
        reference = self.whole(reference)
        for known in (self.files, self.further):
            if reference in known:
                return known[reference]
        parts = reference.split(".")
        if len(parts) > 2:  # one item of a list
            files = self.values(".".join(parts[:2]))
            item = ".".join(parts[2:])
            if item in files:
                return {"": files[item]}
        name, _, port = reference.partition(".")
        in_case = self.nodes[name].uses == "read.case" and self.of_case(name, port)
        if in_case:
            return in_case
        raise Missing(reference)

    def option(self, name):
        """The value of an option that the nodes of the run agree on."""
        nodes = list(self.nodes.values())
        for body in self.bodies.values():
            nodes += nodes_of(body["repeat"]).values()
        values = {node.options[name] for node in nodes if name in node.options}
        if len(values) != 1:
            raise Missing("one value of '%s'" % name)
        return values.pop()

    def verdict_file(self, output, item):
        """The file of a verdict that the run's record lists."""
        return self.files[self.whole(self.pipeline["outputs"][output])][item]

    def file_of(self, path):
        """A file that an option names; relative to the pipeline in the run's folder."""
        return self.folder / path

    def of_case(self, name, port):
        """{item: what the case's own files say} of the nodes that read cases."""
        folder = pathlib.Path(self.case or self.nodes[name].options["path"])
        case = read_yaml(folder / "case.yaml")
        if port == "truth":
            return {item: one["truth"] for item, one in case["fragments"].items() if "truth" in one}
        if port == "ct" and str(case["ct"]).endswith(".mha"):
            return {"": folder / case["ct"]}
        if port == "views":
            views = {view["name"]: view for view in case["views"]}
            if all(is_plain_camera(folder, view["camera"]) for view in views.values()):
                return {name: {key: folder / view[key] for key in ("camera", "image")} for name, view in views.items()}
        return {}


def is_plain_camera(folder, camera):
    """Whether a case gives a camera by its matrices alone. Others are taken as marrow has read them."""
    is_file = isinstance(camera, str) and camera.endswith(".yaml")
    values = read_yaml(folder / camera) if is_file else {}
    return "camera_from_world" in values and "radial_distortion" not in values


def for_output(reference):
    """The name of an output that is added for a reference."""
    return "for_" + reference.replace(".", "_").replace("/", "_")  # nodes of parts have a slash


class Options(dict):
    """The options of a node. Another version of it may have others."""

    def __missing__(self, name):
        raise NotRecomputed("the node of this run has no option '%s'" % name)


class Call:
    """One call of a node: the values of its inputs, for the item that it has made."""

    def __init__(self, run, node, item, file, printed):
        self.run, self.node, self.item = run, node, item
        self.file, self.printed = file, printed
        self.parts = [part for part in item.split("/") if part]
        self.options = Options(node.options)

    def beside(self, port):
        """The file of another output of the same call."""
        return self.run.values("%s.%s" % (self.node.name, port))[self.item]

    def has(self, port):
        return port in self.node.wires

    def files(self, port):
        wire = self.run.wire(self.node, port)
        if not wire:
            raise Missing("the input '%s', which is not wired" % port)
        return self.run.values(wire)

    def one(self, port, read):
        """The value of an input that takes one item."""
        files = self.files(port)
        fitting = [item for item in files if set(filter(None, item.split("/"))) <= set(self.parts)]
        if len(fitting) != 1:
            raise Missing("%s for %s" % (self.run.wire(self.node, port), self.item or "the run"))
        return read(files[fitting[0]])

    def all(self, port, read):
        """The values of all items of an input, by their whole names."""
        return {item: read(file) for item, file in self.files(port).items()}

    def many(self, port, read):
        """The values of an input that takes a list, by the names of its items."""
        result = {}
        for item, file in self.files(port).items():
            others = [part for part in item.split("/") if part not in self.parts]
            if len(others) == 1 and len(item.split("/")) - 1 <= len(self.parts):
                result[others[0]] = read(file)
        return result
