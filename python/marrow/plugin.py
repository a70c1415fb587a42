# SPDX-License-Identifier: Apache-2.0
"""The process that holds the nodes of one Python file. marrow starts it, and asks it for one thing at a time:

python3 -m marrow.plugin FILE

It reads requests and writes reports and answers as marrow/runtime/worker.hpp says.
"""
import importlib
import json
import os
import pathlib
import signal
import sys
import threading
import traceback
from types import FrameType, ModuleType
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy

from . import _core, functions
from .context import Context
from .declaration import Declaration, completed, nodes_of
from .errors import Error
from .items import Items
from .modules import import_from_source, loaded_files

_MADE = 3  # the descriptor through which values are handed over
_REPLIES = 4  # the descriptor from which the replies to questions are read
_MODULE = "marrow_python_nodes"


class Process:
    def __init__(self, file: str, say: Callable[[Dict[str, Any]], None]) -> None:
        self.file = file
        self.say = say
        self.nodes: Optional[Dict[str, Declaration]] = None
        self.inputs: Dict[int, Any] = {}  # by the number of their memory
        self.functions = functions.Functions()
        self.replies: Any = None
        self.made: Optional[Any] = None
        self.files: List[str] = []
        self.modules = 0
        self.context: Optional[Context] = None

    def load(self) -> Dict[str, Declaration]:
        """Imports the file, once."""
        if self.nodes is None:
            self.say({"say": "at", "place": self.file})  # what ends the process from here on is the file's fault
            module = import_from_source(self.file, _MODULE)
            self.nodes = {one.manifest["name"]: one for one in _checked(nodes_of(module))}
            self.files = loaded_files(self.file)
            self.modules = len(sys.modules)
        return self.nodes

    def describe(self, request: Dict[str, Any]) -> Any:
        nodes = []
        libraries = set()
        for name, one in self.load().items():
            contract = _core.kind_info(name.partition(".")[0])
            libraries.update([contract["library"]] if contract else [])
            nodes.append(completed(one, contract))
        return {"nodes": nodes, "files": loaded_files(self.file) + sorted(libraries)}

    def limits(self, request: Dict[str, Any]) -> Any:
        return {name: one.limits for name, one in self.load().items()}

    def call(self, request: Dict[str, Any]) -> Any:
        node = self.load()[request["node"]]
        arguments = self._arguments(node, request)
        self.context = Context(request["seed"] if node.manifest["random"] else None, self.say)
        if node.context is not None:
            arguments[node.context] = self.context
        try:
            returned = node.function(**arguments)
        finally:
            self.context = None
        self.made = _core.Made(_outputs(node, returned))
        self.made.hand_over(_MADE, True)
        return {"files": self._new_files()}

    def make(self, request: Dict[str, Any]) -> Any:
        """Makes a function, so that what is wrong with its inputs is said before it is needed."""
        node, made = self._function(request)
        return dict(functions.said_of(node, made), files=self._new_files())

    def cost(self, request: Dict[str, Any]) -> Any:
        values = functions.costs(*self._function(request), request)
        return {"values": values, "files": self._new_files()}

    def radiograph(self, request: Dict[str, Any]) -> Any:
        image = functions.radiograph(*self._function(request), request)
        self.made = _core.Made([(image, "radiograph", "image", "")])
        self.made.hand_over(_MADE, True)
        return {"files": self._new_files()}

    def minimise(self, request: Dict[str, Any]) -> Any:
        node = self.load()[request["node"]]
        self.context = Context(None, self.say)
        try:
            reason = functions.minimum(node, self._all_arguments(node, request), request, self._ask_back)
        finally:
            self.context = None
        return {"stopped_because": reason, "files": self._new_files()}

    def share(self, request: Dict[str, Any]) -> Any:
        assert self.made is not None
        return self.made.hand_over(_MADE, False)

    def _function(self, request: Dict[str, Any]) -> Tuple[Declaration, Any]:
        """The node and the function that it makes. It is made when it is first asked for."""
        node = self.load()[request["node"]]
        made = self.functions.get(
            request["function"], node, lambda: node.function(**self._all_arguments(node, request))
        )
        return node, made

    def _all_arguments(self, node: Declaration, request: Dict[str, Any]) -> Dict[str, Any]:
        arguments = self._arguments(node, request)
        if node.context is not None:
            arguments[node.context] = self.context or Context(None, self.say)
        return arguments

    def _ask_back(self, points: Any) -> Any:
        """The values of a function of the process that gave the job. The time that they take does not count."""
        self.say({"say": "waiting"})
        self.say({"say": "ask", "points": points.ravel().tolist()})
        if self.replies is None:
            self.replies = open(_REPLIES, "rb", closefd=False)
        line = self.replies.readline()
        if not line:
            os._exit(1)  # nobody waits any more
        self.say({"say": "goes on"})
        return numpy.array(json.loads(line), float)  # null, for what is not finite, becomes NaN

    def _arguments(self, node: Declaration, request: Dict[str, Any]) -> Dict[str, Any]:
        self.inputs = {number: self.inputs[number] for number in request["kept"] if number in self.inputs}
        arguments = dict(zip(node.inputs, [self._input(one) for one in request["inputs"]]))
        for (name, kind), value in zip(node.options, request["options"]):
            arguments[name] = _option(kind, value)
        return arguments

    def _input(self, given: Any) -> Any:
        if given is None:
            return None
        if "axis" in given:
            return Items(given["axis"], given["names"], [self._input(one) for one in given["items"]])
        if given["number"] not in self.inputs:
            value = _core.mapped_input(given["memory"], given["type"], given["samples_bytes"])
            self.inputs[given["number"]] = value
        return self.inputs[given["number"]]

    def _new_files(self) -> List[str]:
        """Files that were loaded during a call for the first time."""
        if len(sys.modules) == self.modules:
            return []
        self.modules = len(sys.modules)
        before = set(self.files)
        self.files = loaded_files(self.file)
        return [one for one in self.files if one not in before]


