# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The regular ticks behind receive stamps that jitter, lag, arrive in bursts or are lost.

A valve publishes on a timer, so stamp i is ``start + period * tick[i]`` plus a delay. The ticks
are whole numbers that strictly increase; among those, the ones nearest to the stamps are taken.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .quality import Array, MAX_GAP_PERIODS

Ticks = npt.NDArray[np.int64]
FIRST = 16, 96
"""Messages of the first, smallest piece to which a grid is fitted: a short one forgives a poor
guess of the period, a long one bears much jitter."""
STRIDES, SAME = (4, 16), 2e-3
"""Steps over so many messages give further guesses, if they differ by more than this share."""
CLEAR = 0.1
"""A grid that costs no more than this is taken without a look at others."""
LITTLE, BURSTS = 0.3, 0.25
"""Where more than a share of the steps is near zero (in periods), messages arrive in bursts."""
LARGEST_JITTER, MOST_DISORDER = 0.25, 0.1
"""A grid with more jitter (share of the period) is believed only if almost every tick has its
message: no more than this share lost or moved."""
WINDOW = 256


@dataclass(frozen=True)
class Grid:
    """Ticks of one run of messages.

    Attributes
    ----------
    start, period : float
        Stamp of tick 0 and the sampling period, as fitted [s].
    ticks : ndarray of int, shape (n,)
        Tick of each message, from 0.
    jitter : float
        Robust standard deviation of the stamps about the grid [s].
    disorder : float
        Messages lost, or more than 3/4 of a period from their tick, as a share of those there.
    """

    start: float
    period: float
    ticks: Ticks
    jitter: float
    disorder: float

    @property
    def regular(self) -> bool:
        """Whether the stamps look like such a grid at all."""
        few = self.disorder <= MOST_DISORDER
        return self.ticks.size < 3 or self.jitter <= LARGEST_JITTER * self.period or few


def typical_step(stamps: Array) -> float:
    """Return a first guess of the period [s] behind sorted stamps [s], shape (n,)."""
    steps = np.diff(stamps)
    if not steps.size or stamps[-1] <= stamps[0]:
        return 1.0
    middle = float(np.median(steps))
    usual = steps[steps <= MAX_GAP_PERIODS * max(middle, 1e-9)] if middle > 0 else steps
    mean = float(usual.mean())
    if np.mean(steps < LITTLE * mean) <= BURSTS:
        return middle
    whole = steps[steps < 100.0 * float(steps.mean())]
    return float(whole.mean())


def due(stamps: Array) -> Array:
    """Return when messages that arrive in bursts were due [s], shape (n,).

    What comes last in a burst is on time, the others had to wait for it. Stamps [s] without
    bursts are returned as they are.
    """
    period = typical_step(stamps)
    last = np.append(np.diff(stamps) >= LITTLE * period, True)
    if 1.0 - last.mean() <= BURSTS:
        return stamps
    index = np.arange(stamps.size)
    ends = np.flatnonzero(last)
    waited = ends[np.searchsorted(ends, index)] - index
    return np.asarray(np.maximum.accumulate(stamps - period * waited))


def runs(stamps: Array, period: float) -> list[slice]:
    """Return the runs of messages between gaps.

    A silence of more than a few periods is no gap if the messages it held up follow in a burst.
    """
    breaks = []
    for k in np.flatnonzero(np.diff(stamps) > (MAX_GAP_PERIODS + 0.5) * period):
        missing = (stamps[k + 1] - stamps[k]) / period - 1.0
        ahead = np.searchsorted(stamps, stamps[k + 1] + 3.0 * period) - (k + 1)
        if ahead - 4 < 0.5 * missing:
            breaks.append(int(k) + 1)
    bounds = [0, *breaks, stamps.size]
    return [slice(a, b) for a, b in pairwise(bounds) if b > a]


def fit_grid(stamps: Array, period: float, fixed: bool = False) -> Grid:
    """Fit a grid to the stamps [s] of one run, shape (n,).

    Where jitter is large, the median step is a poor guess: the fit starts from several, and the
    grid with the least jitter and the fewest messages missing or moved wins.

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        Sorted.
    period : float
        First guess [s].
    fixed : bool
        Keep `period` as it is.
    """
    if fixed:
        return _fit(stamps, period, FIRST[0], True)
    guesses = [period]
    for stride in STRIDES:
        if stamps.size > 2 * stride:
            guess = float(np.median(stamps[stride:] - stamps[:-stride])) / stride
            if all(abs(guess - other) > SAME * other for other in guesses):
                guesses.append(guess)
    found = _fit(stamps, period, FIRST[0])
    if _cost(found) <= CLEAR:
        return found
    more = [_fit(stamps, guess, first) for first in FIRST for guess in guesses if guess > 0.0]
    return min([found, *more], key=_cost)


