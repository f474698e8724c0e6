# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stem position to measured position: linkage, hysteresis, lag, line, drift and steps."""

from math import exp, floor, pi, sin

import numba

from . import state as at
from .inlet import hysteresis, play


@numba.njit
def drifted(t, q):
    """Return for how long a zero has drifted in effect [s]: less and less as it warms up."""
    if q.sensor_warm_up == 0.0:
        return t
    return q.sensor_warm_up * (1.0 - exp(-t / q.sensor_warm_up))


@numba.njit
def sense(s, q, h, t):
    """Advance the sensor; its reading goes to the state XM."""
    s[at.LINK] = play(s[at.X], s[at.LINK], q.linkage)
    x = s[at.LINK]
    if q.hysteresis_kind > 0.0 and q.hysteresis_at == 1.0:
        x = hysteresis(x, s, q)
    if q.cyclic > 0.0:
        x += q.cyclic * sin(2.0 * pi * x / q.cyclic_period)
    if q.sensor_tau > 0.0:
        s[at.SENSED] += (x - s[at.SENSED]) * h / (q.sensor_tau + 0.5 * h)
        x = s[at.SENSED]
    x = q.sensor_zero + q.sensor_span * x + q.sensor_drift * drifted(max(t, 0.0), q)
    if q.sensor_step > 0.0:
        x = q.sensor_step * floor(x / q.sensor_step + 0.5)
    s[at.XM] = x
