# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A slip of the stem in closed form: where it is, how fast, and when it stops.

A linear oscillator pushed by a force that approaches its target exponentially; see `stem`.
"""

import math
from typing import NamedTuple

from numba import njit

OVERDAMPED, CRITICAL, UNDERDAMPED = 0, 1, 2


class Poles(NamedTuple):
    """Free motion of the stem: two real poles, or a decay rate and an angular frequency [1/s].

    `scale` [s] is one over what the closed form of a slip divides by: their difference, or the
    frequency.
    """

    regime: int
    first: float
    second: float
    scale: float


class Slip(NamedTuple):
    """Closed form of one slip: x = base + forced e^(-rate tau) + c1 phi1 + c2 phi2."""

    base: float
    forced: float
    rate: float
    c1: float
    c2: float
    d1: float
    d2: float


@njit
def stem_poles(a_1: float, a_2: float) -> Poles:
    """Return the poles of s^2 + a_2 s + a_1, written so that nothing cancels."""
    half = 0.5 * a_2
    discriminant = half * half - a_1
    if abs(discriminant) <= 1e-12 * half * half:
        return Poles(CRITICAL, -half, -half, 1.0)
    if discriminant > 0.0:
        root = math.sqrt(discriminant)
        first, second = -a_1 / (half + root), -half - root
        return Poles(OVERDAMPED, first, second, 1.0 / (first - second))
    omega = math.sqrt(-discriminant)
    return Poles(UNDERDAMPED, -half, omega, 1.0 / omega)


@njit
def free_motion(tau: float, poles: Poles) -> tuple[float, float]:
    """Return the two basis functions phi1, phi2 of the free motion at `tau` [s]."""
    decay = math.exp(poles.first * tau)
    if poles.regime == OVERDAMPED:
        return decay, math.exp(poles.second * tau)
    if poles.regime == CRITICAL:
        return decay, tau * decay
    return decay * math.cos(poles.second * tau), decay * math.sin(poles.second * tau)


@njit
def forced_gain(rate: float, a_1: float, a_2: float, stiffness: float) -> tuple[float, float]:
    """Return the stem's response to exp(-rate tau), and the rate moved off a resonance."""
    denominator = rate * rate - a_2 * rate + a_1 * stiffness
    if abs(denominator) < 1e-9 * a_1 * stiffness:
        rate *= 1.0 + 1e-6
        denominator = rate * rate - a_2 * rate + a_1 * stiffness
    return a_1 / denominator, rate


@njit(forceinline=True)
def slip_position(slip: Slip, decay: float, phi1: float, phi2: float) -> float:
    """Return x where exp(-rate tau) = `decay` and the basis functions are phi1, phi2."""
    return slip.base + slip.forced * decay + slip.c1 * phi1 + slip.c2 * phi2


@njit(forceinline=True)
def slip_speed(slip: Slip, decay: float, phi1: float, phi2: float) -> float:
    """Return the stem's speed where `slip_position` returns its position."""
    return slip.d1 * phi1 + slip.d2 * phi2 - slip.rate * slip.forced * decay


@njit
def speed_and_acceleration(tau: float, slip: Slip, poles: Poles) -> tuple[float, float]:
    """Return the stem's speed [%/s] and acceleration [%/s^2] at `tau` seconds into the slip."""
    phi1, phi2 = free_motion(tau, poles)
    push = slip.rate * slip.forced * math.exp(-slip.rate * tau)
    one, two = slip.d1 * phi1, slip.d2 * phi2
    if poles.regime == OVERDAMPED:
        bend = poles.first * one + poles.second * two
    elif poles.regime == CRITICAL:
        bend = poles.first * (one + two) + slip.d2 * phi1
    else:
        bend = poles.first * (one + two) + poles.second * (slip.d2 * phi1 - slip.d1 * phi2)
    return one + two - push, bend + slip.rate * push


@njit(forceinline=True)
def surely_moving(
    slip: Slip,
    direction: float,
    delta: float,
    decay: float,
    phi1: float,
    phi2: float,
    poles: Poles,
) -> bool:
    """Tell whether a lower bound of the speed over the whole interval stays above delta."""
    push = -direction * slip.rate * slip.forced
    bound = min(push, push * decay) - delta
    if poles.regime == OVERDAMPED:
        first, second = direction * slip.d1, direction * slip.d2
        return bound + min(first, first * phi1) + min(second, second * phi2) > 0.0
    reach = 1.0 if poles.regime == UNDERDAMPED else -1.0 / (math.e * poles.first)
    return bound - abs(slip.d1) - reach * abs(slip.d2) > 0.0


@njit
def first_stop(
    slip: Slip, direction: float, armed: bool, delta: float, left: float, poles: Poles
) -> tuple[float, bool]:
    """Return when the slip ends within `left` seconds (-1 if it does not), and its arming.

    The speed is a sum of at most four exponentials, each of which acts about its own time
    constant, or a decaying oscillation: a scan with steps that grow with the time since the start,
    or of an eighth of a period, brackets the first zero.
    """
    growth = 1.5
    if poles.regime == UNDERDAMPED:
        step, growth = 0.25 * math.pi / poles.second, 1.0
    else:
        step = 0.25 / max(-poles.second, slip.rate)
    start = 0.0
    while start < left:
        end = min(start + step, left)
        speed = direction * speed_and_acceleration(end, slip, poles)[0]
        level = delta if armed else 0.0
        if speed < level or (armed and speed == level):
            return stop_between(start, end, slip, direction, level, poles), armed
        armed = armed or speed > delta
        start = end
        step *= growth
    return -1.0, armed


@njit
def stop_between(
    start: float, end: float, slip: Slip, direction: float, level: float, poles: Poles
) -> float:
    """Return when the speed falls to `level` between two times: Newton, kept in its bracket."""
    tolerance = 1e-15 * end
    tau = 0.5 * (start + end)
    for _ in range(60):
        speed, acceleration = speed_and_acceleration(tau, slip, poles)
        above = direction * speed - level
        if above > 0.0:
            start = tau
        else:
            end = tau
        slope = direction * acceleration
        guess = tau - above / slope if slope < 0.0 else start
        if not start < guess < end:
            guess = 0.5 * (start + end)
        if abs(guess - tau) <= tolerance:
            break
        tau = guess
    return tau
