# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Command to inlet pressure: positioner, transducer, its play, hysteresis, lag and supply."""

from math import floor

import numba

from . import state as at


@numba.njit
def play(target, last, half_width):
    """Return the output of a play of this half-width."""
    return min(max(last, target - half_width), target + half_width)


@numba.njit
def plays(target, s, q):
    """Return a signal behind a row of plays (Prandtl-Ishlinskii), half loop width = size."""
    total = 0.0
    for j in range(at.PLAYS):
        # uniformly spread, mean half-width = hysteresis_size
        half = q.hysteresis_size * 2.0 * (j + 0.5) / at.PLAYS
        s[at.PLAY + j] = play(target, s[at.PLAY + j], half)
        total += s[at.PLAY + j]
    return total / at.PLAYS


@numba.njit
def remembered(target, s, q):
    """Return the Bouc-Wen memory of a signal, rate-independent: dz/du = (1 - |z|..)/width."""
    change = target - s[at.HYSTERESIS_INPUT]
    s[at.HYSTERESIS_INPUT] = target
    parts = 1 + int(abs(change) / (0.2 * q.hysteresis_width))
    z = s[at.HYSTERESIS]
    for _ in range(parts):
        du = change / parts
        backward = 0.5 * (1.0 if du * z > 0.0 else -1.0)
        z += du / q.hysteresis_width * (1.0 - abs(z) * (0.5 + backward))
    s[at.HYSTERESIS] = z
    return z


@numba.njit
def hysteresis(target, s, q):
    """Return the signal behind the distributed hysteresis."""
    if q.hysteresis_kind == 1.0:
        behind = plays(target, s, q)
        return behind + q.hysteresis_direct * (target - behind)
    return target - q.hysteresis_size * remembered(target, s, q)


@numba.njit
def fraction(value):
    """Return the part behind the decimal point."""
    return value - floor(value)


@numba.njit
def pulse(t, interval, length):
    """Return +-1 during one pulse at an irregular place of each interval, else 0."""
    j = floor(t / interval)
    begin = (j + 0.9 * fraction(0.6180339887 * j)) * interval
    if begin <= t < begin + length:
        return 1.0 if fraction(0.41421356 * j) > 0.5 else -1.0
    return 0.0


@numba.njit
def positioner(u, s, q, h):
    """Return the command behind the feedback of the measured position."""
    if q.loop_gain == 0.0:
        return u
    error = u - s[at.XM]
    out = u + q.loop_gain * (error + s[at.LOOP])
    if q.loop_windup > 0.0 or q.loop_low < out < q.loop_high:
        s[at.LOOP] += h * q.loop_reset * error
    if q.loop_windup > 0.0:
        most = q.loop_windup / q.loop_gain
        s[at.LOOP] = min(max(s[at.LOOP], -most), most)
    return min(max(out, q.loop_low), q.loop_high)


@numba.njit
def inlet(u, s, q, h, t):
    """Advance the inlet and return p1."""
    u = positioner(u, s, q, h)
    if q.smoothing > 0.0:
        error = u - s[at.SMOOTH]
        s[at.SMOOTH] += h / q.smoothing * error * (1.0 + abs(error) / q.smoothing_error)
        u = s[at.SMOOTH]
    if q.ip_power != 1.0:
        u = 100.0 * (0.01 * max(u, 0.0)) ** q.ip_power
    u = q.ip_zero + q.ip_span * u + q.ip_bow * 4e-4 * u * (100.0 - u)
    if q.hysteresis_kind > 0.0 and q.hysteresis_at == 0.0:
        u = hysteresis(u, s, q)
    s[at.GAP] = play(u, s[at.GAP], q.f_d1)
    p1 = s[at.GAP]
    if q.ip_tau > 0.0:
        s[at.LAG] += (p1 - s[at.LAG]) * h / (q.ip_tau + 0.5 * h)
        p1 = s[at.LAG]
    if q.dip > 0.0 and pulse(t, q.dip_interval, 6.0) != 0.0:
        p1 = p1 * (1.0 - q.dip)
    return min(p1, q.supply)
