# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run over a record that is held against what was measured, for searches."""

import math
from typing import Any

from numba import njit

from .borrowing import borrowed
from .pipeline import advance_sample, Array, state_from, theta_from
from .state import State, transition_after, transition_over

HUBER = 4.0
"""Error beyond which a score grows linearly [noise]."""
DOUBTFUL = 1.0
"""Largest error that counts where the moment of a slip is in doubt [noise]."""
NEUTRAL = 1.392
"""Factor of what is left where errors beyond DOUBTFUL are cut, so that noise alone costs the same:
1 / sqrt(E[min(e^2, DOUBTFUL^2)]) of a normal e."""
MOST_IN_DOUBT = 0.5
"""Share of a record in which slips may be in doubt (valves of 87 records stay below 0.38): else a
stem that next to no p2 leaves where it would slip could be anywhere all the time."""
STEM, BESIDE = 2, 3
"""Rows of x, and of the x to hold beside the measured one, among the outputs."""


@njit(forceinline=True)
def penalty(value: float, target: float, scale: float) -> float:
    """Return what a value adds to a score; nothing where the target is NaN."""
    if target != target:
        return 0.0
    error = abs(value - target) * scale
    return error * error if error <= HUBER else HUBER * (2.0 * error - HUBER)


@njit
def forgive(outputs: Array, first: int, last: int, target: Array, scale: Array) -> float:
    """Let errors of x be no larger than if the stem slipped at any moment of some samples.

    Noise alone costs what it does elsewhere: a stem must not slip noise away.

    Parameters
    ----------
    outputs, target, scale
        As for `run_scored`; `outputs` receives the position nearest to the target among those the
        stem passes, but none that is closer than DOUBTFUL unless x itself is, all as much further
        away as NEUTRAL tells.
    first, last : int
        The samples, `last` not among them.

    Returns
    -------
    float
        By how much that lowers the score.
    """
    x = outputs[STEM, first:last]
    low, high = x.min(), x.max()
    relief = 0.0
    for k in range(first, last):
        error = (outputs[STEM, k] - target[k]) * scale[k]
        size = abs(error)
        if size > DOUBTFUL:
            beside = min(max(target[k], low), high)
            size = max(abs(beside - target[k]) * scale[k], DOUBTFUL)
        size += (NEUTRAL - 1.0) * min(size, DOUBTFUL)
        if error == error:
            outputs[BESIDE, k] = target[k] + math.copysign(size, error) / scale[k]
            relief += penalty(outputs[STEM, k], target[k], scale[k])
            relief -= penalty(outputs[BESIDE, k], target[k], scale[k])
    return relief


@njit
def run_scored(
    u: Array,
    dt: Array,
    state: Array,
    theta: Array,
    finest: float,
    effects: Any,
    memory: Any,
    measured: Array,
    outputs: Array,
    signal: int,
    target: Array,
    scale: Array,
    slack: float,
    apart: float,
    bound: float,
) -> float:
    """Take the valve through a record, stages driven by what was measured before them.

    Parameters
    ----------
    u, dt, state, theta, finest, effects, memory
        As for `run`; dt has shape (n,).
    measured : ndarray, shape (3, n)
        p1 and p2 that the stages after them receive, and the x at which the stem is put to rest
        where it is not near [% of span]; NaN where the model's own value goes on.
    outputs : ndarray, shape (4, n)
        Receives p1, p2, x as the model has them before they are replaced, and the x to hold
        beside the measured one, another where the moment of a slip is in doubt [% of span].
    signal : int
        0, 1 or 2: the output to score.
    target : ndarray, shape (n,)
        What it should be [% of span]; NaN where that does not count.
    scale : ndarray, shape (n,)
        One over its noise [1/%].
    slack : float
        Where the stem begins to slip while p2 creeps, less than this in a sample, the moment of
        the slip is in doubt as long as p2 is this close: see `forgive` [% of span].
    apart : float
        A stem no further than this from where it should rest goes on by itself [% of span].
    bound : float
        The run ends as soon as the score exceeds this.

    Returns
    -------
    float
        Sum of squared errors over noise, those beyond HUBER growing linearly.
    """
    parameters = theta_from(theta)
    effects, memory = borrowed(effects), borrowed(memory)
    now = state_from(state)
    transition = other = transition_over(0.0, parameters, finest)
    score = relief = 0.0
    forgiven = 0
    moving, doubtful = True, False  # it rests only once some time has shown it
    slip = 0.0  # p2 where the stem began to slip
    first, pending = 0, 0.0  # start and score of the time in doubt, or of what would be by now
    for k in range(u.size):
        if dt[k] != transition.dt:  # steps often alternate between two lengths
            transition, other = other, transition
            if dt[k] != transition.dt:
                transition = transition_after(transition, dt[k], finest)
        moved, before = moving, now.x
        now, x = advance_sample(u[k], now, parameters, transition, effects, memory)
        moving = now.x != before or (moved and dt[k] == 0.0)
        outputs[0, k] = now.p1
        outputs[1, k] = now.p2
        outputs[2, k] = x
        outputs[BESIDE, k] = x
        added = penalty(outputs[signal, k], target[k], scale[k])
        score += added
        if signal == STEM:
            if doubtful and abs(now.p2 - slip) >= slack:
                relief += forgive(outputs, first, k, target, scale)
                forgiven += k - first
                doubtful, first, pending = False, k, 0.0
            while not doubtful and first < k and abs(outputs[1, first] - now.p2) >= slack:
                pending -= penalty(outputs[STEM, first], target[first], scale[first])
                first += 1
            if moving and not (moved or doubtful):
                doubtful, slip = first < k, now.p2
            pending += added
            if moving and not doubtful:
                first, pending = k + 1, 0.0
            if score - relief - pending > bound:
                break
        elif score > bound:
            break
        p1, p2, rest = measured[0, k], measured[1, k], measured[2, k]
        rests = abs(rest - x) > apart
        now = State(
            p1 if p1 == p1 else now.p1,
            p2 if p2 == p2 else now.p2,
            now.x + (rest - x) if rests else now.x,
            0.0 if rests else now.v,
            0.0 if rests else now.direction,
            0.0 if rests else now.armed,
            now.play,
            now.command,
            now.time,
        )
    if doubtful:
        relief += forgive(outputs, first, k + 1, target, scale)
        forgiven += k + 1 - first
    if forgiven > MOST_IN_DOUBT * u.size:
        outputs[BESIDE] = outputs[STEM]
        relief = 0.0
    for index, value in enumerate(now):
        state[index] = value
    return score - relief
