# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stage p2 to x: the stick-slip stem of eq. (10), stepped exactly from event to event.

Inside a sample the chamber pressure is p2(tau) = target + excess * exp(-rate tau). While the stem
slips in direction s, x'' + a_2 x' + a_1 k x = a_1 (p2 - s f_d) is linear, so position and
speed are closed forms; while it sticks, it rests until |p2 - k x| exceeds the static friction.
k is the relative stiffness of the spring, 1 for the paper's valve.
"""

import math
from typing import NamedTuple

from numba import njit

OVERDAMPED, CRITICAL, UNDERDAMPED = 0, 1, 2
MAX_EVENTS = 200
HEAVIEST, FASTEST = 2000.0, 150.0
"""Bounds of k/m [1/s^2] and F_v/m [1/s] where the stem is integrated in short steps."""


class Poles(NamedTuple):
    """Free motion of the stem: two real poles, or a decay rate and an angular frequency [1/s].

    `scale` [s] is one over what the closed form of a slip divides by: their difference, or the
    frequency.
    """

    regime: int
    first: float
    second: float
    scale: float


class Stem(NamedTuple):
    """State of the stem: position [%], speed [%/s], slip direction (0 sticks) and arming.

    A slip is armed once its speed has exceeded delta; only then does falling below delta stop it.
    """

    x: float
    v: float
    direction: float
    armed: bool


class Friction(NamedTuple):
    """Friction levels, opening and closing [%], and relative stiffness of the spring."""

    static_up: float
    static_down: float
    dynamic_up: float
    dynamic_down: float
    stiffness: float


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
def visible(a_1: float, a_2: float) -> tuple[float, float]:
    """Return k/m [1/s^2] and F_v/m [1/s], bounded: beyond, a record shows their ratio only."""
    bounded = min(a_1, HEAVIEST, FASTEST * a_1 / a_2)
    return bounded, bounded * a_2 / a_1


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
def begin_slip(
    stem: Stem,
    target: float,
    excess: float,
    friction: Friction,
    forced: tuple[float, float],
    poles: Poles,
) -> Slip:
    """Fit the closed form of a slip to the stem's position and speed at its start."""
    gain, rate = forced
    offset = friction.dynamic_up if stem.direction > 0.0 else -friction.dynamic_down
    base = (target - offset) / friction.stiffness
    force = gain * excess
    y0 = stem.x - base - force
    w0 = stem.v + force * rate
    if poles.regime == OVERDAMPED:
        r1, r2 = poles.first, poles.second
        c1 = (w0 - r2 * y0) * poles.scale
        c2 = (r1 * y0 - w0) * poles.scale
        return Slip(base, force, rate, c1, c2, r1 * c1, r2 * c2)
    half = -poles.first
    if poles.regime == CRITICAL:
        c2 = w0 + half * y0
        return Slip(base, force, rate, y0, c2, w0, -half * c2)
    c2 = (w0 + half * y0) * poles.scale
    return Slip(base, force, rate, y0, c2, w0, -half * c2 - poles.second * y0)


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


@njit
def break_away(
    x: float, target: float, excess: float, rate: float, left: float, friction: Friction
) -> tuple[float, float, float]:
    """Return when a resting stem breaks away, `left` seconds if it does not before, and where to.

    The opening force is target + excess exp(-rate tau); the third value is its excess then.
    """
    spring = friction.stiffness * x
    up, down = spring + friction.static_up, spring - friction.static_down
    pressure = target + excess
    if not down <= pressure <= up:
        return 0.0, 1.0 if pressure > up else -1.0, excess
    final = target + excess * math.exp(-rate * left)
    if down <= final <= up:
        return left, 0.0, excess
    level = up if final > up else down
    wait = -math.log((level - target) / excess) / rate
    return max(wait, 0.0), 1.0 if final > up else -1.0, level - target


@njit
def through_events(
    stem: Stem,
    target: float,
    excess: float,
    duration: float,
    friction: Friction,
    delta: float,
    forced: tuple[float, float],
    poles: Poles,
) -> Stem:
    """Advance the stem event by event; `stem_step` says what the arguments are."""
    rate = forced[1]
    left = duration
    for _ in range(MAX_EVENTS):
        if stem.direction == 0.0:
            wait, direction, excess = break_away(stem.x, target, excess, rate, left, friction)
            if wait >= left:
                return stem
            left -= wait
            stem = Stem(stem.x, 0.0, direction, False)
        slip = begin_slip(stem, target, excess, friction, forced, poles)
        stop, armed = first_stop(slip, stem.direction, stem.armed, delta, left, poles)
        if stop >= 0.0:
            fall = math.exp(-slip.rate * stop)
            one, two = free_motion(stop, poles)
            stem = Stem(slip_position(slip, fall, one, two), 0.0, 0.0, False)
            excess *= math.exp(-rate * stop)
            left -= stop
            if left <= 0.0:
                return stem
            continue
        fall = math.exp(-slip.rate * left)
        one, two = free_motion(left, poles)
        return Stem(
            slip_position(slip, fall, one, two),
            slip_speed(slip, fall, one, two),
            stem.direction,
            armed,
        )
    return stem


@njit(forceinline=True)
def stem_step(
    stem: Stem,
    target: float,
    excess: float,
    duration: float,
    friction: Friction,
    delta: float,
    forced: tuple[float, float],
    poles: Poles,
    decay: float,
    phi1: float,
    phi2: float,
) -> Stem:
    """Advance the stem through one interval, eq. (10), event by event.

    Parameters
    ----------
    stem : Stem
        State at the start of the interval.
    target, excess : float
        p2(tau) = target + excess exp(-rate tau) [% of span].
    duration : float
        Length of the interval [s].
    friction : Friction
        Friction levels that hold over the interval.
    delta : float
        Speed below which an armed slip stops [%/s].
    forced, poles : tuple
        What `forced_gain` and `stem_poles` return.
    decay, phi1, phi2 : float
        exp(-rate duration) and `free_motion(duration, poles)`, so that an interval without an
        event, the usual case, costs no exponential.

    Returns
    -------
    Stem
    """
    if stem.direction == 0.0:
        spring = friction.stiffness * stem.x
        up, down = spring + friction.static_up, spring - friction.static_down
        pressure, final = target + excess, target + excess * decay
        if max(pressure, final) <= up and min(pressure, final) >= down:
            return stem
    elif stem.armed:
        slip = begin_slip(stem, target, excess, friction, forced, poles)
        if surely_moving(slip, stem.direction, delta, decay, phi1, phi2, poles):
            return Stem(
                slip_position(slip, decay, phi1, phi2),
                slip_speed(slip, decay, phi1, phi2),
                stem.direction,
                True,
            )
    return through_events(stem, target, excess, duration, friction, delta, forced, poles)
