# SPDX-License-Identifier: Apache-2.0
"""Nodes written in Python: what the decorator @marrow.node finds in the signature of a function."""
import inspect
import pathlib
import typing
from typing import Any, Callable, Dict, List, Optional, Tuple

from . import _core
from .context import Context
from .errors import Error
from .items import Items
from .problem import Problem

_UNITS = {"mm": "mm", "deg": "deg", "rad": "rad", "px": "px", "s": "s", "hu": "HU", "kev": "keV", "percent": "%"}
_OPTIONS = {bool: "boolean", int: "integer", float: "number", str: "text", pathlib.Path: "path"}
_LISTS = {float: "numbers", int: "numbers", str: "texts", pathlib.Path: "paths"}
_DEFAULTS = {"boolean": False, "integer": 0, "number": 0.0, "text": "", "path": ""}
_SECONDS, _MEMORY_MB = 600.0, 4096.0  # as for other nodes that run in a process of their own

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class Declaration:
    """What is known about a node: its manifest, how its function is called, and the limits of a call."""

    def __init__(self, function: Callable[..., Any], manifest: Dict[str, Any], limits: Dict[str, float]) -> None:
        self.function = function
        self.manifest = manifest
        self.limits = limits
        self.inputs: List[str] = []  # names of the function's parameters, in the order of the ports
        self.options: List[Tuple[str, type]] = []  # and of its options
        self.context: Optional[str] = None
        self.problem: Optional[str] = None  # the parameter of an optimizer that gets the problem
        self.makes = ""  # the type of the function that it makes; empty if it makes data
        self.of_one: bool = True  # whether what the function returns is the only output


def declared(
    name: str,
    summary: str,
    random: bool = False,
    traits: Any = (),
    relations: Any = (),
    seconds: float = _SECONDS,
    memory_mb: float = _MEMORY_MB,
    makes: str = "",
) -> Decorator:
    """The decorator of a node; `makes` is the type of the function that it makes, if any. The function stays as it
    is."""

    def declare(function: Callable[..., Any]) -> Callable[..., Any]:
        manifest = {"name": name, "summary": summary, "random": bool(random), "inputs": [], "outputs": []}
        manifest.update(options=[], relations=list(relations), traits=list(traits))
        made = Declaration(function, manifest, {"seconds": float(seconds), "memory_mb": float(memory_mb)})
        made.makes = makes
        hints = typing.get_type_hints(function, include_extras=True)
        for parameter in inspect.signature(function).parameters.values():
            _add_parameter(made, parameter, hints.get(parameter.name))
        if (makes == "optimizer") != (made.problem is not None):
            raise Error("%s: an optimizer, and nothing else, has a parameter 'problem: marrow.Problem'" % name)
        if makes:
            kind = _core.type_description(makes)
            manifest["outputs"] = [{"name": "", "help": "", "type": kind, "optional": False, "axis": "", "figures": []}]
        else:
            _add_outputs(made, hints.get("return"))
        setattr(function, "__marrow_node__", made)
        return function

    return declare


def cost(
    name: str,
    *,
    summary: str,
    traits: Any = (),
    relations: Any = (),
    seconds: float = _SECONDS,
    memory_mb: float = _MEMORY_MB
) -> Decorator:
    """Declares a function as a node that makes a cost: @marrow.cost("similarity.mine", summary="..."). The function
    gets the node's inputs and options, and returns another one: from an array of poses [N, 4, 4] (world from model, mm)
    to their N costs. Smaller is better, and each must be finite. `seconds` limits one batch of poses."""
    return declared(name, summary, False, traits, relations, seconds, memory_mb, "cost")


def optimizer(
    name: str,
    *,
    summary: str,
    traits: Any = (),
    relations: Any = (),
    seconds: float = _SECONDS,
    memory_mb: float = _MEMORY_MB
) -> Decorator:
    """Declares a function as a node that makes an optimizer: @marrow.optimizer("optimizer.mine", summary="..."). The
    function itself minimises: it gets `problem: marrow.Problem` and the node's options, asks for values by
    problem(points), and returns in words why it ended. The result is the best point that it asked for. `seconds` limits
    one minimisation, without the time that the values take."""
    return declared(name, summary, False, traits, relations, seconds, memory_mb, "optimizer")


