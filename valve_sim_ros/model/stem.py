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

from .slip import (
    CRITICAL,
    first_stop,
    free_motion,
    OVERDAMPED,
    Poles,
    Slip,
    slip_position,
    slip_speed,
    surely_moving,
)

MAX_EVENTS = 200
HEAVIEST, FASTEST = 2000.0, 150.0
"""Bounds of k/m [1/s^2] and F_v/m [1/s] where the stem is integrated in short steps."""


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


@njit
def visible(a_1: float, a_2: float) -> tuple[float, float]:
    """Return k/m [1/s^2] and F_v/m [1/s], bounded: beyond, a record shows their ratio only."""
    bounded = min(a_1, HEAVIEST, FASTEST * a_1 / a_2)
    return bounded, bounded * a_2 / a_1


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


@njit
def break_away(
    x: float,
    target: float,
    excess: float,
    rate: float,
    left: float,
    decay: float,
    friction: Friction,
) -> tuple[float, float, float]:
    """Return when a resting stem breaks away, `left` seconds if it does not before, and where to.

    The opening force is target + excess exp(-rate tau); the third value is its excess then.
    `decay` is exp(-rate left).
    """
    spring = friction.stiffness * x
    up, down = spring + friction.static_up, spring - friction.static_down
    pressure = target + excess
    if not down <= pressure <= up:
        return 0.0, 1.0 if pressure > up else -1.0, excess
    final = target + excess * decay
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
    decay: float,
) -> Stem:
    """Advance the stem event by event; `stem_step` says what the arguments are."""
    rate = forced[1]
    left = duration
    for _ in range(MAX_EVENTS):
        if stem.direction == 0.0:
            wait, direction, excess = break_away(
                stem.x, target, excess, rate, left, decay, friction
            )
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
            excess *= fall
            left -= stop
            if left <= 0.0:
                return stem
            decay = math.exp(-rate * left)
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
        if surely_moving(slip, stem.direction, delta, duration, decay, phi1, phi2, poles):
            return Stem(
                slip_position(slip, decay, phi1, phi2),
                slip_speed(slip, decay, phi1, phi2),
                stem.direction,
                True,
            )
    return through_events(stem, target, excess, duration, friction, delta, forced, poles, decay)
