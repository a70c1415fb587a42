# SPDX-License-Identifier: Apache-2.0
"""The nodes of all plugins as functions: marrow.edges.canny(view, noise_high=5)."""
import collections
import inspect
import keyword
import os
from typing import Any, Dict, List, Optional, Tuple

from . import _core, declaration, texts
from .declaration import declared
from .errors import Error, Fault, PipelineError
from .pipeline import checked_pipeline, natural
from .progress import Printer
from .result import Result, checked

__all__ = ["Kind", "Node", "node"]


_DEFAULTS = {"seed": 1, "threads": 0, "keep": False, "progress": False}
_NO_INPUT = (str, os.PathLike, bool, int, float)


class Node:
    """A node as a function. Its inputs come first, by position or name; its options are keywords. Where an input and an
    option have one name, a text, path or number is the option. A list or dictionary for an input that takes one item
    means one call for each item. It returns the node's output, or a named tuple if there are several."""

    def __init__(self, info: Dict[str, Any], settings: Dict[str, Any]) -> None:
        self._info = info
        self._settings = settings
        self.__name__ = info["name"].split(".", 1)[1]
        self.__qualname__ = info["name"]
        self.__doc__ = documentation(info)
        self.__signature__ = _signature(info)

    def using(self, *, seed: int = 1, threads: int = 0, keep: bool = False, progress: Any = False) -> "Node":
        """The same node with other settings of its runs, which Pipeline.run() explains."""
        settings = {"seed": natural("seed", seed), "threads": natural("threads", threads)}
        return Node(self._info, {**settings, "keep": keep, "progress": progress})

    def __call__(self, *inputs: Any, **arguments: Any) -> Any:
        ports = [port["name"] for port in self._info["inputs"]]
        if len(inputs) > len(ports):
            takes = "%s takes %s, got %d" % (self.__qualname__, _counted(len(ports), "input"), len(inputs))
            raise self._refused(takes, "options are given by name")
        given = dict(zip(ports, inputs))
        options: List[Tuple[str, str]] = []
        names = [option["name"] for option in self._info["options"]]
        for written, value in arguments.items():
            name = written[:-1] if written.endswith("_") and keyword.iskeyword(written[:-1]) else written
            is_option = name in names and (name not in ports or isinstance(value, _NO_INPUT))
            if name in given and not is_option:
                raise self._refused("%s: the input '%s' is given twice" % (self.__qualname__, name), port=name)
            if is_option:
                options.append((name, texts.of_value(name, value).replace("$", "$$")))
            elif name in ports:
                given[name] = value
            else:
                hint = _core.suggestion(name, ports + names)
                raise self._refused("%s has no input or option '%s'" % (self.__qualname__, name), hint, option=name)
        wired = {name: value for name, value in given.items() if value is not None}
        read = checked_pipeline(_core.read_node(self._info["name"], wired, options))
        settings = self._settings
        observer = Printer() if settings["progress"] is True else settings["progress"] or None
        run = _core.run(read, observer, settings["seed"], settings["threads"], settings["keep"], None)
        result = checked(Result(run), self.__qualname__)
        outputs = [port["name"] for port in self._info["outputs"]]
        if len(outputs) == 1:
            return result[outputs[0]]
        kind = collections.namedtuple(self.__name__, outputs, rename=True)  # type: ignore[misc]
        return kind(*(result[name] for name in outputs))

    def _refused(self, message: str, hint: Optional[str] = None, **where: str) -> PipelineError:
        text = message + ("; " + hint if hint else "")
        return PipelineError(text, [Fault(message, hint, node=self.__qualname__, **where)])

    def __repr__(self) -> str:
        return "<marrow node %s: %s>" % (self.__qualname__, self._info["summary"])


class Kind:
    """The nodes of one kind."""

    def __init__(self, name: str) -> None:
        self._name = name
        self.__doc__ = _core.kind_summary(name)

    def __getattr__(self, name: str) -> Node:
        if name.startswith("__"):
            raise AttributeError(name)
        info = _core.node_info(self._name + "." + name)
        if info is None:
            missing = "%s.%s" % (self._name, name)
            hint = _core.remedy_for(missing) or _core.suggestion(name, self.__dir__())
            raise AttributeError("no node '%s'; %s" % (missing, hint))
        return Node(info, _DEFAULTS)

    def __dir__(self) -> List[str]:
        start = self._name + "."
        return [name[len(start) :] for name in _core.node_names() if name.startswith(start)]

    def __repr__(self) -> str:
        return "<marrow kind %s: %s>" % (self._name, ", ".join(self.__dir__()))


