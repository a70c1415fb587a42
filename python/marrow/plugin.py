# SPDX-License-Identifier: Apache-2.0
"""The process that holds the nodes of one Python file. marrow starts it (node_process.py), and asks it for one thing at
a time. It reads requests and writes reports and answers as marrow/runtime/process/worker.hpp says.
"""
import json
import math
import os
import re
import signal
import sys
import threading
import traceback
from types import FrameType
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

import numpy

from . import _core, functions
from .context import Context
from .declaration import Declaration, completed, nodes_of
from .errors import Error, explained
from .items import Items
from .trust import KeptState, TrustedModules
from .modules import import_from_source, loaded_files

_MADE = 3  # the descriptor through which values are handed over
_REPLIES = 4  # the descriptor from which the replies to questions are read
_MODULE = "marrow_python_nodes"
_LONGEST_TEXT = 100_000  # characters of a text that is sent
_LONGEST_LINE = 60_000_000  # marrow reads no longer ones


class Process:
    def __init__(self, file: str, say: Callable[[Dict[str, Any]], None]) -> None:
        self.file = file
        self.say = say
        self.nodes: Optional[Dict[str, Declaration]] = None
        self.inputs: Dict[int, Any] = {}  # by the number of their memory, each with a check that it is as it was
        self.functions = functions.Functions()
        self.replies: Any = None
        self.instead: Optional[functions.Instead] = None
        self.asking = threading.Lock()  # held from a question to its reply, but for what marrow asks meanwhile
        self.made: Optional[Any] = None
        self.reported: Any = None  # how much was loaded when it was last reported
        self.context: Optional[Context] = None
        self.state: Optional[KeptState] = None  # from the first call on
        self.is_spoilt = False  # a call has changed the state of the process
        self.trusted = TrustedModules()

    def load(self) -> Dict[str, Declaration]:
        """Imports the file, once."""
        if self.nodes is None:
            self.say({"say": "at", "place": self.file})  # what ends the process from here on is the file's fault
            sys.meta_path.insert(0, self.trusted)
            module = import_from_source(self.file, _MODULE)
            self.trusted.expect_none_refused()
            self.nodes = {one.manifest["name"]: one for one in _checked(nodes_of(module))}
        return self.nodes

    def describe(self, request: Dict[str, Any]) -> Any:
        nodes = []
        libraries = set()
        for name, one in self.load().items():
            contract = _core.kind_info(name.partition(".")[0])
            libraries.update([contract["library"]] if contract else [])
            nodes.append(completed(one, contract))
        loaded = self._loaded()
        return dict(loaded, nodes=nodes, files=loaded["files"] + sorted(libraries))

    def limits(self, request: Dict[str, Any]) -> Any:
        limits = {name: one.limits for name, one in self.load().items()}
        return dict(self._loaded(), limits=limits)

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
        self._expect_same_inputs(node, request)
        self.made = _core.Made(_outputs(node, returned))
        self.made.hand_over(_MADE, True)
        return self._loaded()

    def make(self, request: Dict[str, Any]) -> Any:
        """Makes a function, so that what is wrong with its inputs is said before it is needed."""
        node, made = self._function(request)
        self._expect_same_inputs(node, request)
        return dict(functions.said_of(node, made), **self._loaded())

    def cost(self, request: Dict[str, Any]) -> Any:
        node, cost = self._function(request)
        if "instead" not in request:
            return dict(self._loaded(), values=functions.costs(node, cost, request))
        self.instead = functions.Instead(request)
        try:
            values = functions.costs_instead(node, cost, request, self.instead)
        finally:
            self.instead = None
        return dict(self._loaded(), values=values)

    def radiograph(self, request: Dict[str, Any]) -> Any:
        image = functions.radiograph(*self._function(request), request)
        self.made = _core.Made([(image, "radiograph", "image", "")])
        self.made.hand_over(_MADE, True)
        return self._loaded()

    def minimise(self, request: Dict[str, Any]) -> Any:
        node = self.load()[request["node"]]
        self.context = Context(None, self.say)
        try:
            reason = functions.minimum(node, self._all_arguments(node, request), request, self._values)
        finally:
            self.context = None
        self._expect_same_inputs(node, request)
        return dict(self._loaded(), stopped_because=shortened(reason))

    def keeping_state(self, task: Callable[[Dict[str, Any]], Any], request: Dict[str, Any]) -> Any:
        """Does what a request asks for. What it changes for the whole process would change what later calls give."""
        self.load()
        self.state = self.trusted.state = self.state or KeptState()
        self.state.begin()
        try:
            result = task(request)
        finally:
            changed = self.state.changed()
            self.is_spoilt = self.is_spoilt or bool(changed)
        if changed:
            raise Error("%s: %s while it ran; a node must leave it as it is" % (self.file, changed))
        self.trusted.expect_none_refused()
        return result

    def share(self, request: Dict[str, Any]) -> Any:
        assert self.made is not None
        return self.made.hand_over(_MADE, False)

    def _function(self, request: Dict[str, Any]) -> Tuple[Declaration, Any]:
        """The node and the function that it makes. It is made when it is first asked for."""
        node = self.load()[request["node"]]
        make = lambda: node.function(**self._all_arguments(node, request))
        made = self.functions.get(request["function"], node, make)
        return node, made

    def _all_arguments(self, node: Declaration, request: Dict[str, Any]) -> Dict[str, Any]:
        arguments = self._arguments(node, request)
        if node.context is not None:
            arguments[node.context] = self.context or Context(None, self.say)
        return arguments

    def _values(self, points: Any) -> Any:
        """The values of the function that an optimizer minimises."""
        return numpy.array(self._ask({"points": points.ravel().tolist()}), float)  # None becomes NaN

    def _ask_function(self, question: Dict[str, Any], value_at: Optional[Callable[[List[float]], float]] = None) -> Any:
        if self.instead is not None:
            return self.instead.reply(question, self._ask)
        return self._ask(question, value_at)

    def _ask(self, question: Dict[str, Any], value_at: Optional[Callable[[List[float]], float]] = None) -> Any:
        """The reply of the process that gave the job. The time that it takes does not count. It may ask in turn for
        values of `value_at`, which may ask further things. Safe to call from several threads."""
        with self.asking:
            self._say_while_waiting({"say": "ask", **question})
            reply = self._reply()
            while isinstance(reply, dict) and "ask" in reply:
                assert value_at is not None
                value = self._value(value_at, reply["point"])
                self._say_while_waiting({"say": "ask", "answer": value, "to": reply["ask"]})
                reply = self._reply()
        return reply

    def _value(self, value_at: Callable[[List[float]], float], point: List[float]) -> Optional[float]:
        self.asking.release()
        try:
            value = float(value_at(point))
        finally:
            self.asking.acquire()
        return value if math.isfinite(value) else None

    def _say_while_waiting(self, message: Dict[str, Any]) -> None:
        self.say({"say": "waiting"})
        self.say(message)

    def _reply(self) -> Any:
        if self.replies is None:
            self.replies = open(_REPLIES, "rb", closefd=False)
        line = self.replies.readline()
        if not line:
            os._exit(1)  # nobody waits any more
        self.say({"say": "goes on"})
        return json.loads(line)

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
        if "function" in given:
            return _core.asked_function(given["type"], given["function"], given["key"], self._ask_function)
        if given["number"] not in self.inputs:
            self.inputs[given["number"]] = _core.mapped_input(given["memory"], given["type"], given["samples_bytes"])
        return self.inputs[given["number"]][0]

    def _expect_same_inputs(self, node: Declaration, request: Dict[str, Any]) -> None:
        """An array cannot be written to, but there are other ways. The next call would get the changed input, too."""
        for name, given in zip(node.inputs, request["inputs"]):
            for number in _numbers_in(given):
                if number in self.inputs and not self.inputs[number][1].holds():
                    self.inputs.clear()
                    raise Error(
                        "%s changed its input '%s'; a node must leave its inputs as they are: change a copy"
                        % (node.manifest["name"], name)
                    )

    def _loaded(self) -> Dict[str, Any]:
        """The files that were loaded until now. None where they are as in the last answer."""
        now = len(sys.modules), _core.count_of_loaded_libraries()
        files = loaded_files(self.file) if now != self.reported else []
        self.reported = now
        return {"files": [_bytes_as_json(path) for path in files]}


