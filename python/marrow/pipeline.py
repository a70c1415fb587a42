# SPDX-License-Identifier: Apache-2.0
"""Pipelines: read, changed and run."""
import os
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple, TypeVar, Union

from . import _core, texts
from .errors import Error, Fault, PipelineError
from .progress import Printer
from .result import Result, checked


_T = TypeVar("_T")
Progress = Union[bool, Callable[[Dict[str, Any]], None]]


def checked_pipeline(read: Tuple[_T, List[Dict[str, Any]], str]) -> _T:
    """The pipeline that _core read. Raises PipelineError with all faults if there are any."""
    pipeline, faults, text = read
    if faults:
        raise PipelineError(text.rstrip(), [Fault(**fault) for fault in faults])
    return pipeline


class Pipeline:
    """A pipeline file, read and checked.

    p = marrow.Pipeline("pipelines/femur/femur.yaml", case="cases/7")
    p.set("edges.high", 80)
    r = p.run(progress=True)

    The keywords are the pipeline's inputs. Relative paths start at the working folder. An input that is None stays
    without a value, for runs that are given what would be made of it. Raises PipelineError with all faults of the file.
    """

    def __init__(self, file: Union[str, "os.PathLike[str]"], /, **inputs: Any) -> None:
        self._file = os.fspath(file)
        self._inputs = [(name, texts.of_input(name, value)) for name, value in inputs.items() if value is not None]
        self._is_complete = None not in inputs.values()
        self._changes: Dict[str, str] = {}
        self._read = self._read_with(self._changes)

    def _read_with(self, changes: Dict[str, str]) -> _core.ReadPipeline:
        return checked_pipeline(_core.read(self._file, self._inputs, list(changes.items()), self._is_complete))

    def set(self, key: Union[str, Mapping[str, Any]], value: Any = None) -> "Pipeline":
        """Changes the pipeline: node.option, node.uses, node.may_fail or node.in.port. A dictionary makes several
        changes at once, for values that must fit each other. Raises PipelineError, and changes nothing, if the pipeline
        would have a fault. Returns the pipeline."""
        wanted = dict(key) if isinstance(key, Mapping) else {key: value}
        changes = {**self._changes, **{name: texts.of_change(name, one) for name, one in wanted.items()}}
        self._read = self._read_with(changes)
        self._changes = changes
        return self

    def run(
        self,
        *,
        progress: Progress = False,
        only: Optional[List[str]] = None,
        given: Optional[Mapping[str, Any]] = None,
        folder: Union[None, bool, str, "os.PathLike[str]"] = None,
        seed: int = 1,
        threads: int = 0,
        keep: bool = True,
    ) -> Result:
        """Runs the pipeline and returns its outputs.

        progress: True writes a line for each node; a function is called with each event, a dictionary.
        only: the outputs to compute. The verdicts on their poses come with them.
        given: values in the place of nodes, which are not run then: {"model": mesh}. For a node with several outputs, a
        dictionary or a named tuple of them.
        folder: where to write the run as `marrow run` does, new or empty; True for runs/NAME.
        seed: of all randomness. threads: 0 for all processors.
        keep: whether results of nodes are looked up in the store, and kept there.

        Other Python threads go on meanwhile. Ctrl-C stops the run and raises KeyboardInterrupt; so does an exception of
        `progress`, which is raised then. Raises RunError if a node fails.
        """
        read = self._read if only is None else self._read.with_only(list(only))
        if given:
            read = read.with_given(dict(given))
        place = None if folder is None or folder is False else "" if folder is True else os.fspath(folder)
        observer = Printer() if progress is True else progress or None
        made = _core.run(read, observer, natural("seed", seed), natural("threads", threads), keep, place)
        return checked(Result(made))

    @property
    def name(self) -> str:
        """The pipeline's name."""
        return self._read.name

    @property
    def help(self) -> str:
        """What the file says about the pipeline."""
        return self._read.help

    @property
    def notes(self) -> List[str]:
        """Remarks that are not faults, such as options that are not used."""
        return self._read.notes

    @property
    def nodes(self) -> Dict[str, str]:
        """What each node uses, by its name, in the order in which they run."""
        return dict(self._read.nodes)

    @property
    def outputs(self) -> List[str]:
        """The names of what it computes."""
        return self._read.outputs

    def resolved(self) -> str:
        """The pipeline as YAML, with the values of all options."""
        return self._read.resolved_yaml()

    def __repr__(self) -> str:
        return "<marrow.Pipeline %s: %d nodes; outputs %s>" % (self.name, len(self.nodes), ", ".join(self.outputs))


def natural(name: str, value: int) -> int:
    """A seed or a number of threads. Raises Error for what cannot be one."""
    limit = 2**64 if name == "seed" else 1025
    if not isinstance(value, int) or not 0 <= value < limit:
        raise Error("%s: expected a whole number from 0 to %d, got %r" % (name, limit - 1, value))
    return value
