# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which command was in force at which sample.

The valve computes sample k with the newest command it has received. What is recorded are two
other times: when the recorder received that command, and when it received the sample. Their
offset is estimated from how the outputs answer to commands, and kept below a sample: whole
samples of delay are a dead time of the valve and stay in the data.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .quality import Array

Index = npt.NDArray[np.int64]
REACH = 8
"""Samples before and behind a command that are looked at."""
SHIFTS = range(-1, 5)
"""Answers are looked for from one sample before to four behind the first that may show them."""
MOST_EVENTS, ENOUGH_EVENTS = 5000, 1000
"""Commands that are looked at one by one; those that tell the offset."""
FEWEST_ROWS = 7
DECIDED = 8.0
"""Natural logarithm of the odds above which the outputs overrule a stamp."""
LARGEST_ODDS = 25.0
"""What a single command can contribute: one strange answer must not decide for all."""
MOST_SILENT = 2.0 / 3.0
"""Where more of the commands than this share bring no clear answer (x while it sticks, p2 of a
large chamber), the few clear ones may as well be something else: the offset is not estimated."""
PERIODIC = 0.9
"""Where this share of the samples comes with a command, the others have lost theirs."""
AMBIGUOUS = 1e-3
"""Commands stamped so close to a sample [s] may have been used one sample earlier or later."""


@dataclass(frozen=True)
class Hold:
    """Commands on the samples' axis.

    Attributes
    ----------
    command : ndarray, shape (n,)
        In force at each sample [% of span]; NaN before the first.
    offset : float
        How much later samples are stamped than commands [s].
    offset_range : tuple of float
        All offsets that explain the outputs equally well [s]; NaN if the data cannot tell.
    dead_samples : int
        Whole samples by which the outputs answer later still.
    doubtful : ndarray, shape (k,)
        Samples with which commands begin that may as well begin one sample earlier or later.
    decided : int
        Commands whose sample the outputs decided.
    lost : ndarray, shape (l,)
        Samples without a command of their own where nearly all have one.
    """

    command: Array
    offset: float
    offset_range: tuple[float, float]
    dead_samples: int
    doubtful: Index
    decided: int
    lost: Index