def projector(
    name: str,
    *,
    summary: str,
    traits: Any = (),
    relations: Any = (),
    seconds: float = _SECONDS,
    memory_mb: float = _MEMORY_MB
) -> Decorator:
    """Declares a function as a node that makes a projector of radiographs: @marrow.projector("project.mine",
    summary="..."). The function gets the node's inputs and options, and returns two things: a function
    draw(camera, pose, pixels) from a marrow.Camera, a 4 x 4 pose (world from model, mm) and pixels [N, 2] (u, v) to N
    line integrals in mm of water; and the corners [N, 3] of a box that holds the whole model, in its frame, in mm.
    `seconds` limits one radiograph."""
    return declared(name, summary, False, traits, relations, seconds, memory_mb, "radiograph_projector")


def nodes_of(module: Any) -> List[Declaration]:
    """The nodes that a module itself declares, in their order."""
    found = [getattr(one, "__marrow_node__", None) for one in vars(module).values()]
    own = [one for one in found if isinstance(one, Declaration) and one.function.__module__ == module.__name__]
    return list(dict.fromkeys(own))


def completed(declaration: Declaration, contract: Optional[Dict[str, Any]]) -> Dict[str, Any]:
    """The node's manifest. What its signature does not say, the contract of its kind does: the texts of ports, and the
    name of the only output."""
    manifest = dict(declaration.manifest)
    known = contract or {"inputs": [], "outputs": []}
    outputs = [dict(port) for port in manifest["outputs"]]
    if len(outputs) == 1 and not outputs[0]["name"]:
        if len(known["outputs"]) != 1:
            where = "%s: the kind does not name the output" % manifest["name"]
            raise Error(where + '; name it: -> Annotated[..., marrow.named("edges")]')
        outputs[0]["name"] = known["outputs"][0]["name"]
    manifest["outputs"] = [_with_help(port, known["outputs"]) for port in outputs]
    manifest["inputs"] = [_with_help(port, known["inputs"]) for port in manifest["inputs"]]
    return manifest


def _with_help(port: Dict[str, Any], contract: List[Dict[str, Any]]) -> Dict[str, Any]:
    texts = [one["help"] for one in contract if one["name"] == port["name"]]
    return dict(port, help=port["help"] or (texts[0] if texts else ""))


def _split(hint: Any) -> Tuple[Any, Dict[str, Any], bool]:
    """The type of an annotation, its notes with the text as "help", and whether it is optional."""
    notes: Dict[str, Any] = {}
    optional = False
    while True:
        if typing.get_origin(hint) is typing.Annotated:
            hint, *extras = typing.get_args(hint)
            notes = {
                **{"help" if isinstance(one, str) else one.what: getattr(one, "value", one) for one in extras},
                **notes,
            }
        elif type(None) in typing.get_args(hint) and len(typing.get_args(hint)) == 2:
            optional = True
            hint = next(one for one in typing.get_args(hint) if one is not type(None))
        else:
            return hint, notes, optional


def _port(where: str, name: str, hint: Any, is_output: bool) -> Dict[str, Any]:
    kind, notes, optional = _split(hint)
    is_list = typing.get_origin(kind) is Items
    if is_list:
        kind, more, _ = _split(typing.get_args(kind)[0])
        notes = {**more, **notes}
    if is_list != ("axis" in notes):
        raise Error(where + ': a list is written Annotated[marrow.Items[marrow.View], marrow.over("view")]')
    if is_output and isinstance(kind, type) and issubclass(kind, _core.OtherValue):
        raise Error("%s is a function; use @marrow.cost, @marrow.optimizer or @marrow.projector" % where)
    if not isinstance(getattr(kind, "type", None), str):
        raise Error("%s: expected one of marrow's values, as marrow.View, got %s" % (where, _shown(kind)))
    if "figures" in notes and not (is_output and getattr(kind, "type") == "metrics"):
        raise Error("%s: marrow.figures is for an output of marrow.Metrics" % where)
    return {
        "name": name,
        "help": notes.get("help", ""),
        "type": _core.type_description(str(getattr(kind, "type"))),
        "optional": optional or (is_output and is_list),
        "axis": notes.get("axis", ""),
        "figures": notes.get("figures", []),
    }


