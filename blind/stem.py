# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chamber pressure to stem position: spring, stops, flow, and dry friction that sticks."""

from math import exp, log10, pi, sin

import numba

from . import state as at
from .inlet import pulse, remembered


@numba.njit
def push(p2, x, s, q, t):
    """Return the force on the stem without friction [% of span]."""
    force = p2 - q.preload - q.spring_rate * x
    force -= q.spring_cubic * x * (0.01 * x) ** 2 + q.spring_bow * 4e-4 * x * (100.0 - x)
    if q.fluid != 0.0:
        if q.fluid_kind == 0.0:
            force += q.fluid * exp(-max(x, 0.0) / q.fluid_fall)
        else:
            force += q.fluid * max(1.0 - 0.01 * x, 0.0) ** 2
    if q.vibration > 0.0:
        force += q.vibration * sin(q.vibration_omega * t)
    if q.hysteresis_at == 2.0:
        force -= q.hysteresis_size * remembered(x, s, q)
    force -= q.relaxation * (x - s[at.CREEP])
    if q.area_wave != 0.0:
        force += q.area_wave * sin(2.0 * pi * p2 / q.area_period)
    if q.kick > 0.0:
        force += q.kick * pulse(t, q.kick_interval, 0.4)
    return force


@numba.njit
def contact(x, q):
    """Return the force of a yielding end stop; stiff ones are limits instead."""
    if q.stop_stiffness == 0.0:
        return 0.0
    if x < q.stop_low:
        return q.stop_stiffness * (q.stop_low - x)
    if x > q.stop_high:
        return q.stop_stiffness * (q.stop_high - x)
    return 0.0


@numba.njit
def friction_scale(direction, x, q, t):
    """Return the factor on both friction levels here and now."""
    since = max(t, 0.0)
    if q.friction_warm_up > 0.0:
        since = q.friction_warm_up * (1.0 - exp(-since / q.friction_warm_up))
    scale = (1.0 + q.asymmetry * direction) * (1.0 + q.friction_drift * since)
    scale *= 1.0 + q.friction_slope * 0.01 * min(max(x, 0.0), 100.0)
    if q.bump > 0.0:
        scale *= 1.0 + q.bump * exp(-(((x - q.bump_at) / q.bump_width) ** 2))
    if q.swing > 0.0:
        scale *= 1.0 + q.swing * sin(q.swing_omega * t)
    return max(scale, 0.05)


@numba.njit
def breakaway(rest, q):
    """Return the static friction after this time at rest."""
    if q.dwell_decade > 0.0:
        return q.f_s * (1.0 + q.dwell_decade * log10(1.0 + rest / q.dwell_time))
    if q.dwell_gain == 0.0:
        return q.f_s
    if q.dwell_rational > 0.0:
        return q.f_s * (1.0 + q.dwell_gain * rest / (rest + q.dwell_time))
    return q.f_s * (1.0 + q.dwell_gain * (1.0 - exp(-rest / q.dwell_time)))


@numba.njit
def coulomb(force, s, q, h, t):
    """Return the new speed of a stem with a breakaway force that drops at once."""
    v = s[at.V]
    direction = 1.0 if (force if v == 0.0 else v) > 0.0 else -1.0
    scale = friction_scale(direction, s[at.X], q, t)
    if v == 0.0:
        s[at.REST] += h
        if abs(force) <= scale * breakaway(s[at.REST], q):
            return 0.0
        s[at.REST] = 0.0
    level = q.f_d
    if q.stribeck > 0.0:
        level += (q.f_s - q.f_d) * exp(-(abs(v / q.stribeck) ** q.stribeck_power))
    new = (v + h * q.a_1 * (force - direction * scale * level)) / (1.0 + h * q.a_2)
    if new * direction <= (q.delta if v != 0.0 else 0.0):
        return 0.0
    return new


@numba.njit
def bristles(force, s, q, h, t):
    """Return the new speed of a stem held by elastic bristles.

    LuGre, Dahl without the drop, elastoplastic where they slide only once they are bent enough.
    """
    v, z = s[at.V], s[at.BRISTLE]
    level = q.f_d
    if q.dahl == 0.0:
        level += (q.f_s - q.f_d) * exp(-((v / q.bristle_stribeck) ** 2))
    level *= friction_scale(1.0 if v > 0.0 else -1.0, s[at.X], q, t)
    slides, bent = 1.0, q.bristle * abs(z)
    if q.bristle_elastic > 0.0:
        least = q.bristle_elastic * q.f_d
        if z * v <= 0.0 or bent <= least:
            slides = 0.0
        elif bent < level:
            slides = sin(0.5 * pi * (bent - least) / (level - least)) ** 2
    keep = 1.0 / (1.0 + h * slides * q.bristle * abs(v) / level)
    elastic = q.bristle * keep * z + q.bristle_damping * (keep - 1.0) * z / h
    inertia = 1.0 + h * q.a_2 + h * q.a_1 * keep * (h * q.bristle + q.bristle_damping)
    new = (v + h * q.a_1 * (force - elastic)) / inertia
    s[at.BRISTLE] = keep * (z + h * new)
    return new


@numba.njit
def brittle(force, s, q, h, t):
    """Return the new speed of a stem that hangs on a spring of its own until that one breaks."""
    moved = s[at.V] != 0.0
    if not moved:
        gives = (force - q.brittle * s[at.BRISTLE]) / (q.brittle + q.spring_rate)
        s[at.X] += gives
        s[at.BRISTLE] += gives
        force = q.brittle * s[at.BRISTLE]
    v = coulomb(force, s, q, h, t)
    if moved and v == 0.0:
        s[at.BRISTLE] = force / q.brittle
    return v


@numba.njit
def stem(p2, s, q, h, t):
    """Advance the stem (the speed first, then the position with the new speed)."""
    x = s[at.X]
    force = push(p2, x, s, q, t) + contact(x, q)
    if q.bristle > 0.0:
        v = bristles(force, s, q, h, t)
    elif q.brittle > 0.0:
        v = brittle(force, s, q, h, t)
        x = s[at.X]
    else:
        v = coulomb(force, s, q, h, t)
    v = min(max(v, -q.v_down), q.v_up)
    x += h * v
    if q.stop_stiffness == 0.0:
        limited = min(max(x, q.stop_low), q.stop_high)
        if limited != x:
            x, v = limited, 0.0
    s[at.X], s[at.V] = x, v
    s[at.CREEP] += h * (x - s[at.CREEP]) / q.relaxation_time
