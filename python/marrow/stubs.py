# SPDX-License-Identifier: Apache-2.0
"""Writes the type stub of marrow.nodes from the manifests of all plugins, so that editors know each node:

python3 -m marrow.stubs FILE
"""
import json
import sys
import textwrap
from typing import Any, Dict, List

from . import _core
from .nodes import documentation, python_name

_TYPES = """image picture volume signed_field seeds mesh camera view edge_map shaft_lines landmarks pose truth metrics
verdict stop scene landscape case cost optimizer outline_projector radiograph_projector"""
_VALUES = {name: name.title().replace("_", "") for name in _TYPES.split()}  # their classes in Python
_OPTIONS = {
    "boolean": "bool",
    "integer": "int",
    "number": "float",
    "text": "str",
    "path": "_Path",
    "numbers": "Sequence[float]",
    "texts": "Sequence[str]",
    "paths": "Sequence[_Path]",
}
_HEAD = '''# SPDX-License-Identifier: Apache-2.0
# Written by python3 -m marrow.stubs, from the manifests of the plugins.
import os
from typing import Any, Callable, List, Literal, Mapping, NamedTuple, Optional, Sequence, TypeVar, Union, overload

from ._core import %s, OtherValue
from .items import Items

_T = TypeVar("_T")
_Path = Union[str, "os.PathLike[str]"]
_One = Union[_T, Sequence[_T], Mapping[str, _T]]

__all__ = %s

class Node:
    """A node as a function."""

    def using(self: _T, *, seed: int = 1, threads: int = 0, keep: bool = False, progress: Any = False) -> _T: ...
    def __call__(self, *inputs: Any, **options: Any) -> Any: ...

class Kind:
    """The nodes of one kind."""

    def __getattr__(self, name: str) -> Node: ...

class Optimizers(Kind):
    """The nodes of the kind `optimizer`, and the decorator of a new one."""

    def __call__(
        self,
        name: str,
        *,
        summary: str,
        traits: Sequence[str] = ...,
        relations: Sequence[Any] = ...,
        seconds: float = ...,
        memory_mb: float = ...,
    ) -> Callable[[_T], _T]:
        """Declares a function as a new optimizer."""

@overload
def node(name: str) -> Node:
    """The node of this name, as "edges.canny"."""

@overload
def node(
    name: str,
    *,
    summary: str,
    random: bool = ...,
    traits: Sequence[str] = ...,
    relations: Sequence[Any] = ...,
    seconds: float = ...,
    memory_mb: float = ...,
) -> Callable[[_T], _T]:
    """Declares a function as a new node."""

def documentation(info: Mapping[str, Any]) -> str: ...
def python_name(name: str) -> str: ...
'''


def stub() -> str:
    """The text of the stub."""
    kinds: Dict[str, List[str]] = {}
    for name in _core.node_names():
        kinds.setdefault(name.split(".")[0], []).append(name)
    text = _HEAD % (", ".join(sorted(_VALUES.values())), json.dumps(["Kind", "Node", "node", *kinds]))
    for kind, names in kinds.items():
        text += "".join(_node(_core.node_info(name)) for name in names)
        members = "".join("    %s: %s\n" % (name.split(".", 1)[1], _class_name(name)) for name in names)
        base = "Optimizers" if kind == "optimizer" else "Kind"
        text += "\nclass _%s(%s):\n%s\n%s: _%s\n" % (_capitals(kind), base, members, kind, _capitals(kind))
    return text


def _capitals(name: str) -> str:
    return "".join(word.capitalize() for word in name.replace(".", "_").split("_"))


def _class_name(name: str) -> str:
    return "_" + _capitals(name) + "Node"


def _value(port: Dict[str, Any]) -> str:
    return _VALUES.get(port["type"], "OtherValue")


def _node(info: Any) -> str:
    types = {option["name"]: _option(option) for option in info["options"]}
    arguments = ["self"]
    for port in sorted(info["inputs"], key=lambda port: bool(port["optional"])):
        parts = ["_One[%s]" % _value(port), *([types.pop(port["name"])] if port["name"] in types else [])]
        kind = parts[0] if len(parts) == 1 else "Union[%s]" % ", ".join(parts)
        arguments.append(
            python_name(port["name"]) + (": Optional[%s] = None" % kind if port["optional"] else ": " + kind)
        )
    if types:
        arguments.append("*")
    required = {option["name"] for option in info["options"] if option["required"]}
    for name, kind in types.items():
        arguments.append("%s: %s%s" % (python_name(name), kind, "" if name in required else " = ..."))
    outputs, made = info["outputs"], ""
    if len(outputs) == 1:
        result = _result(outputs[0])
    else:
        result = _class_name(info["name"]) + "Result"
        members = "".join("    %s: %s\n" % (python_name(port["name"]), _result(port)) for port in outputs)
        made = "\nclass %s(NamedTuple):\n%s" % (result, members)
    lines = documentation(info).replace("\\", "\\\\").split("\n")
    explained = textwrap.indent("\n".join(['"""' + lines[0], *lines[1:], '"""']), " " * 8)
    return "%s\nclass %s(Node):\n    def __call__(\n        %s,\n    ) -> %s:\n%s\n" % (
        made,
        _class_name(info["name"]),
        ",\n        ".join(arguments),
        result,
        explained,
    )


def _option(option: Dict[str, Any]) -> str:
    if option["choices"]:
        return "Literal[%s]" % ", ".join(map(json.dumps, option["choices"]))
    return _OPTIONS[option["type"]]


def _result(port: Dict[str, Any]) -> str:
    if port["axis"]:
        return "Items[Any]"
    return "Union[%s, Any]" % (_value(port) if not port["optional"] else "None, " + _value(port))


def main(arguments: List[str]) -> int:
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    text = stub()
    with open(arguments[0], "w", encoding="utf-8") as file:
        file.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
