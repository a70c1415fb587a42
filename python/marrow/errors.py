# SPDX-License-Identifier: Apache-2.0
"""What marrow raises: every error says what is wrong, where, and what to do."""
import dataclasses
import os
import pathlib
import traceback
from typing import List, Optional


@dataclasses.dataclass(frozen=True)
class Fault:
    """One thing that is wrong. What is not known is None."""

    message: str
    hint: Optional[str] = None
    file: Optional[str] = None
    line: Optional[int] = None
    column: Optional[int] = None
    node: Optional[str] = None
    port: Optional[str] = None
    option: Optional[str] = None


class Error(Exception):
    """Base of all errors of marrow. `faults` has all that is wrong. file, line, column, node, port, option and hint are
    those of the first fault, or None."""

    def __init__(self, text: str = "", faults: Optional[List[Fault]] = None) -> None:
        super().__init__(text)
        self.faults: List[Fault] = faults if faults is not None else [Fault(text)]
        first = self.faults[0] if self.faults else Fault(text)
        self.hint: Optional[str] = first.hint
        self.file: Optional[str] = first.file
        self.line: Optional[int] = first.line
        self.column: Optional[int] = first.column
        self.node: Optional[str] = first.node
        self.port: Optional[str] = first.port
        self.option: Optional[str] = first.option


class PipelineError(Error):
    """A pipeline, or the call of a node, has faults. Nothing was run."""


class RunError(Error):
    """Nodes failed. `faults` has one fault for each of them, and `result` what was made all the same."""

    def __init__(self, text: str, faults: List[Fault], result: object) -> None:
        super().__init__(text, faults)
        self.result = result


def _text_of(error: BaseException) -> str:
    try:
        return str(error).strip() or "no message"
    except Exception:  # the exception's own text is at fault
        return "no message"


def explained(error: BaseException, file: str) -> str:
    """An exception in one sentence, with the last place in the folder of the file. An Error that the node raised on
    purpose speaks for itself."""
    text = _text_of(error)
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
