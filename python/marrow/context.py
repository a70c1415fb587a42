# SPDX-License-Identifier: Apache-2.0
"""What marrow gives a node besides its inputs and options."""
import math
from typing import Any, Callable, Dict, Optional

from .errors import Error


class Context:
    """A node takes it as a parameter `context: marrow.Context`. One that you make yourself, for tests, reports
    nothing."""

    def __init__(self, seed: Optional[int] = 1, say: Optional[Callable[[Dict[str, Any]], None]] = None) -> None:
        self._seed = seed
        self.cancelled = False
        """Whether the call is to end. The main thread of the node then gets a KeyboardInterrupt anyway; threads of your
        own look here."""
        self._say = say or (lambda report: None)

    @property
    def seed(self) -> int:
        """The only source of randomness: numpy.random.default_rng(context.seed). It is made from the run's seed and
        everything that the node was given. Raises Error if the node was not declared with random=True: its kept result
        would not depend on the seed."""
        if self._seed is None:
            raise Error("it draws from context.seed, so declare it with random=True")
        return self._seed

    def progress(self, fraction: float, what: str = "") -> None:
        """Reports how far a long call is, from 0 to 1."""
        fraction = float(fraction)
        if not math.isfinite(fraction):
            raise Error("progress: expected a number from 0 to 1, got %r" % fraction)
        self._say({"say": "progress", "fraction": fraction, "text": str(what)})

    def debug(self, text: str) -> None:
        """Writes a line to the run's log, for people who look for a fault."""
        self._say({"say": "debug", "text": str(text)})

    def info(self, text: str) -> None:
        """Writes a line to the run's log."""
        self._say({"say": "info", "text": str(text)})

    def warn(self, text: str) -> None:
        """Says what a person should know about the result. It is kept with the result."""
        self._say({"say": "warning", "text": str(text)})