def hold(
    stamps: Array,
    values: Array,
    ticks: Array,
    outputs: Mapping[str, Array],
    period: float,
    jitter: float,
) -> Hold:
    """Find the command in force at each sample.

    Parameters
    ----------
    stamps, values : ndarray, shape (m,)
        Receive stamps [s] and commands [% of span], sorted.
    ticks : ndarray, shape (n,)
        Times of the samples on the recorder's clock [s].
    outputs : mapping of str to ndarray, shape (n,)
        Measured outputs, NaN where lost.
    period, jitter : float
        Of the samples [s].
    """
    changes = np.flatnonzero(np.diff(values) != 0) + 1
    events = changes
    if events.size > MOST_EVENTS:
        largest = np.argsort(-np.abs(np.diff(values))[events - 1], kind='stable')[:MOST_EVENTS]
        events = np.sort(events[largest])
    evidence = _evidence(stamps[events], stamps[changes], ticks, outputs, period)
    margin = max(2.0 * jitter, min(AMBIGUOUS, 0.1 * period))
    clear_answers = np.count_nonzero(evidence.min(axis=1, initial=0.0) < -DECIDED)
    if clear_answers < (1.0 - MOST_SILENT) * events.size:
        evidence = np.zeros_like(evidence)
    some = slice(None, None, max(events.size // ENOUGH_EVENTS, 1))
    total, spread = _best_offset(stamps[events][some], evidence[some], ticks, period, margin)
    # a whole sample is a dead time wherever the data allow it: a stamp lags by less
    longest = spread[1] if np.isfinite(spread[1]) else total
    dead = max(int(np.floor(longest / period + 1e-6)), 0)
    offset = total - dead * period
    rows = np.searchsorted(ticks, stamps + offset - 1e-9)
    first = np.searchsorted(ticks, stamps[events])
    position = rows[events] + dead - first - SHIFTS.start
    known = (position >= 0) & (position < len(SHIFTS))
    at = evidence[np.arange(events.size), np.clip(position, 0, len(SHIFTS) - 1)]
    best = evidence.argmax(axis=1)
    near = _distance(stamps[events] + offset, ticks) < 0.5 * period
    overruled = known & near & (at < -DECIDED) & (np.abs(best - position) == 1)
    rows[events[overruled]] += (best - position)[overruled]
    clear = known & (np.sort(evidence, axis=1)[:, -2] < -DECIDED)
    close = _distance(stamps[events] + offset, ticks)
    doubtful = (close < margin) & (close > 1e-9) & ~clear
    rows = np.maximum.accumulate(rows)
    index = np.searchsorted(rows, np.arange(ticks.size), side='right') - 1
    return Hold(
        np.where(index >= 0, values[np.maximum(index, 0)], np.nan),
        offset,
        (spread[0] - dead * period, spread[1] - dead * period),
        dead,
        rows[events[doubtful]],
        int(overruled.sum()),
        _lost(rows, ticks.size),
    )


def _lost(rows: Index, samples: int) -> Index:
    """Return the samples without a command between the first and the last, if they are few."""
    sent = np.zeros(samples, dtype=bool)
    sent[rows[rows < samples]] = True
    inside = slice(int(np.argmax(sent)), samples - int(np.argmax(sent[::-1])))
    few = sent[inside].mean() >= PERIODIC
    return inside.start + np.flatnonzero(~sent[inside] & few)


def _evidence(
    events: Array, changes: Array, ticks: Array, outputs: Mapping[str, Array], period: float
) -> Array:
    """Return the log odds of each shift of the answer to each command, shape (m, shifts).

    p1 answers with a step, p2 and x with a kink; each shift is judged by how well a smooth curve
    with such a break fits the samples around. Where p1 is measured it tells alone: p2 begins to
    answer as soon as a command comes, p1 shows it a sample later if it is read just before.
    """
    outputs = {'p1': outputs['p1']} if 'p1' in outputs else outputs
    odds = np.zeros((events.size, len(SHIFTS)))
    if not events.size or ticks.size < 2 * REACH + 1:
        return odds
    lag = np.arange(-REACH, REACH + 1)
    first = np.searchsorted(ticks, events)
    rows = first[:, None] + lag
    inside = (rows >= 0) & (rows < ticks.size)
    rows = np.clip(rows, 0, ticks.size - 1)
    expected = ticks[np.clip(first, 0, ticks.size - 1)][:, None] + period * lag
    inside &= np.abs(ticks[rows] - expected) < 0.5 * period
    place = np.searchsorted(changes, events)
    borders = np.concatenate(([-np.inf], changes, [np.inf]))
    inside &= ticks[rows] > (borders[place] + 1.5 * period)[:, None]
    inside &= ticks[rows] < (borders[place + 2] - 0.5 * period)[:, None]
    for name, values in outputs.items():
        seen = values[rows]
        mask = inside & np.isfinite(seen)
        usable = mask.sum(axis=1) >= FEWEST_ROWS
        if not usable.any():
            continue
        misfits = np.array(
            [_misfit(seen[usable], mask[usable], _break(name, lag, shift)) for shift in SHIFTS]
        ).T
        count = mask[usable].sum(axis=1)[:, None]
        odds[usable] -= 0.5 * count * np.log(misfits / count + 1e-6)
    odds -= odds.max(axis=1, keepdims=True, initial=-np.inf)
    # an answer that seems best at the last shift came later still: nobody knows when
    odds[odds[:, -1] == 0.0] = 0.0
    return np.maximum(odds, -LARGEST_ODDS)


def _break(name: str, lag: Index, shift: int) -> Array:
    """Return the curves that make up an answer which starts at `shift`, shape (rows, k)."""
    t = lag / REACH
    behind = np.maximum(lag - shift, 0) / REACH
    if name == 'p1':
        return np.stack([np.ones_like(t), t, (lag >= shift).astype(float)], axis=1)
    return np.stack([np.ones_like(t), t, t**2, behind, behind**2], axis=1)


def _misfit(seen: Array, mask: npt.NDArray[np.bool_], curves: Array) -> Array:
    """Return the squared misfit of the curves to each row of samples, shape (m,)."""
    weight = mask.astype(float)
    mean = np.nansum(seen * weight, axis=1) / weight.sum(axis=1)
    y = np.where(mask, seen - mean[:, None], 0.0)
    errors = np.empty_like(y)
    whole = mask.all(axis=1)
    # rows without a lost sample share one projection
    errors[whole] = y[whole] - y[whole] @ (np.linalg.pinv(curves).T @ curves.T)
    w, rest = weight[~whole], y[~whole]
    normal = np.einsum('mr,ri,rj->mij', w, curves, curves, optimize=True)
    normal += 1e-9 * np.eye(curves.shape[1])
    found = np.linalg.solve(normal, (rest @ curves)[:, :, None])[:, :, 0]
    errors[~whole] = w * (rest - found @ curves.T)
    return np.asarray((errors**2).sum(axis=1))


def _best_offset(
    events: Array, evidence: Array, ticks: Array, period: float, margin: float
) -> tuple[float, tuple[float, float]]:
    """Return the offset [s] and the range of those that explain the outputs as well.

    Where the outputs do not tell, the offset is small and does not cut through a crowd of
    commands with the same phase.
    """
    grid = period * np.arange(-38, 118) / 40.0
    grid[np.abs(grid) < 1e-12] = 0.0
    first = np.searchsorted(ticks, events)
    told, near = np.empty(grid.size), np.empty(grid.size)
    for k, offset in enumerate(grid):
        moved = events + offset
        shift = np.searchsorted(ticks, moved - 1e-9) - first - SHIFTS.start
        inside = (shift >= 0) & (shift < len(SHIFTS))
        column = np.clip(shift, 0, len(SHIFTS) - 1)
        odds = evidence[np.arange(events.size), column]
        told[k] = np.where(inside, odds, -LARGEST_ODDS).sum()
        distance = _distance(moved, ticks)
        near[k] = ((distance < margin) & (distance > 1e-9)).sum()
    prior = -0.5 * near - max(4.0, 0.5 * events.size) * np.abs(grid) / period
    best = int((told + prior).argmax())
    equal = told >= told.max() - 1.0
    low = high = best
    while low > 0 and equal[low - 1]:
        low -= 1
    while high < grid.size - 1 and equal[high + 1]:
        high += 1
    tells = events.size and told.max() - told.min() > DECIDED
    spread = (float(grid[low]), float(grid[high])) if tells else (float('nan'), float('nan'))
    return float(grid[best]), spread


def _distance(stamps: Array, ticks: Array) -> Array:
    """Return how far each stamp is from the nearest tick."""
    right = np.clip(np.searchsorted(ticks, stamps), 1, max(ticks.size - 1, 1))
    right = np.minimum(right, ticks.size - 1)
    left = np.maximum(right - 1, 0)
    return np.asarray(np.minimum(np.abs(stamps - ticks[left]), np.abs(ticks[right] - stamps)))
