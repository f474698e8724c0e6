# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A slip of the stem in closed form: where it is, how fast, and when it stops.

A linear oscillator pushed by a force that approaches its target exponentially; see `stem`.
"""

import math
from typing import NamedTuple

from numba import njit

OVERDAMPED, CRITICAL, UNDERDAMPED = 0, 1, 2
BACKWARD = 1e-9
"""So much speed against its direction [%/s] is rounding and does not end a slip that begins."""
EIGHTH = 0.25 * math.pi
"""Longest step of a scan for the stop of a swing, an eighth of its period [rad]."""


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


@njit(forceinline=True)
def slip_acceleration(slip: Slip, decay: float, phi1: float, phi2: float, poles: Poles) -> float:
    """Return the stem's acceleration where `slip_position` returns its position [%/s^2]."""
    one, two = slip.d1 * phi1, slip.d2 * phi2
    if poles.regime == OVERDAMPED:
        bend = poles.first * one + poles.second * two
    elif poles.regime == CRITICAL:
        bend = poles.first * (one + two) + slip.d2 * phi1
    else:
        bend = poles.first * (one + two) + poles.second * (slip.d2 * phi1 - slip.d1 * phi2)
    return bend + slip.rate * slip.rate * slip.forced * decay


@njit
def speed_and_acceleration(tau: float, slip: Slip, poles: Poles) -> tuple[float, float]:
    """Return the stem's speed [%/s] and acceleration [%/s^2] at `tau` seconds into the slip."""
    phi1, phi2 = free_motion(tau, poles)
    decay = math.exp(-slip.rate * tau)
    return (
        slip_speed(slip, decay, phi1, phi2),
        slip_acceleration(slip, decay, phi1, phi2, poles),
    )


@njit(forceinline=True)
def lowest(
    duration: float, first: float, slope_first: float, last: float, slope_last: float
) -> tuple[float, float]:
    """Return when a speed that falls at first and rises at last is lowest at least, and how low.

    A bent up curve stays above its tangents: there they meet.
    """
    when = (last - first - slope_last * duration) / (slope_first - slope_last)
    return when, first + slope_first * when


@njit(forceinline=True)
def stops_once(
    slip: Slip,
    direction: float,
    delta: float,
    decay: float,
    phi1: float,
    phi2: float,
    poles: Poles,
) -> bool:
    """Tell whether an overdamped slip, faster than delta now, surely falls below it only once.

    A sum of exponentials has no more zeros than its partial sums, from the slowest one on, change
    their sign (Laguerre). `decay`, `phi1` and `phi2` are those of now.
    """
    one, two = direction * slip.d1 * phi1, direction * slip.d2 * phi2
    push = -direction * slip.rate * slip.forced * decay
    slowest = push if slip.rate < -poles.first else one
    quickest = push if slip.rate > -poles.second else two
    return slowest <= delta or one + two + push - quickest >= delta


@njit(forceinline=True)
def surely_moving(
    slip: Slip,
    direction: float,
    delta: float,
    duration: float,
    decay: float,
    phi1: float,
    phi2: float,
    poles: Poles,
) -> bool:
    """Tell whether the speed of an armed slip surely stays above delta over an interval.

    `decay`, `phi1` and `phi2` are those at its end.
    """
    if direction * slip_speed(slip, decay, phi1, phi2) <= delta:
        return False
    if poles.regime == OVERDAMPED:
        return stops_once(slip, direction, delta, 1.0, 1.0, 1.0, poles)
    quickest = max(1.0 / (EIGHTH * poles.scale), -poles.first, slip.rate)
    if poles.regime == UNDERDAMPED and quickest * duration <= 1.0:
        first = direction * slip_speed(slip, 1.0, 1.0, 0.0)
        slope_first = direction * slip_acceleration(slip, 1.0, 1.0, 0.0, poles)
        last = direction * slip_speed(slip, decay, phi1, phi2)
        slope_last = direction * slip_acceleration(slip, decay, phi1, phi2, poles)
        if not slope_first < 0.0 < slope_last:
            return True
        return lowest(duration, first, slope_first, last, slope_last)[1] > delta
    push = -direction * slip.rate * slip.forced
    reach = 1.0 if poles.regime == UNDERDAMPED else -1.0 / (math.e * poles.first)
    return min(push, push * decay) - delta - abs(slip.d1) - reach * abs(slip.d2) > 0.0


@njit
def first_stop(
    slip: Slip, direction: float, armed: bool, delta: float, left: float, poles: Poles
) -> tuple[float, bool]:
    """Return when the slip ends within `left` seconds (-1 if it does not), and its arming.

    The speed is a sum of at most four exponentials, each of which acts about its own time
    constant, or a decaying oscillation: a scan with steps that grow with the time since the start,
    or of an eighth of a period, brackets the first zero, or shows a dip that may reach it. No scan
    is needed where there is but one.
    """
    longest, quickest = math.inf, poles.second
    if poles.regime == UNDERDAMPED:
        longest, quickest = EIGHTH * poles.scale, poles.first
    step = 0.25 / max(-quickest, slip.rate)
    start = 0.0
    bend = speed_and_acceleration(start, slip, poles)[1]
    once = False
    while start < left:
        if armed and not once and poles.regime == OVERDAMPED:
            one, two = free_motion(start, poles)
            fall = math.exp(-slip.rate * start)
            once = stops_once(slip, direction, delta, fall, one, two, poles)
        end = left if once else min(start + min(step, longest), left)
        speed, slope = speed_and_acceleration(end, slip, poles)
        level = delta if armed else -BACKWARD
        if direction * speed < level or (armed and direction * speed == level):
            return stop_between(start, end, slip, direction, level, poles), armed
        if not once and direction * bend < 0.0 < direction * slope:
            low = dip(start, end, slip, direction, level, poles)
            if low >= 0.0:
                return stop_between(start, low, slip, direction, level, poles), armed
        armed = armed or direction * speed > delta
        start, bend = end, slope
        step *= 1.5
    return -1.0, armed


@njit
def dip(
    start: float, end: float, slip: Slip, direction: float, level: float, poles: Poles
) -> float:
    """Return when a speed that falls at first and rises at last is below `level`, or -1."""
    first, slope_first = speed_and_acceleration(start, slip, poles)
    last, slope_last = speed_and_acceleration(end, slip, poles)
    for _ in range(30):
        when, low = lowest(
            end - start,
            direction * first,
            direction * slope_first,
            direction * last,
            direction * slope_last,
        )
        when += start
        if low > level or not start < when < end:
            return -1.0
        speed, slope = speed_and_acceleration(when, slip, poles)
        if direction * speed < level:
            return when
        if direction * slope < 0.0:
            start, first, slope_first = when, speed, slope
        else:
            end, last, slope_last = when, speed, slope
    return -1.0


@njit
def stop_between(
    start: float, end: float, slip: Slip, direction: float, level: float, poles: Poles
) -> float:
    """Return when the speed falls to `level` between two times: Newton, kept in its bracket."""
    tolerance = 1e-9 * end  # a step of Newton squares what is left
    tau = 0.5 * (start + end)
    for _ in range(60):
        speed, acceleration = speed_and_acceleration(tau, slip, poles)
        above = direction * speed - level
        if above > 0.0:
            start = tau
        else:
            end = tau
        slope = direction * acceleration
        guess = tau - above / slope if slope < 0.0 else math.inf
        if abs(guess - tau) <= tolerance:
            return guess
        tau = guess if start < guess < end else 0.5 * (start + end)
    return tau
