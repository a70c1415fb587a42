# SPDX-License-Identifier: Apache-2.0
"""What all nodes of a Python file share besides their inputs: the process."""
import contextlib
from typing import Iterator

from . import _core


class KeptState:
    """The state of the process as it must stay from one call to the next."""

    def __init__(self) -> None:
        self._before_import = ""
        self._imports = 0
        self._process = _core.ProcessState()

    def begin(self) -> None:
        """A call begins: numbers are calculated with as usual, whatever ran before."""
        self._process.begin_call()

    @contextlib.contextmanager
    def importing(self) -> Iterator[None]:
        """While a module runs for the first time. What it changes is no fault of the call, and stays."""
        if self._imports == 0:
            self._before_import = self._before_import or self._process.put_back()
        self._imports += 1
        try:
            yield
        finally:
            self._imports -= 1
            if self._imports == 0:
                self._process = _core.ProcessState()
                self.begin()

    def changed(self) -> str:
        """What the call has changed, in words; an empty text if it has left all as it was."""
        changed = self._before_import or self._process.put_back()
        self._before_import = ""
        return changed