def _numbers_in(given: Any) -> List[int]:
    """The numbers of the memory that an input of a request has."""
    if given is None:
        return []
    if "axis" in given:
        return [number for one in given["items"] for number in _numbers_in(one)]
    return [given["number"]] if "number" in given else []


def _bytes_as_json(name: str) -> Any:
    """The name of a file. One that is not UTF-8 is given as bytes, as marrow's json_of_bytes() does."""
    try:
        return name.encode("utf-8").decode("utf-8")
    except UnicodeEncodeError:
        return {"bytes": list(os.fsencode(name))}


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


def shortened(text: str) -> str:
    if len(text) <= _LONGEST_TEXT:
        return text
    return "%s... (%d more characters)" % (text[:_LONGEST_TEXT], len(text) - _LONGEST_TEXT)


def _line_of(message: Dict[str, Any]) -> bytes:
    """A message as JSON. What is not UTF-8 in a text is shown as \\xff. Raises Error if marrow could not read it."""
    for key in {"text", "failed", "place"} & set(message):
        message[key] = shortened(message[key])
    try:
        text = json.dumps(message, ensure_ascii=False, allow_nan=False)
    except ValueError as error:
        raise Error("it answers with a number that is not finite") from error
    line = re.sub("[\ud800-\udfff]", lambda one: "\\\\x%02x" % (ord(one[0]) & 0xFF), text).encode() + b"\n"
    if len(line) > _LONGEST_LINE:
        raise Error("its answer has %d bytes, more than the %d that it may have" % (len(line), _LONGEST_LINE))
    return line


