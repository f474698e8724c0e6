# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated valve in small fixed steps of physical time, compiled."""

from typing import NamedTuple

import numba
import numpy as np

from . import state as at
from .chamber import chamber, chamber_pressure
from .inlet import inlet
from .physics import Physics
from .sensor import sense
from .stem import stem

CONSTANTS = np.dtype([(name, np.float64) for name in Physics._fields])
STEP = 1e-3
"""Step of the integrator [s]."""


class Trace(NamedTuple):
    """Inlet pressure, chamber pressure, measured and true position [%], each shape (n,)."""

    p1: np.ndarray
    p2: np.ndarray
    x: np.ndarray
    stem: np.ndarray


@numba.njit
def _run(commands, command_steps, sample_steps, q, h, origin):
    """Advance the valve to the last sample; return the samples, shape (4, n)."""
    s = np.zeros(at.SIZE)
    for j in (at.P2, at.X, at.XM, at.GAP, at.LAG, at.SMOOTH, at.CREEP, at.LINK, at.SENSED):
        s[j] = commands[0]
    s[at.HYSTERESIS_INPUT] = commands[0]
    s[at.PLAY :] = commands[0]
    steps = sample_steps[-1] + 1
    inlet_history = np.empty(steps)
    ip_delay = round(q.ip_delay / h)
    tube_delay = round(q.tube_delay / h)
    samples = np.empty((4, sample_steps.size))
    c, k = 0, 0
    for i in range(steps):
        t = i * h - origin
        while c + 1 < commands.size and command_steps[c + 1] + ip_delay <= i:
            c += 1
        p1 = inlet(commands[c], s, q, h, t)
        inlet_history[i] = p1
        p2 = chamber_pressure(s, q, t)
        while k < sample_steps.size and sample_steps[k] == i:
            samples[0, k], samples[1, k], samples[2, k] = p1, p2, s[at.XM]
            samples[3, k] = s[at.X]
            k += 1
        stem(p2, s, q, h, t)
        chamber(inlet_history[max(i - tube_delay, 0)], s, q, h, t)
        sense(s, q, h, t)
    return samples


def simulate(
    commands: np.ndarray,
    command_times: np.ndarray,
    sample_times: np.ndarray,
    physics: Physics,
    *,
    step: float = STEP,
    origin: float = 0.0,
) -> Trace:
    """Simulate a valve that rests at the first command.

    Parameters
    ----------
    commands, command_times : ndarray, shape (m,)
        Commands [%] and when they arrive [s], from 0; each holds until the next.
    sample_times : ndarray, shape (n,)
        When the signals are sampled [s], ascending; at equal times the command comes first.
    physics : Physics
        The valve.
    step : float
        Step of the integrator [s].
    origin : float
        Time at which drifts begin and periodic effects have phase zero [s].
    """
    constants = np.array([tuple(physics)], dtype=CONSTANTS)[0]
    samples = _run(
        np.ascontiguousarray(commands, dtype=np.float64),
        np.rint(command_times / step).astype(np.int64),
        np.maximum(np.rint(sample_times / step), 0).astype(np.int64),
        constants,
        float(step),
        float(origin),
    )
    return Trace(*samples)
