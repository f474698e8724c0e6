# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a recording did to its valve: reversals of u, filling and emptying, moves of the stem."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .quality import Array, resolution, roughness
from .recording import Recording

SMALLEST_TURN = 1.0
"""Turning points of u by less than this [%] are no reversal."""
SMALLEST_DRIVE = 1.0
"""The chamber counts as filling or emptying while u and p2 differ by more than this [%]."""
FAINT_SWING = 20.0
"""A swing of p2 by so many times its noise shows a time constant, if faintly."""
WINDOW = 10
"""Samples before and behind over which the stem's motion is seen."""
STILL = 0.1
"""Motion below this [%] within a window is none."""
SLIP = 5.0
"""A step of x by so many times its noise is the stem slipping."""
AT_REST = 5
"""Samples without motion before a slip."""
CLIPPED_RUN = 5


@dataclass(frozen=True)
class Span:
    """One signal as a sensor sees it.

    Attributes
    ----------
    low, high : float
        Range [% of span].
    noise : float
        Standard deviation of its noise [% of span], at least what its resolution brings; too
        high where the signal itself bends at every sample.
    resolution : float
        Smallest step between two values [% of span]; NaN for a constant.
    clipped : float
        Share of the samples in runs that stay exactly at the lowest or highest value although
        the signal is noisy elsewhere.
    """

    low: float
    high: float
    noise: float
    resolution: float
    clipped: float


@dataclass(frozen=True)
class Flow:
    """Air going one way through the throttle, into the chamber or out of it.

    Attributes
    ----------
    longest : float
        Longest time in one go [s].
    swing : float
        Greatest change of p2 (of x, if p2 was not measured) in one go [%].
    time_constant : float
        Rough estimate [s]; NaN if too little flowed.
    """

    longest: float
    swing: float
    time_constant: float


@dataclass(frozen=True)
class Move:
    """A move of the stem that began at rest: first and last sample, and how far it went [%]."""

    start: int
    stop: int
    distance: float


def span(values: Array) -> Span:
    """Return what a sensor can see, of values [% of span] with NaN where lost, shape (n,)."""
    known = values[np.isfinite(values)]
    step = resolution(known)
    quantum = 0.0 if np.isnan(step) else step / np.sqrt(12.0)
    low, high = float(known.min()), float(known.max())
    noise = float(np.hypot(roughness([values]), quantum))
    return Span(low, high, noise, step, _clipped(known, low, high))


def _clipped(known: Array, low: float, high: float) -> float:
    """Return the share of runs at the ends of the range, if the signal is noisy elsewhere."""
    edge = (known == low) | (known == high)
    elsewhere = np.diff(known)[~(edge[1:] & edge[:-1])]
    if not elsewhere.size or np.mean(elsewhere != 0.0) < 0.9:
        return 0.0
    return _in_runs(known == low) + _in_runs(known == high)


