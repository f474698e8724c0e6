# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inlet to chamber pressure: flow through a restriction into a volume that may leak and grow."""

from math import cos, sin, sqrt

import numba

from . import state as at


@numba.njit
def orifice(up, down, critical):
    """Return the mass flow through an orifice by ISO 6358, laminar close to equal pressures."""
    ratio = down / up
    if ratio <= critical:
        return up
    if ratio > 0.998:
        edge = sqrt(1.0 - ((0.998 - critical) / (1.0 - critical)) ** 2)
        return up * edge * (1.0 - ratio) / 0.002
    return up * sqrt(1.0 - ((ratio - critical) / (1.0 - critical)) ** 2)


@numba.njit
def drive(p_in, p2, q):
    """Return the pressure difference that fills or empties, bent by the law of the flow [%]."""
    difference = p_in - p2
    if q.flow_critical >= 0.0:
        up = max(p_in, p2) + q.flow_absolute
        down = min(p_in, p2) + q.flow_absolute
        middle = 50.0 + q.flow_absolute
        unit = orifice(middle + q.flow_reference, middle, q.flow_critical)
        flow = orifice(up, down, q.flow_critical) / unit * q.flow_reference
        return flow if difference > 0.0 else -flow
    if q.flow_exponent != 1.0 and difference != 0.0:
        bent = q.flow_reference * (abs(difference) / q.flow_reference) ** q.flow_exponent
        return bent if difference > 0.0 else -bent
    return difference


@numba.njit
def exhaust_factor(excess, s, q):
    """Return by how much the rate is multiplied at this excess p2 - p1 over the inlet."""
    if q.exhaust_soft > 0.0:
        opening = min(max((excess - q.exhaust_threshold) / q.exhaust_soft, 0.0), 1.0)
        return 1.0 + (q.exhaust_gain - 1.0) * opening
    # once open it may stay so down to a lower excess
    share = q.exhaust_reseat if s[at.EXHAUST] == 1.0 else 1.0
    s[at.EXHAUST] = 1.0 if excess > share * q.exhaust_threshold else 0.0
    return q.exhaust_gain if s[at.EXHAUST] == 1.0 else 1.0


@numba.njit
def leaking(p2, q):
    """Return the rate lost to the outside [%/s]."""
    if q.leak_orifice > 0.0:
        # the same loss as the linear leak at 60 %
        return q.leak * sqrt(60.0 * max(p2, 0.0))
    return q.leak * p2


@numba.njit
def chamber(p_in, s, q, h, t):
    """Advance the chamber pressure."""
    p2 = s[at.P2]
    constant = q.T_g1 if p_in > p2 else q.T_g2
    if q.warming != 0.0:
        constant *= 1.0 + q.warming * (1.0 - cos(q.warming_omega * max(t, 0.0)))
    room = 1.0 + q.volume * 0.01 * s[at.X]
    rate = drive(p_in, p2, q) / (constant * room) * (1.0 - 0.5 * h / constant)
    rate = rate * exhaust_factor(p2 - p_in, s, q) - leaking(p2, q) / room
    if q.volume_absolute >= 0.0:
        rate -= (p2 + q.volume_absolute) * q.volume * 0.01 * s[at.V] / room
    rate = min(max(rate, -q.p2_rate_down), q.p2_rate_up)
    change = h * rate
    if q.flow_exponent < 1.0 and abs(change) > abs(p_in - p2):
        change = p_in - p2
    s[at.P2] = p2 + change
    s[at.WARM] += change - h * s[at.WARM] / q.thermal_time


@numba.njit
def chamber_pressure(s, q, t):
    """Return the pressure in the chamber as gauge and diaphragm feel it."""
    p2 = s[at.P2] + q.thermal * s[at.WARM]
    return p2 + q.ripple * sin(q.ripple_omega * t) if q.ripple > 0.0 else p2
