# SPDX-License-Identifier: Apache-2.0
"""What all nodes of a Python file share besides their inputs: the process."""
import sys

import numpy

from . import _core


class KeptState:
    """The state of the process as it must stay from one call to the next."""

    def __init__(self) -> None:
        self._take()

    def _take(self) -> None:
        self._process = _core.ProcessState()
        self._numpy = numpy.geterr()
        self._modules = len(sys.modules)

    def begin(self) -> None:
        """A call begins: numbers are calculated with as usual, whatever ran before."""
        self._process.begin_call()

    def changed(self) -> str:
        """What the call has changed, in words; an empty text if it has left all as it was. What a module changes when
        it is first imported is no fault of the call, and stays."""
        if len(sys.modules) != self._modules:
            self._take()
            return ""
        changed: str = self._process.put_back()
        if not changed and numpy.geterr() != self._numpy:
            changed = "numpy's treatment of faults in calculations was changed"
        return changed