class Optimizers(Kind):
    """The nodes of the kind `optimizer`, and the decorator of a new one: @marrow.optimizer("optimizer.mine", ...)."""

    def __call__(self, name: str, **arguments: Any) -> Any:
        return declaration.optimizer(name, **arguments)


def node(name: str, *, summary: Optional[str] = None, **declaration: Any) -> Any:
    """The node of this name, as "edges.canny". Raises marrow.Error if no plugin has it.

    With a summary, declares a new node instead: @marrow.node("edges.mine", summary="one line that says what it does").
    The function's parameters are the node's inputs; those after a * are its options. Further arguments: random=True if
    it draws from context.seed, traits=, relations=, and the limits of a call, seconds= (600) and memory_mb= (4096)."""
    if summary is not None:
        return declared(name, summary, **declaration)
    info = _core.node_info(name)
    if info is None:
        hint = _core.remedy_for(name) or _core.suggestion(name, _core.node_names())
        raise Error("unknown node '%s'; %s" % (name, hint))
    return Node(info, _DEFAULTS)


def __getattr__(name: str) -> Kind:
    if name == "optimizer":
        return Optimizers(name)
    if name.startswith("__") or name not in _core.kind_names():  # an import asks for __path__
        hint = "" if name.startswith("_") else "; " + _core.suggestion(name, _core.kind_names())
        raise AttributeError("marrow has no attribute or kind of nodes '%s'%s" % (name, hint))
    return Kind(name)


def __dir__() -> List[str]:
    return sorted(set(__all__) | set(_core.kind_names()))


def _counted(count: int, noun: str) -> str:
    return "%d %s%s" % (count, noun, "" if count == 1 else "s")


def python_name(name: str) -> str:
    """A name that Python takes for an argument: from becomes from_."""
    return name + "_" if keyword.iskeyword(name) else name


def _signature(info: Dict[str, Any]) -> inspect.Signature:
    parameters = [
        inspect.Parameter(
            python_name(port["name"]),
            inspect.Parameter.POSITIONAL_OR_KEYWORD,
            default=None if port["optional"] else inspect.Parameter.empty,
        )
        for port in sorted(info["inputs"], key=lambda port: port["optional"])
    ]
    parameters += [
        inspect.Parameter(
            python_name(option["name"]),
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if option["required"] else option["default"],
        )
        for option in info["options"]
        if python_name(option["name"]) not in [parameter.name for parameter in parameters]
    ]
    return inspect.Signature(parameters)


def documentation(info: Dict[str, Any]) -> str:
    """What help() says of a node."""
    lines = [info["summary"][:1].upper() + info["summary"][1:] + "."]
    for title, ports in (("Inputs", info["inputs"]), ("Returns", info["outputs"])):
        if ports:
            lines += ["", title + ":"]
        for port in ports:
            kind = port["type"] + (" for each %s" % port["axis"] if port["axis"] else "")
            lines.append(
                "    %s (%s%s): %s" % (port["name"], kind, ", optional" if port["optional"] else "", port["help"])
            )
    if info["options"]:
        lines += ["", "Options:"]
    for option in info["options"]:
        lines.append("    %s (%s): %s" % (option["name"], _range(option), option["help"]))
    return "\n".join(lines)


def _range(option: Dict[str, Any]) -> str:
    parts = [option["type"] + (" in " + option["unit"] if option["unit"] else "")]
    if option["minimum"] is not None:
        parts.append("at least %g" % option["minimum"])
    if option["maximum"] is not None:
        parts.append("at most %g" % option["maximum"])
    if option["choices"]:
        parts.append("one of " + ", ".join(option["choices"]))
    parts.append("required" if option["required"] else "default %r" % (option["default"],))
    return ", ".join(parts)
