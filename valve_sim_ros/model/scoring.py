# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run over a record that is held against what was measured, for searches."""

from typing import Any

from numba import njit

from .borrowing import borrowed
from .pipeline import advance_sample, Array, State, state_from, theta_from, transition_over

HUBER = 4.0
"""Error beyond which a score grows linearly [noise]."""


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
    bound: float,
) -> float:
    """Take the valve through a record, stages driven by what was measured before them.

    Parameters
    ----------
    u, dt, state, theta, finest, effects, memory
        As for `run`; dt has shape (n,).
    measured : ndarray, shape (3, n)
        p1 and p2 that the stages after them receive, and the x at which the stem is put to rest
        [% of span]; NaN where the model's own value goes on.
    outputs : ndarray, shape (3, n)
        Receives p1, p2, x as the model has them before they are replaced [% of span].
    signal : int
        0, 1 or 2: the output to score.
    target : ndarray, shape (n,)
        What it should be [% of span]; NaN where that does not count.
    scale : ndarray, shape (n,)
        One over its noise [1/%].
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
    for k in range(u.size):
        if dt[k] != transition.dt:  # steps often alternate between two lengths
            transition, other = other, transition
            if dt[k] != transition.dt:
                transition = transition_over(dt[k], parameters, finest)
        now, x = advance_sample(u[k], now, parameters, transition, effects, memory)
        outputs[0, k] = now.p1
        outputs[1, k] = now.p2
        outputs[2, k] = x
        if target[k] == target[k]:
            error = abs(outputs[signal, k] - target[k]) * scale[k]
            score += error * error if error <= HUBER else HUBER * (2.0 * error - HUBER)
            if score > bound:
                break
        p1, p2, rest = measured[0, k], measured[1, k], measured[2, k]
        rests = rest == rest
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
