# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What effects remember between steps: delayed signals, plays and lags.

A memory full of NaN remembers nothing yet.
"""

import math
from typing import Any

from numba import njit

DELAY_SIZE = 4099
"""Numbers that a delayed signal needs: up to 2,048 changes on their way."""


@njit
def delayed(value: float, now: float, delay: float, memory: Any) -> tuple[float, float, float]:
    """Return a held signal `delay` seconds ago, the value before that, and when it changed.

    Parameters
    ----------
    value : float
        Signal from `now` on.
    now, delay : float
        Time since the first sample and dead time [s].
    memory : ndarray, shape (DELAY_SIZE,)
        A ring of changes: their times and values, first and last, and the value before the first.

    Returns
    -------
    float
        Value in force at `now`.
    float
        Value in force before that.
    float
        When the one took over from the other [s]; minus infinity if nothing changed yet.
    """
    room = (DELAY_SIZE - 3) // 2
    if math.isnan(memory[0]):
        memory[0] = memory[1] = 0.0
        memory[2] = memory[3] = value
        memory[3 + room] = -math.inf
    first, last = int(memory[0]), int(memory[1])
    if value != memory[3 + last]:
        last = (last + 1) % room
        memory[3 + last] = value
        memory[3 + room + last] = now
        if last == first:
            first = (first + 1) % room
    while first != last:
        following = (first + 1) % room
        if memory[3 + room + following] + delay > now + 1e-9:
            break
        memory[2] = memory[3 + first]
        first = following
    memory[0], memory[1] = first, last
    return memory[3 + first], memory[2], memory[3 + room + first] + delay


@njit
def held_mean(before: float, after: float, changed: float, now: float, dt: float) -> float:
    """Return the mean over the last `dt` seconds of a signal that `changed` once [s]."""
    if dt <= 0.0 or changed <= now - dt:
        return after
    share = min(max((now - changed) / dt, 0.0), 1.0)
    return before + share * (after - before)


@njit
def lagged(value: float, driven: float, time_constant: float, dt: float) -> float:
    """Return `value` after `dt` seconds of a first-order lag towards `driven`."""
    if time_constant <= 0.0:
        return driven
    return driven + (value - driven) * math.exp(-dt / time_constant)


@njit
def mean_of_plays(value: float, width: float, memory: Any) -> float:
    """Return the mean of plays of evenly spread half-widths up to `width`.

    This is the Prandtl-Ishlinskii operator with a uniform density; `memory` holds one number per
    play.
    """
    count = len(memory)
    total = 0.0
    for index in range(count):
        half = width * (index + 1) / count
        if math.isnan(memory[index]):
            memory[index] = value
        memory[index] = min(max(memory[index], value - half), value + half)
        total += memory[index]
    return total / count


@njit
def bouc_wen(value: float, width: float, reach: float, memory: Any) -> float:
    """Return a signal that lags behind `value` by up to `width` after a reversal.

    This is the Bouc-Wen model without dynamics, dz = dv / reach (1 - |z|) while |z| grows and
    dz = dv / reach while it falls, exactly; `memory` holds the last `value` and z.
    """
    if math.isnan(memory[0]):
        memory[0], memory[1] = value, 0.0
    way = 1.0 if value >= memory[0] else -1.0
    change = abs(value - memory[0]) / reach
    along = way * memory[1]
    if along < 0.0:
        unloaded = min(change, -along)
        along += unloaded
        change -= unloaded
    if change > 0.0:
        along = 1.0 - (1.0 - along) * math.exp(-change)
    memory[0], memory[1] = value, way * along
    return value - width * memory[1]