def _shown(kind: Any) -> str:
    return "nothing" if kind is None else getattr(kind, "__name__", str(kind))


def _add_parameter(made: Declaration, parameter: inspect.Parameter, hint: Any) -> None:
    if _split(hint)[0] is Context:
        made.context = parameter.name
        return
    if _split(hint)[0] is Problem:
        made.problem = parameter.name
        return
    name = parameter.name[:-1] if parameter.name.endswith("_") else parameter.name  # from_ is the port "from"
    if parameter.kind is inspect.Parameter.KEYWORD_ONLY:
        option, kind = _option("option '%s' of %s" % (name, made.manifest["name"]), name, parameter.default, hint)
        made.manifest["options"].append(option)
        made.options.append((parameter.name, kind))
    elif parameter.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD:
        port = _port("input '%s' of %s" % (name, made.manifest["name"]), name, hint, False)
        made.manifest["inputs"].append(port)
        made.inputs.append(parameter.name)
    else:
        raise Error(
            "%s: '%s' is no input and no option; inputs are plain parameters, options come after a *"
            % (made.manifest["name"], parameter)
        )


def _option(where: str, name: str, default: Any, hint: Any) -> Tuple[Dict[str, Any], type]:
    kind, notes, _ = _split(hint)
    choices: List[str] = []
    if typing.get_origin(kind) is typing.Literal:
        choices, kind = list(typing.get_args(kind)), str
    is_list = typing.get_origin(kind) in (list, typing.get_origin(typing.Sequence[int]))
    of = typing.get_args(kind)[0] if is_list else kind
    known = _LISTS if is_list else _OPTIONS
    if of not in known:
        raise Error(
            "%s: expected bool, int, float, str, pathlib.Path, Literal of texts, or List of these, got %s"
            % (where, _shown(kind))
        )
    required = default is inspect.Parameter.empty
    count = notes.get("length", 0)
    value = ([0.0] * count if of in (float, int) else []) if is_list else _DEFAULTS[known[of]]
    if not required:
        value = _plain(default, of, is_list)
    option = {"name": name, "help": notes.get("help", ""), "type": known[of], "required": required}
    option["unit"] = notes.get("unit", _UNITS.get(name.rpartition("_")[2], "") if "_" in name else "")
    option.update({"default": value, "choices": choices, "length": count, "replaces": notes.get("replaces", [])})
    option["beside"] = notes.get("beside", [])
    option.update({key: notes[key] for key in ("minimum", "maximum") if key in notes})
    return option, of


def _plain(value: Any, of: type, is_list: bool) -> Any:
    if is_list:
        return [_plain(one, float if of is int else of, False) for one in value]
    if of is pathlib.Path:
        return "" if value == pathlib.Path() else str(value)  # str(Path()) would be the working folder
    return float(value) if of is float else value


def _add_outputs(made: Declaration, hint: Any) -> None:
    name = made.manifest["name"]
    fields = hint if isinstance(hint, dict) else None
    if isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields"):
        fields = typing.get_type_hints(hint, include_extras=True)
    made.of_one = fields is None
    if fields is None:
        _, notes, _ = _split(hint)
        fields = {notes.get("name", ""): hint}
    for port, kind in fields.items():
        what = "output '%s' of %s" % (port, name) if port else "the output of " + name
        own = port[:-1] if port.endswith("_") else port
        made.manifest["outputs"].append(_port(what, own, kind, True))
