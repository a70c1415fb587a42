# SPDX-License-Identifier: Apache-2.0
"""Shows how far a run is."""
import sys
import time
from typing import Any, Dict, Optional, TextIO


class Printer:
    """Writes a line for each node that is done, and on a terminal the progress of the node that runs."""

    def __init__(self, stream: Optional[TextIO] = None) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._is_terminal = self._stream.isatty()
        self._shown = 0.0

    def __call__(self, event: Dict[str, Any]) -> None:
        kind = event["event"]
        where = event["node"] + (" (%s)" % event["item"] if event["item"] else "")
        if kind == "finished":
            self._line("%s: %.3f s" % (where, event["seconds"]))
        elif kind == "cached":
            self._line("%s: kept from an earlier run" % where)
        elif kind == "failed":
            self._line(event["text"])
        elif kind in ("warning", "skipped"):
            self._line("%s: %s: %s" % (where, kind, event["text"]))
        elif kind == "progress" and self._is_terminal and time.monotonic() - self._shown > 0.1:
            self._shown = time.monotonic()
            self._stream.write("\r\033[K  %-32s %3.0f %% %s" % (where, 100 * event["fraction"], event["text"]))
            self._stream.flush()

    def _line(self, text: str) -> None:
        self._stream.write(("\r\033[K" if self._is_terminal else "") + text + "\n")
        self._stream.flush()
