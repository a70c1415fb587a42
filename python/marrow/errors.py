# SPDX-License-Identifier: Apache-2.0
"""What marrow raises: every error says what is wrong, where, and what to do."""
import dataclasses
from typing import List, Optional

__all__ = ["Error", "Fault", "PipelineError", "RunError"]


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
