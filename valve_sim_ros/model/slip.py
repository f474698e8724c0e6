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


class Parts(NamedTuple):
    """Parts of a slip's speed along its direction [%/s]: free motion, and what the pressure does.

    The free motion is `one` + `two` if overdamped; else it is `one`, which `two` turns into.
    """

    one: float
    two: float
    push: float


class Gains(NamedTuple):
    """How the parts of a speed change over some time: `free_motion`, and the chamber's decay."""

    one: float
    two: float
    push: float


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


@njit(forceinline=True)
def parts_at_start(slip: Slip, direction: float) -> Parts:
    """Return the parts of a slip's speed when it begins."""
    return Parts(direction * slip.d1, direction * slip.d2, -direction * slip.rate * slip.forced)


@njit(forceinline=True)
def gains_over(tau: float, rate: float, poles: Poles) -> Gains:
    """Return how the parts of a speed change over `tau` seconds."""
    one, two = free_motion(tau, poles)
    return Gains(one, two, math.exp(-rate * tau))


@njit(forceinline=True)
def after(parts: Parts, gains: Gains, regime: int) -> Parts:
    """Return the parts of a speed after the time over which the gains are."""
    one, two, push = parts
    if regime == OVERDAMPED:
        return Parts(one * gains.one, two * gains.two, push * gains.push)
    turned = gains.two * one if regime == UNDERDAMPED else 0.0
    return Parts(gains.one * one + gains.two * two, gains.one * two - turned, push * gains.push)


@njit(forceinline=True)
def over_twice(gains: Gains, regime: int) -> Gains:
    """Return the gains over a time twice as long."""
    one, two = gains.one, gains.two
    push = gains.push * gains.push
    if regime == OVERDAMPED:
        return Gains(one * one, two * two, push)
    turned = two * two if regime == UNDERDAMPED else 0.0
    return Gains(one * one - turned, 2.0 * one * two, push)


@njit(forceinline=True)
def speed_of(parts: Parts, regime: int) -> float:
    """Return the speed along the direction of the slip [%/s]."""
    free = parts.one + parts.two if regime == OVERDAMPED else parts.one
    return free + parts.push


@njit(forceinline=True)
def slope_of(parts: Parts, rate: float, poles: Poles) -> float:
    """Return how fast that speed grows [%/s^2]."""
    two = parts.two if poles.regime == CRITICAL else poles.second * parts.two
    return poles.first * parts.one + two - rate * parts.push


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
def stops_once(parts: Parts, delta: float, rate: float, poles: Poles) -> bool:
    """Tell whether an overdamped slip, faster than delta now, surely falls below it only once.

    A sum of exponentials has no more zeros than its partial sums, from the slowest one on, change
    their sign (Laguerre).
    """
    one, two, push = parts
    slowest = push if rate < -poles.first else one
    quickest = push if rate > -poles.second else two
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
        return stops_once(parts_at_start(slip, direction), delta, slip.rate, poles)
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
    or of an eighth of a period, brackets the first zero, or shows a dip that may reach it. From
    step to step the speed takes no exponential.
    """
    regime, rate = poles.regime, slip.rate
    longest, quickest = math.inf, poles.second
    if regime == UNDERDAMPED:
        longest, quickest = EIGHTH * poles.scale, poles.first
    step = min(0.25 / max(-quickest, rate), longest)
    gains = gains_over(step, rate, poles)
    now = parts_at_start(slip, direction)
    start, bend = 0.0, slope_of(now, rate, poles)
    once = False
    grows = False  # every other step is twice as long
    while start < left:
        if armed and not once and regime == OVERDAMPED:
            once = stops_once(now, delta, rate, poles)
            if once:
                last = after(now, gains_over(left - start, rate, poles), regime)
                if speed_of(last, regime) > delta:
                    return -1.0, armed
        end = start + step
        if end < left:
            then = after(now, gains, regime)
        else:
            end = left
            then = after(now, gains_over(left - start, rate, poles), regime)
        speed, slope = speed_of(then, regime), slope_of(then, rate, poles)
        level = delta if armed else -BACKWARD
        if speed < level or (armed and speed == level):
            return start + stop_within(end - start, now, then, level, rate, poles), armed
        if not once and bend < 0.0 < slope:
            low = dip(end - start, now, then, level, rate, poles)
            if low >= 0.0:
                there = after(now, gains_over(low, rate, poles), regime)
                return start + stop_within(low, now, there, level, rate, poles), armed
        armed = armed or speed > delta
        start, now, bend = end, then, slope
        if grows and 2.0 * step <= longest:
            step, gains = 2.0 * step, over_twice(gains, regime)
        grows = not grows
    return -1.0, armed


@njit
def dip(
    duration: float, parts: Parts, last: Parts, level: float, rate: float, poles: Poles
) -> float:
    """Return when a speed that falls at first and rises at last is below `level`, or -1.

    `parts` are those at first, `last` those after `duration` seconds.
    """
    start, end = 0.0, duration
    first, slope_first = speed_of(parts, poles.regime), slope_of(parts, rate, poles)
    final, slope_final = speed_of(last, poles.regime), slope_of(last, rate, poles)
    for _ in range(30):
        when, low = lowest(end - start, first, slope_first, final, slope_final)
        when += start
        if low > level or not start < when < end:
            return -1.0
        there = after(parts, gains_over(when, rate, poles), poles.regime)
        speed, slope = speed_of(there, poles.regime), slope_of(there, rate, poles)
        if speed < level:
            return when
        if slope < 0.0:
            start, first, slope_first = when, speed, slope
        else:
            end, final, slope_final = when, speed, slope
    return -1.0


@njit
def stop_within(
    duration: float, parts: Parts, last: Parts, level: float, rate: float, poles: Poles
) -> float:
    """Return when the speed falls to `level` within `duration`: Newton, kept in its bracket.

    `parts` are those at first, `last` those at last. Newton begins where a straight line between
    their speeds is at `level`.
    """
    start, end = 0.0, duration
    tolerance = 1e-9 * duration  # a step of Newton squares what is left
    above = speed_of(parts, poles.regime) - level
    below = level - speed_of(last, poles.regime)
    tau = duration * above / (above + below) if above > 0.0 else 0.5 * duration
    for _ in range(60):
        there = after(parts, gains_over(tau, rate, poles), poles.regime)
        above, slope = speed_of(there, poles.regime) - level, slope_of(there, rate, poles)
        if above > 0.0:
            start = tau
        else:
            end = tau
        guess = tau - above / slope if slope < 0.0 else math.inf
        if abs(guess - tau) <= tolerance:
            return guess
        tau = guess if start < guess < end else 0.5 * (start + end)
    return tau
