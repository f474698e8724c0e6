# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that falls gradually with the stem's speed."""

import math
from typing import Any, NamedTuple

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion, moved
from ..stem import Friction, Stem, visible

STEP, STABLE = 0.002, 0.4
"""Longest step [s], and longest step times the fastest rate of the stem."""
CALM, STEADY = 4, 0.003
"""How much longer steps are while a short one changes the speed by no more than this part."""
FAST = 5.0
"""Speed beyond which nothing of f_s - f_d is left [v_s]."""


class Slipping(NamedTuple):
    """A stem that slips: direction, k/m [1/s^2], F_v/m [1/s], stiffness, levels [%], v_s [%/s]."""

    direction: float
    a_1: float
    a_2: float
    stiffness: float
    level: float
    rise: float
    fall: float


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Repeat the step, if the stem moves in it, with friction that follows its speed.

    Classical Runge-Kutta in short steps: friction that falls with speed feeds itself, and a train
    of slips remembers every error.
    """
    moves = state.direction != 0.0 or value.stem.direction != 0.0 or value.stem.x != state.x
    if p[0] <= 0.0 or dt == 0.0 or not moves:
        return value
    f, theta = value.friction, value.theta
    a_1, a_2 = visible(theta.a_1, theta.a_2)
    fastest = max(a_2, math.sqrt(a_1 * f.stiffness))
    left = math.ceil(dt / min(STEP, STABLE / fastest))
    short = dt / left
    decay = math.exp(-value.rate * short)
    stem = Stem(state.x, state.v, state.direction, state.armed != 0.0)
    slip = slipping(stem.direction, f, a_1, a_2, p[0])
    end = value.target + value.excess
    calm = False
    while left > 0:
        count = CALM if calm and left >= CALM else 1
        begin, h = end, count * short
        end = value.target + (begin - value.target) * (decay**CALM if count == CALM else decay)
        left -= count
        if stem.direction == 0.0:
            spring = f.stiffness * stem.x
            up, down = spring + f.static_up, spring - f.static_down
            if down <= end <= up:
                continue
            level = up if end > up else down
            if down <= begin <= up:  # it breaks away within the step
                h *= (end - level) / (end - begin)
                begin = level
            stem = Stem(stem.x, 0.0, 1.0 if end > up else -1.0, False)
            slip = slipping(stem.direction, f, a_1, a_2, p[0])
        speed = stem.v
        stem = slipped(stem, begin, end, h, slip, theta.delta)
        calm = abs(stem.v - speed) < STEADY * count * abs(speed)
    return moved(value, stem, value.p2)


@njit
def slipping(direction: float, f: Friction, a_1: float, a_2: float, fall: float) -> Slipping:
    """Return the constants of a slip."""
    level, rise = f.dynamic_up, f.static_up - f.dynamic_up
    if direction < 0.0:
        level, rise = f.dynamic_down, f.static_down - f.dynamic_down
    return Slipping(direction, a_1, a_2, f.stiffness, level, rise, fall)


@njit
def slipped(
    stem: Stem, before: float, after: float, h: float, slip: Slipping, delta: float
) -> Stem:
    """Return the stem after `h` seconds in which p2 goes from `before` to `after`, or its stop."""
    x, v = stem.x, stem.v
    middle = 0.5 * (before + after)
    a1 = acceleration(before, x, v, slip)
    v2 = v + 0.5 * h * a1
    a2 = acceleration(middle, x + 0.5 * h * v, v2, slip)
    v3 = v + 0.5 * h * a2
    a3 = acceleration(middle, x + 0.5 * h * v2, v3, slip)
    v4 = v + h * a3
    a4 = acceleration(after, x + h * v3, v4, slip)
    end = v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
    speed = slip.direction * end
    if speed <= 0.0 or (stem.armed and speed <= delta):
        part = v / (v - end) if v != end else 0.0
        return Stem(x + 0.5 * h * part * v, 0.0, 0.0, False)
    x += h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
    return Stem(x, end, slip.direction, stem.armed or speed > delta)


@njit(forceinline=True)
def acceleration(p2: float, x: float, v: float, slip: Slipping) -> float:
    """Return the acceleration of a slipping stem [%/s^2]."""
    ratio = v / slip.fall
    level = slip.level
    if abs(ratio) < FAST:
        level += slip.rise * math.exp(-ratio * ratio)
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
        ),
    ),
    slots={'motion_slot': motion},
    order=-20,
    explanation='A lubricated packing loses friction only as the stem picks up speed.',
    symptom='Slow motion meets almost static friction; repeated slips whose size varies.',
    confirm='Slow and fast ramps: the offset p2-x while moving depends on the speed.',
    laborious=True,
    rugged=True,
    twins={
        'presliding': 'presliding shows as motion below f_s: small reversals',
        'dwell_friction': 'that one depends on the time at rest: steps after short and long rests',
    },
    references=('models.md sec. 4.1; Armstrong-Helouvry, Dupont, Canudas de Wit 1994',),
)