def _in_runs(mask: npt.NDArray[np.bool_]) -> float:
    """Return the share of the samples that lie in runs of at least `CLIPPED_RUN`."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).reshape(-1, 2)
    lengths = edges[:, 1] - edges[:, 0]
    return float(lengths[lengths >= CLIPPED_RUN].sum()) / max(mask.size, 1)


def turns(u: Array) -> Array:
    """Return the turning points of u [%], its first and last value included, shape (m,).

    Wiggles smaller than `SMALLEST_TURN` are passed over.
    """
    points, direction = [float(u[0])], 0
    for value in u[np.flatnonzero(np.diff(u, prepend=np.nan) != 0)].tolist():
        way = value - points[-1]
        if direction and way * direction > 0:
            points[-1] = value
        elif abs(way) >= SMALLEST_TURN:
            points.append(value)
            direction = 1 if way > 0 else -1
    return np.array(points)


def flow(recording: Recording, sign: int, noise: float) -> Flow:
    """Return how the chamber filled (`sign` 1) or emptied (-1).

    Where p1 or p2 was not measured, u and x stand for them; good enough for a plan. A swing of
    less than `FAINT_SWING` times the `noise` [%] of p2 (or x) tells no time constant.
    """
    inlet = recording.p1 if recording.p1 is not None else recording.u
    chamber = recording.p2 if recording.p2 is not None else recording.x
    if chamber is None:
        return Flow(0.0, 0.0, float('nan'))
    longest = swing = work = power = 0.0
    for part in recording.segments:
        time, p2 = recording.time[part], _held(chamber[part])
        drive = _held(inlet[part]) - p2
        there = sign * drive > SMALLEST_DRIVE
        edges = np.flatnonzero(np.diff(there, prepend=False, append=False)).reshape(-1, 2)
        for a, b in edges:
            last = min(int(b), time.size - 1)
            longest = max(longest, float(time[last] - time[a]))
            swing = max(swing, sign * float(p2[last] - p2[a]))
        steps, d = np.diff(time), drive[:-1]
        mask = there[:-1]
        work += float((d[mask] ** 2 * steps[mask]).sum())
        power += float((d * np.diff(p2))[mask].sum())
    told = power > 0.0 and swing >= FAINT_SWING * noise
    return Flow(longest, swing, work / power if told else float('nan'))


def moves(x: Array, noise: float) -> list[Move]:
    """Return the moves of the stem, of x [%] with NaN where lost and the noise of x [%]."""
    held = _held(x)
    if held.size < 3 * WINDOW:
        return []
    sums = np.cumsum(np.concatenate(([0.0], held)))
    means = (sums[WINDOW:] - sums[:-WINDOW]) / WINDOW
    change = means[WINDOW:] - means[:-WINDOW]
    threshold = max(4.0 * noise * np.sqrt(2.0 / WINDOW), STILL)
    way = np.where(np.abs(change) > threshold, np.sign(change), 0.0)
    found = []
    bounds = np.flatnonzero(np.diff(way, prepend=0.0, append=0.0))
    for a, b in pairwise(bounds):
        if way[a]:
            start, stop = int(a) + 1, min(int(b) + 2 * WINDOW - 1, held.size - 1)
            distance = way[a] * float(np.abs(means[min(b + WINDOW, means.size - 1)] - means[a]))
            found.append(Move(start, stop, float(distance)))
    return found


def slips(x: Array, noise: float) -> tuple[int, float]:
    """Return how often the stem slips, and the share of the slips left after two samples.

    The first sample holds only the part of a slip that fell into it. What counts is the step
    beyond the steady motion that follows, which p2 drives. Values are x [%], shape (n,), with NaN
    where lost, and its noise [%].
    """
    held = _held(x)
    steps = np.diff(held)
    k = np.arange(AT_REST, steps.size - 8)
    if not k.size:
        return 0, float('nan')
    driven = np.median([steps[k + later] for later in (4, 5, 6, 7)], axis=0)
    first, second, third = (steps[k + later] - driven for later in (0, 1, 2))
    slip = first + second
    seen = noise * np.sqrt(2.0)
    at = np.abs(slip) > max(SLIP * seen, STILL)
    at &= np.abs(held[k] - held[k - AT_REST]) < max(3.0 * seen, STILL)
    at &= first * steps[k] > 0.0
    at &= np.abs(first) > 0.3 * np.abs(slip)
    at = np.flatnonzero(at)
    at = at[np.diff(at, prepend=-AT_REST) > 3]
    if not at.size:
        return 0, float('nan')
    way = np.sign(slip[at])
    return int(at.size), float((way * third[at]).sum() / (way * slip[at]).sum())


def _held(values: Array) -> Array:
    """Return values with lost ones replaced by the last that was not lost."""
    index = np.where(np.isfinite(values), np.arange(values.size), -1)
    index = np.maximum.accumulate(index)
    first = int(np.argmax(np.isfinite(values)))
    return values[np.where(index < 0, first, index)]