class Requests:
    """Reads from the standard input as it was at the start. A node, and a process that it starts, finds nothing."""

    def __init__(self) -> None:
        self._lines = open(os.dup(0), "rb")
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        os.close(nothing)

    def __iter__(self) -> Iterator[Any]:
        for line in self._lines:
            yield json.loads(line)


class Answers:
    """Writes to the standard output as it was at the start. What a node prints goes to the standard error."""

    def __init__(self) -> None:
        self._to = os.dup(1)
        os.dup2(2, 1)
        self._lock = threading.Lock()
        self.job: Any = None

    def send(self, message: Dict[str, Any]) -> None:
        line = _line_of(dict(message, job=self.job))
        with self._lock:
            while line:
                line = line[os.write(self._to, line) :]


def answer(process: Process, request: Dict[str, Any], answers: Answers) -> Dict[str, Any]:
    try:
        tasks = {"describe": process.describe, "load": process.limits, "share": process.share}
        calls = {"call": process.call, "make": process.make, "cost": process.cost}
        calls.update({"radiograph": process.radiograph, "minimise": process.minimise})
        if request["do"] in calls:
            return {"end": process.keeping_state(calls[request["do"]], request)}
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
    answers, requests = Answers(), Requests()
    for descriptor in (_MADE, _REPLIES):
        if _is_open(descriptor):
            os.set_inheritable(descriptor, False)
    process = Process(arguments[0], answers.send)
    own = os.getpid()
    _core.end_with(int(os.environ.get("MARROW_PARENT", os.getppid())))

    def stop(number: int, frame: Optional[FrameType]) -> None:
        if process.context is None:
            os._exit(1)
        process.context.cancelled = True
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    for request in requests:
        answers.job = request["job"]
        answered = answer(process, request, answers)
        if os.getpid() != own:
            os._exit(1)  # a process that the node forked came out of the node's code: it must not answer
        if process.is_spoilt:  # it is of no use for another call
            answered = {"end": {"spoilt": answered["failed"]}}
        try:
            answers.send(answered)
        except Error as error:
            answers.send({"failed": str(error)})
    return 0


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True
