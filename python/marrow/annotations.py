# SPDX-License-Identifier: Apache-2.0
"""What the signature of a node written in Python says besides types:

low: Annotated[float, marrow.at_least(0), marrow.unit("%"), "lower threshold"] = 50
"""
from dataclasses import dataclass
from typing import Any, Dict, List


@dataclass(frozen=True)
class Note:
    """One annotation of an option or a port."""

    what: str
    value: Any


def at_least(number: float) -> Note:
    """The least value that an option may have."""
    return Note("minimum", float(number))


def at_most(number: float) -> Note:
    """The greatest value that an option may have."""
    return Note("maximum", float(number))


def unit(text: str) -> Note:
    """The unit of an option. Not needed if the option's name ends in it, as in sigma_px."""
    return Note("unit", text)


def length(count: int) -> Note:
    """How many numbers a list has."""
    return Note("length", int(count))


def replaces(*options: str) -> Note:
    """Options of the nodes whose functions reach this node: what a pipeline gives to such a node has no effect here."""
    return Note("replaces", list(options))


def beside(*endings: str) -> Note:
    """Endings, as ".onnx", of files that lie beside the file of an option of type pathlib.Path and have its name
    otherwise. They count in the key of the result by their content, and the node may open them."""
    return Note("beside", list(endings))


def over(axis: str) -> Note:
    """The axis of a list: Annotated[marrow.Items[marrow.View], marrow.over("view")]."""
    return Note("axis", axis)


def figures(*names: str) -> Note:
    """The names that the figures of an output of Metrics can have; * stands for any text, as in "*.median_px". A node
    that makes another figure fails. With it, a figure that cannot be is refused before anything runs."""
    return Note("figures", list(names))


def named(name: str) -> Note:
    """The name of the only output. Not needed if the node's kind names it."""
    return Note("name", name)


def _relation(kind: str, names: Any) -> Dict[str, Any]:
    listed: List[str] = list(names)
    return {"type": kind, "names": listed}


def not_above(lesser: str, greater: str) -> Dict[str, Any]:
    """The first of two options must not be greater than the second."""
    return _relation("not_above", (lesser, greater))


def below(lesser: str, greater: str) -> Dict[str, Any]:
    """The first of two options must be less than the second."""
    return _relation("below", (lesser, greater))


def same_length(*lists: str) -> Dict[str, Any]:
    """These lists must have one length."""
    return _relation("same_length", lists)


def as_many_or_none(some: str, other: str) -> Dict[str, Any]:
    """The first list must be empty or as long as the second."""
    return _relation("as_many_or_none", (some, other))


def exactly_one(*names: str) -> Dict[str, Any]:
    """Exactly one of these options and inputs ("in.camera") must be given."""
    return _relation("exactly_one", names)


def at_least_one(*names: str) -> Dict[str, Any]:
    """One or more of these options and inputs ("in.camera") must be given."""
    return _relation("at_least_one", names)


def distinct(name: str) -> Dict[str, Any]:
    """No item of the list may occur twice."""
    return _relation("distinct", (name,))
