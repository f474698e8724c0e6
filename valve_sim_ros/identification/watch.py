# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Progress of a search, and the way to stop it without losing what was found."""

from collections.abc import Callable
from contextlib import suppress
import time

from .descent import End

Progress = Callable[[float, str], object]
"""Called with the share done, 0 to 1, and what is being done; may raise `Stop`."""

BETWEEN = 0.05
"""Progress is told at most once in so many seconds, but asked for at every simulation."""

CREEP = 0.003
"""The share done goes by so much of what is left of its phase at every simulation."""


class Stop(Exception):
    """Raised from a progress callback to end a search; the best so far becomes the result."""


class Watch:
    """Tells a callback how far the work is, often enough that a stop takes effect at once.

    Attributes
    ----------
    best : End or None
        The best point that was offered: what is left if the search is stopped.
    stops : tuple of type
        The exceptions that end a search and keep its best.
    """

    def __init__(self, progress: Progress | None = None, interruptible: bool = False) -> None:
        """Start at nothing done; if `interruptible`, Ctrl-C stops like a progress callback."""
        self.best: End | None = None
        self.stops: tuple[type[BaseException], ...] = (Stop,)
        if interruptible:
            self.stops += (KeyboardInterrupt,)
        self.progress = progress
        self._told = -BETWEEN
        self._share, self._target, self._text = 0.0, 0.0, ''

    def phase(self, target: float, text: str) -> None:
        """Begin a phase that ends where the share done is `target`."""
        self._share, self._target, self._text = self._target, target, text
        self._told = -BETWEEN
        self.tick()

    def offer(self, end: End) -> None:
        """Keep a point if it is the best so far."""
        if self.best is None or end.cost < self.best.cost:
            self.best = end

    def tick(self) -> None:
        """Note one simulation; the share creeps towards the end of the phase."""
        if self.progress is None:
            return
        self._share += CREEP * (self._target - self._share)
        now = time.monotonic()
        if now - self._told >= BETWEEN:
            self._told = now
            self.progress(self._share, self._text)

    def done(self, partial: bool = False) -> None:
        """Tell that all is done; nothing can be stopped any more."""
        if self.progress is not None and not partial:
            with suppress(Stop):
                self.progress(1.0, 'done')
