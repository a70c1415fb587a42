# SPDX-License-Identifier: Apache-2.0
"""Python's values as the texts that pipelines are written in."""
import json
import os
from typing import Any

from .errors import Error

_PLAIN = ("uses", "until", "if_pass_fails")  # parts of a node that are names, not values


def of_input(name: str, value: Any) -> str:
    """The text of a value for an input of a pipeline."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    return of_value(name, value)


def of_change(key: str, value: Any) -> str:
    """The text of a value for `node.option`, `node.uses`, `node.in.port` and the like."""
    what = key.split(".")[1:]
    is_name = what[-1:] and (what[-1] in _PLAIN or "in" in what[:-1])
    if is_name and isinstance(value, (list, tuple)):
        return of_value(key, list(map(str, value)))
    return str(value) if is_name else of_value(key, value)


def of_value(name: str, value: Any) -> str:
    """A value as YAML. `name` names it in messages."""
    try:
        return json.dumps(_plain(value), ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError):
        raise Error(
            "%s: expected a bool, number, text, path, or a list of these, got %r" % (name, type(value).__name__)
        ) from None


def _plain(value: Any) -> Any:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):  # an array or a number of numpy
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if value is None or isinstance(value, dict):
        raise TypeError
    return value