def _checked(nodes: List[Declaration]) -> List[Declaration]:
    if not nodes:
        raise Error("it declares no node; write @marrow.node before a function")
    return nodes


def _option(kind: type, value: Any) -> Any:
    if isinstance(value, list):
        return [_option(kind, one) for one in value]
    if isinstance(value, dict):
        value = os.fsdecode(bytes(value["bytes"]))
    return kind(value)


def _outputs(node: Declaration, returned: Any) -> List[Any]:
    ports = node.manifest["outputs"]
    if node.of_one:
        values = [returned]
    elif isinstance(returned, dict):
        values = [returned.get(port["name"]) for port in ports]
    else:
        values = list(returned)
        if len(values) != len(ports):
            raise Error("%s returned %d values, expected %d" % (node.manifest["name"], len(values), len(ports)))
    made = []
    for port, value in zip(ports, values):
        if value is None and not port["optional"]:
            raise Error("%s returned nothing for the output '%s'" % (node.manifest["name"], port["name"]))
        made.append((value, port["name"] or "the only one", port["type"]["id"], port["axis"]))
    return made


def explained(error: BaseException, file: str) -> str:
    """An exception in one sentence, with the last place in the folder of the file. An Error that the node raised on
    purpose speaks for itself."""
    text = str(error).strip() or "no message"
    if isinstance(error, SyntaxError) and error.filename:
        return "%s, line %s: %s: %s" % (error.filename, error.lineno, type(error).__name__, error.msg)
    folder = str(pathlib.Path(file).parent) + os.sep
    frames = [one for one in traceback.extract_tb(error.__traceback__) if one.filename.startswith(folder)]
    if not frames:
        return text if isinstance(error, Error) else "%s: %s: %s" % (file, type(error).__name__, text)
    last = frames[-1]
    if isinstance(error, Error) and last.name != "<module>":
        return text
    kind = "" if isinstance(error, Error) else type(error).__name__ + ": "
    line = " (%s)" % last.line if last.line and last.name != "<module>" else ""
    return "%s, line %s, in %s: %s%s%s" % (last.filename, last.lineno, last.name, kind, text, line)


class Answers:
    """Writes to the standard output as it was at the start. What a node prints goes to the standard error."""

    def __init__(self) -> None:
        self._to = os.dup(1)
        os.dup2(2, 1)
        self._lock = threading.Lock()
        self.job: Any = None

    def send(self, message: Dict[str, Any]) -> None:
        line = (json.dumps(dict(message, job=self.job)) + "\n").encode()
        with self._lock:
            while line:
                line = line[os.write(self._to, line) :]


def answer(process: Process, request: Dict[str, Any], answers: Answers) -> Dict[str, Any]:
    try:
        tasks = {"describe": process.describe, "load": process.limits, "call": process.call}
        tasks.update({"share": process.share, "make": process.make, "cost": process.cost})
        tasks.update({"radiograph": process.radiograph, "minimise": process.minimise})
        return {"end": tasks[request["do"]](request)}
    except MemoryError:
        return {"failed": "out of memory", "out_of_memory": True}
    except KeyboardInterrupt:
        return {"failed": "stopped"}
    except BaseException as error:  # also SystemExit: the process serves the next call
        if request["do"] not in ("describe", "load", "share") and not isinstance(error, Error):
            answers.send({"say": "debug", "text": "".join(traceback.format_exception(type(error), error, None))})
        return {"failed": explained(error, process.file)}


def main(arguments: List[str]) -> int:
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    answers = Answers()
    process = Process(arguments[0], answers.send)
    parent = int(os.environ.get("MARROW_PARENT", os.getppid()))
    _core.end_with(parent)

    def stop(number: int, frame: Optional[FrameType]) -> None:
        if process.context is None:
            os._exit(1)
        process.context.cancelled = True
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    with open(0, "rb", closefd=False) as requests:
        for line in requests:
            request = json.loads(line)
            answers.job = request["job"]
            answers.send(answer(process, request, answers))
    return 0


if __name__ == "__main__":
    module: ModuleType = importlib.import_module("marrow.plugin")  # so that its classes exist once
    sys.exit(module.main(sys.argv[1:]))
