# SPDX-License-Identifier: Apache-2.0
"""What a run made."""
import dataclasses
import os
import pathlib
from typing import Any, Dict, Iterator, List, Mapping, Optional, Union

from . import _core
from .errors import Fault, RunError


@dataclasses.dataclass(frozen=True)
class NodeReport:
    """What happened to one node in a run."""

    name: str
    uses: str
    status: str
    reason: str
    seconds: float
    calls: int
    cached: int
    peak_memory_mb: float


class Result(Mapping[str, Any]):
    """The outputs of a run by name: result["pose"]["distal"].matrix. An output that was not made is None."""

    def __init__(self, run: _core.Run) -> None:
        self._run = run
        self._names: List[str] = run.outputs
        self._values: Dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._names:
            raise KeyError("no output %r; there are %s" % (name, ", ".join(self._names)))
        if name not in self._values:
            self._values[name] = self._run.output(name)
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    @property
    def nodes(self) -> Dict[str, NodeReport]:
        """What happened to each node, by its name."""
        fields = [field.name for field in dataclasses.fields(NodeReport)]
        return {node["name"]: NodeReport(**{name: node[name] for name in fields}) for node in self._run.nodes}

    @property
    def seconds(self) -> float:
        """The time of the run."""
        return self._run.seconds

    @property
    def warnings(self) -> List[str]:
        """The nodes' warnings, each with the node that gave it."""
        return [where + ": " + text if where else text for where, text in self._run.warnings]

    @property
    def folder(self) -> Optional[pathlib.Path]:
        """The folder that was written; None without `folder=`."""
        return pathlib.Path(self._run.folder) if self._run.folder else None

    @property
    def recipe(self) -> Optional[str]:
        """A pipeline file that makes the run again, as `marrow recipe` prints it; None if values were given
        (`given=`)."""
        return self._run.recipe

    @property
    def files(self) -> Dict[str, List[pathlib.Path]]:
        """The files of each output in the folder; empty without `folder=`."""
        folder = pathlib.Path(self._run.folder)
        return {name: [folder / file for file in files] for name, files, _, _ in self._run.written}

    def write(self, folder: Union[str, "os.PathLike[str]"]) -> "Result":
        """Writes the folder that `marrow run` would write: new or empty. Returns the result."""
        self._run.write(os.fspath(folder))
        return self

    def _repr_html_(self) -> str:
        from .display import result_html

        return result_html(self)

    def __repr__(self) -> str:
        return "<marrow.Result of %.3f s: %s>" % (self.seconds, ", ".join(self._names))


def checked(result: Result, called: Optional[str] = None) -> Result:
    """The result. Raises RunError if a node failed or an output was not written. `called`: the node, if it was called
    as a function: it then has no name and no place in a file."""
    run = result._run
    faults, texts = [], []
    for node in run.nodes:
        if not node["is_failed"]:
            continue
        if called is not None:
            faults.append(Fault(node["reason"], node=called))
            texts.append("%s failed: %s" % (called, node["reason"]))
            continue
        place = {name: node[name] or None for name in ("file", "line", "column")}
        faults.append(Fault(node["reason"], node=node["name"], **place))
        texts.append("node '%s' (%s) failed: %s" % (node["name"], node["uses"], node["reason"]))
    for name, _, fault, _ in run.written:
        if fault and not faults:
            faults.append(Fault(fault))
            texts.append("output '%s': %s" % (name, fault))
    if faults:
        raise RunError("\n".join(texts), faults, result)
    return result
