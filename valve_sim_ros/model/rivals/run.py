# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The makes of a rival: over a record, single step, interpreted step, many candidates at once."""

from functools import cache
from typing import Any

from numba import njit
import numpy as np

from .. import kernels
from ..pipeline import Array


@njit
def advance(u: float, dt: float, state: Any, theta: Any) -> float:
    """Stand for the step of a rival: `kernels.kept` puts that in this place."""
    return 0.0


@njit
def begin(p1: float, p2: float, x: float, theta: Any) -> Array:
    """Stand for the start of a rival."""
    return np.zeros(3)


@njit
def step(
    u: float, dt: float, state: Any, theta: Any, finest: float, effects: Any, memory: Any
) -> float:
    """Take one sample; the interface of `pipeline.step`, whose last three are not needed here."""
    return advance(u, dt, state, theta)


@njit
def run(
    u: Array,
    dt: Array,
    state: Array,
    theta: Array,
    finest: float,
    effects: Any,
    memory: Any,
    outputs: Array,
) -> None:
    """Take a rival through a record; the interface of `pipeline.run`."""
    uniform = dt.size == 1
    for k in range(u.size):
        duration = dt[0] if uniform else dt[k]
        if uniform and k == 0:
            duration = 0.0
        outputs[2, k] = advance(u[k], duration, state, theta)
        outputs[0, k] = state[0]
        outputs[1, k] = state[1]


@njit
def sweep(
    u: Array,
    dt: Array,
    measured: Array,
    counts: Array,
    origin: Array,
    thetas: Array,
    costs: Array,
    slack: float,
) -> None:
    """Add the squared errors of x of many candidates over one stretch of a record.

    A candidate is left as soon as it is worse than the best one so far by the factor `slack`;
    its cost is then infinite.

    Parameters
    ----------
    u, dt : ndarray, shape (n,)
        Inputs [% of span] and times since the sample before [s].
    measured : ndarray, shape (n,)
        x [% of span]; any number where it does not count.
    counts : ndarray of bool, shape (n,)
        Which samples count.
    origin : ndarray, shape (3,)
        p1, p2, x at the start [% of span].
    thetas : ndarray, shape (m, number of parameters)
        The candidates.
    costs : ndarray, shape (m,)
        Costs so far, added to in place.
    slack : float
        At least 1.
    """
    limit = np.inf
    for c in range(costs.size):
        cost = costs[c]
        theta = thetas[c]
        if cost > limit:
            costs[c] = np.inf
            continue
        state = begin(origin[0], origin[1], origin[2], theta)
        for k in range(u.size):
            x = advance(u[k], dt[k], state, theta)
            if counts[k]:
                cost += (x - measured[k]) ** 2
                if cost > limit:
                    cost = np.inf
                    break
        costs[c] = cost
        limit = min(limit, slack * cost + 1e-9)


@cache
def made(model: str, kernel: Any) -> kernels.Make:
    """Return the compiled and interpreted functions of a rival's kernel."""
    slots = {'advance': kernel}
    label = f'{model}_{kernel.py_func.__name__}'
    return kernels.Make(
        kernels.kept(run, slots, label),
        kernels.kept(step, slots, label),
        kernels.interpreted(step, slots),
    )


@cache
def sweeper(model: str, kernel: Any, start: Any) -> Any:
    """Return `sweep` compiled with a rival's kernel and start."""
    label = f'{model}_{kernel.py_func.__name__}'
    return kernels.kept(sweep, {'advance': kernel, 'begin': start}, label)
