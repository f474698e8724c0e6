# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run over a record that is held against what was measured, for searches."""

from typing import Any

from numba import njit

from .borrowing import borrowed
from .pipeline import advance_sample, Array, state_from, theta_from
from .state import State, transition_over

HUBER = 4.0
"""Error beyond which a score grows linearly [noise]."""
DOUBTFUL = 1.0
"""Largest error that counts where the moment of a slip is in doubt [noise]."""
STEM = 2
"""Row of x among the outputs."""


@njit(forceinline=True)
def penalty(value: float, target: float, scale: float) -> float:
    """Return what a value adds to a score; nothing where the target is NaN."""
    if target != target:
        return 0.0
    error = abs(value - target) * scale
    return error * error if error <= HUBER else HUBER * (2.0 * error - HUBER)


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
        Receives p1, p2, x as the model has them before they are replaced [% of span], and 1 where
        the moment of a slip is in doubt, else 0.
    signal : int
        0, 1 or 2: the output to score.
    target : ndarray, shape (n,)
        What it should be [% of span]; NaN where that does not count.
    scale : ndarray, shape (n,)
        One over its noise [1/%].
    slack : float
        As long as p2 creeps, less than this in a sample, and is this close to where the stem
        begins to slip, the moment of the slip is in doubt; errors of x beyond DOUBTFUL do not
        count then [% of span].
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
    score = 0.0
    moving = doubtful = False
    slip = relief = 0.0  # p2 where the last slip began; what the score loses if one begins now
    first = 0  # the first sample that would be in doubt then
    for k in range(u.size):
        if dt[k] != transition.dt:  # steps often alternate between two lengths
            transition, other = other, transition
            if dt[k] != transition.dt:
                transition = transition_over(dt[k], parameters, finest)
        moved, before = moving, now.x
        now, x = advance_sample(u[k], now, parameters, transition, effects, memory)
        moving = now.x != before
        outputs[0, k] = now.p1
        outputs[1, k] = now.p2
        outputs[2, k] = x
        while first < k and abs(outputs[1, first] - now.p2) >= slack:
            if signal == STEM:
                added = penalty(outputs[STEM, first], target[first], scale[first])
                relief -= max(added - DOUBTFUL, 0.0)
            first += 1
        if moving and not moved:
            slip = now.p2
            doubtful = k > 0 and abs(slip - outputs[1, k - 1]) < slack
            if doubtful:
                outputs[3, first:k] = 1.0
                score -= relief
        doubtful = doubtful and abs(now.p2 - slip) < slack
        outputs[3, k] = 1.0 if doubtful else 0.0
        added = penalty(outputs[signal, k], target[k], scale[k])
        beyond = max(added - DOUBTFUL, 0.0) if signal == STEM else 0.0
        score += added - beyond if doubtful else added
        if moving or doubtful:
            first, relief = k + 1, 0.0
        else:
            relief += beyond
        if score - relief > bound:
            break
        p1, p2, rest = measured[0, k], measured[1, k], measured[2, k]
        rests = abs(rest - x) > apart
        moving = moving and not rests
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
    for index, value in enumerate(now):
        state[index] = value
    return score
