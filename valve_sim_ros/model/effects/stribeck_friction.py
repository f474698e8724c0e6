# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that falls gradually with the stem's speed."""

import math
from typing import Any, NamedTuple

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion, moved
from ..stem import break_away, Friction, Stem, visible

TOLERANCE, SLOW = 5e-3, 0.2
"""Error of the speed in a step, as a part of the speed, or of so much of v_s if that is more."""
FIRST, SHORTEST, STABLE = 0.05, 2e-4, 2.4
"""First step of a slip times the fastest rate of the stem, shortest [s], and longest, likewise."""
LESS, MORE, SAFE = 0.3, 3.0, 0.8
"""A step is at least and at most so many times the one before, and so much of what would do."""
LEAST, NOTHING = 0.05, 1e-9
"""Part of a step that a stem takes at least to stop, and the time left [s] that is none: a stem
that cannot start must not hang."""
FAST, GAUSSIAN = 25.0, 2.0
"""Power of the speed [v_s] beyond which nothing of f_s - f_d is left, and the usual exponent."""


class Slipping(NamedTuple):
    """A stem that slips.

    Direction, k/m [1/s^2], F_v/m [1/s], stiffness, levels [%], v_s [%/s], exponent.
    """

    direction: float
    a_1: float
    a_2: float
    stiffness: float
    level: float
    rise: float
    fall: float
    exponent: float


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Repeat the step, if the stem moves in it, with friction that follows its speed.

    Classical Runge-Kutta, its steps as short as the speed asks: friction that falls with speed
    feeds itself, and a train of slips remembers every error.
    """
    moves = state.direction != 0.0 or value.stem.direction != 0.0 or value.stem.x != state.x
    if p[0] <= 0.0 or dt == 0.0 or not moves:
        return value
    f, theta, rate = value.friction, value.theta, value.rate
    a_1, a_2 = visible(theta.a_1, theta.a_2)
    fastest = max(a_2, math.sqrt(a_1 * f.stiffness))
    stem = Stem(state.x, state.v, state.direction, state.armed != 0.0)
    slip = slipping(stem.direction, f, a_1, a_2, p)
    excess, left, longest = value.excess, dt, STABLE / fastest
    h = longest
    while left > NOTHING:
        if stem.direction == 0.0:
            fall = math.exp(-rate * left)
            wait, direction, excess = break_away(stem.x, value.target, excess, rate, left, fall, f)
            if wait >= left:
                break
            left -= wait
            stem = Stem(stem.x, 0.0, direction, False)
            slip = slipping(direction, f, a_1, a_2, p)
            h = FIRST / fastest
        h = min(h, left)
        decay = math.exp(-0.5 * rate * h)
        after, part, error = slipped(stem, value.target, excess, decay, h, slip, theta.delta)
        factor = min(max(SAFE * (1.0 / max(error, 1e-9)) ** (1.0 / 3.0), LESS), MORE)
        again = error > 1.0 and h > SHORTEST
        if not again:
            stem = after
            left -= part * h
            excess *= math.exp(-rate * part * h) if part < 1.0 else decay * decay
        h = min(max(factor * h, SHORTEST), longest)
    return moved(value, stem, value.p2)


@njit
def slipping(direction: float, f: Friction, a_1: float, a_2: float, p: Any) -> Slipping:
    """Return the constants of a slip."""
    level, rise = f.dynamic_up, f.static_up - f.dynamic_up
    if direction < 0.0:
        level, rise = f.dynamic_down, f.static_down - f.dynamic_down
    return Slipping(direction, a_1, a_2, f.stiffness, level, rise, p[0], p[1])


@njit
def slipped(
    stem: Stem,
    target: float,
    excess: float,
    decay: float,
    h: float,
    slip: Slipping,
    delta: float,
) -> tuple[Stem, float, float]:
    """Return the stem after `h` seconds, or at its stop, which part it took, and the error.

    The excess of p2 over the target falls by `decay` in half of `h`; the error is in tolerances.
    """
    x, v = stem.x, stem.v
    middle = target + excess * decay
    a1 = acceleration(target + excess, x, v, slip)
    v2 = v + 0.5 * h * a1
    a2 = acceleration(middle, x + 0.5 * h * v, v2, slip)
    v3 = v + 0.5 * h * a2
    a3 = acceleration(middle, x + 0.5 * h * v2, v3, slip)
    v4 = v + h * a3
    a4 = acceleration(target + excess * decay * decay, x + h * v3, v4, slip)
    error = h * (abs(a3 - a2) + abs(a1 - a2 - a3 + a4) / 6.0)
    error /= TOLERANCE * (abs(v) + SLOW * slip.fall)
    end = v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
    speed = slip.direction * end
    if speed <= 0.0 or (stem.armed and speed <= delta):
        part = max(v / (v - end) if v != end else 0.0, LEAST)
        return Stem(x + 0.5 * h * part * v, 0.0, 0.0, False), min(part, 1.0), error
    x += h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
    return Stem(x, end, slip.direction, stem.armed or speed > delta), 1.0, error


@njit(forceinline=True)
def acceleration(p2: float, x: float, v: float, slip: Slipping) -> float:
    """Return the acceleration of a slipping stem [%/s^2]."""
    power, level = v / slip.fall, slip.level
    power = power * power if slip.exponent == GAUSSIAN else abs(power) ** slip.exponent
    if power < FAST:
        level += slip.rise * math.exp(-power)
    return slip.a_1 * (p2 - slip.stiffness * x - slip.direction * level) - slip.a_2 * v


EFFECT = Effect(
    id='stribeck_friction',
    title='Stribeck friction',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'velocity',
            'v_s',
            '%/s',
            5.0,
            0.0,
            100.0,
            'linear',
            'Speed at which friction falls',
            starts=(1.0, 4.0, 15.0),
            usual=(0.5, 32.0),
        ),
        EffectParameter(
            'exponent',
            'n',
            '-',
            GAUSSIAN,
            0.5,
            4.0,
            'linear',
            'of exp(-(v/v_s)^n): 2 Gaussian, 1 exponential',
            neutral=GAUSSIAN,
            starts=(1.0,),
        ),
    ),
    variants=(('velocity',), ('velocity', 'exponent')),
    slots={'motion_slot': motion},
    order=-20,
    explanation='A lubricated packing loses friction only as the stem picks up speed.',
    symptom='Slow motion meets almost static friction; repeated slips whose size varies.',
    confirm='Slow and fast ramps: the offset p2-x while moving depends on the speed.',
    laborious=True,
    rugged=True,
    imitated='friction',
    twins={
        'presliding': 'presliding shows as motion below f_s: small reversals',
        'dwell_friction': 'that one depends on the time at rest: steps after short and long rests',
    },
    references=(
        'models.md sec. 4.1; Armstrong-Helouvry, Dupont, Canudas de Wit 1994',
        'Exponent 0.5 to 1: Bo, Pavelescu 1982, Wear 82, 277-289',
    ),
)
