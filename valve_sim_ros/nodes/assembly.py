# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Samples of a valve put together from topics that carry one signal each, free of ROS."""

from collections import deque
from collections.abc import Callable
import math

from ..recordings.recording import OUTPUTS
from .comparison import Values

REMEMBERED = 5
"""Samples after which a signal that stopped coming is no longer waited for."""
LARGEST_LATENESS = 0.5
"""Seconds beyond five periods that a sample may come late before it counts as a gap."""


class Assembly:
    """Closes a sample when every signal that usually comes has come, one comes again or is late.

    The command of a sample is the one that was last heard when the first of its signals came.

    Attributes
    ----------
    command : float
        Last command heard [% of span]; NaN before the first.
    """

    def __init__(
        self,
        sample_time: float,
        take: Callable[[float, Values], None],
        interrupt: Callable[[], None],
    ) -> None:
        """Keep what takes a sample, and what hears that the next one does not follow the last."""
        self._take, self._interrupt = take, interrupt
        self._sample_time = sample_time
        self.command = math.nan
        self._fresh: dict[str, float] = {}
        self._usual: deque[frozenset[str]] = deque(maxlen=REMEMBERED)
        self._opened = (math.nan, 0.0)
        self._due: float | None = None

    def hear(self, name: str, value: float, now: float) -> None:
        """Take an output [% of span] that arrived at `now` [s]."""
        late = now - self._opened[1] > 0.5 * self._sample_time
        if name in self._fresh or (self._fresh and late):
            self._close()
        if not self._fresh:
            self._opened = self.command, now
        self._fresh[name] = value
        if self._usual and self._fresh.keys() >= frozenset().union(*self._usual):
            self._close()

    def _close(self) -> None:
        """Hand the sample on."""
        command, now = self._opened
        fresh, self._fresh = self._fresh, {}
        self._usual.append(frozenset(fresh))
        self._watch_gaps(now)
        if math.isfinite(command):
            p1, p2, x = (fresh.get(name, math.nan) for name in OUTPUTS)
            self._take(command, (p1, p2, x))

    def _watch_gaps(self, now: float) -> None:
        """Compare the arrival with the grid, which follows the arrivals slowly."""
        if self._due is not None:
            late = now - self._due
            if abs(late) > 5.0 * self._sample_time + LARGEST_LATENESS:
                self._interrupt()
                self._due = now
            else:
                self._due += 0.02 * late
        else:
            self._due = now
        self._due += self._sample_time