def _cost(grid: Grid) -> float:
    """Return jitter, lost and moved messages of a grid, each as a share."""
    return grid.jitter / grid.period + grid.disorder


def _fit(stamps: Array, period: float, first: int, fixed: bool = False) -> Grid:
    """Fit a grid from one first guess of its period.

    The fit starts with the first few messages and doubles its reach, so that no error of the
    period adds up to a tick.
    """
    start, slope = _phase(stamps[:first], period), period
    size = min(first, stamps.size)
    while True:
        ticks = place(stamps[:size], start, slope)
        for _ in range(2):
            start, slope = _line(ticks, stamps[:size], slope if fixed else None)
            ticks = place(stamps[:size], start, slope)
        if size == stamps.size:
            break
        size = min(2 * size, stamps.size)
    errors = stamps - start - slope * ticks
    first, lost = int(ticks[0]), int(ticks[-1] - ticks[0]) + 1 - ticks.size
    moved = int((np.abs(errors) > 0.75 * slope).sum())
    disorder = (lost + moved) / ticks.size
    return Grid(start + slope * first, slope, ticks - first, _spread(errors), disorder)


def place(stamps: Array, start: float, period: float) -> Ticks:
    """Return the strictly increasing ticks nearest to sorted stamps [s], shape (n,)."""
    index = np.arange(stamps.size)
    surplus = np.rint((stamps - start) / period).astype(np.int64) - index
    window = WINDOW
    while (falls := np.flatnonzero(np.diff(surplus) < 0)).size and window < 4 * stamps.size:
        near = np.zeros(stamps.size, dtype=bool)
        for fall in falls:
            near[max(fall - window, 0) : fall + window] = True
        edges = np.flatnonzero(np.diff(near, prepend=False, append=False))
        for a, b in edges.reshape(-1, 2):
            surplus[a:b] = _monotone(surplus[a:b].tolist())
        window *= 4
    return np.asarray(np.maximum.accumulate(surplus) + index, dtype=np.int64)


def _monotone(values: list[int]) -> list[int]:
    """Return the non-decreasing whole numbers with the least sum of distances to `values`.

    Pooling of adjacent violators with medians; the lower median, as messages are late rather
    than early.
    """
    blocks: list[list[int]] = []
    for value in values:
        block = [value]
        while blocks and _median(blocks[-1]) > _median(block):
            block = sorted(blocks.pop() + block)
        blocks.append(block)
    return [_median(block) for block in blocks for _ in block]


def _median(block: list[int]) -> int:
    return block[(len(block) - 1) // 2]


def _phase(stamps: Array, period: float) -> float:
    """Return a tick [s] of the grid nearest to a few stamps."""
    turns = np.exp(2j * np.pi * (stamps - stamps[0]) / period).mean()
    return float(stamps[0] + period * np.angle(turns) / (2.0 * np.pi))


def _line(ticks: Ticks, stamps: Array, slope: float | None) -> tuple[float, float]:
    """Return start and period of the line through the stamps; outliers are left out."""
    kept = np.ones(ticks.size, dtype=bool)
    guess = slope or 0.0
    for _ in range(2):
        t, s = ticks[kept].astype(np.float64), stamps[kept]
        t_mean, s_mean = t.mean(), s.mean()
        if slope is None:
            spread = float(((t - t_mean) ** 2).sum())
            guess = float(((t - t_mean) * (s - s_mean)).sum()) / spread if spread else 0.0
        if guess <= 0.0:
            guess = float(stamps[-1] - stamps[0]) / max(int(ticks[-1] - ticks[0]), 1) or 1.0
        errors = stamps - s_mean - guess * (ticks - t_mean)
        kept = np.abs(errors - np.median(errors)) <= 3.0 * _spread(errors) + 1e-9
    return float(s_mean - guess * t_mean), float(guess)


def _spread(errors: Array) -> float:
    """Return the robust standard deviation of some errors."""
    return 1.4826 * float(np.median(np.abs(errors - np.median(errors))))
