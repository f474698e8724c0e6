# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that falls gradually with the stem's speed."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..pipeline import Motion, moved
from ..stem import (
    begin_slip,
    forced_gain,
    free_motion,
    Friction,
    slip_speed,
    Stem,
    stem_poles,
    stem_step,
)

MOST_STEPS = 100


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Repeat the step with the friction that belongs to the speed at its end.

    Friction that falls with speed feeds itself: taken from the speed at the start of the step, the
    stem would break away too late. With friction f over the step the speed at its end is
    linear in f, so the speed solves speed + gain * friction(speed) = free.
    """
    f, theta = value.friction, value.theta
    still = state.direction == 0.0
    if p[0] <= 0.0 or dt == 0.0 or (still and value.stem.direction == 0.0):
        return value
    direction = value.stem.direction if still else state.direction
    level, rise = f.dynamic_up, f.static_up - f.dynamic_up
    if direction < 0.0:
        level, rise = f.dynamic_down, f.static_down - f.dynamic_down
    poles = stem_poles(theta.a_1 * f.stiffness, theta.a_2)
    phi1, phi2 = free_motion(dt, poles)
    forced = forced_gain(value.rate, theta.a_1, theta.a_2, f.stiffness)
    decay = math.exp(-value.rate * dt)
    start = Stem(state.x, state.v, direction, state.armed != 0.0)
    smooth = begin_slip(
        start, value.target, value.excess, Friction(0.0, 0.0, 0.0, 0.0, f.stiffness), forced, poles
    )
    braked = begin_slip(
        start, value.target, value.excess, Friction(0.0, 0.0, 1.0, 1.0, f.stiffness), forced, poles
    )
    free = direction * slip_speed(smooth, decay, phi1, phi2)
    gain = free - direction * slip_speed(braked, decay, phi1, phi2)
    speed = settled(direction * state.v, free - gain * level, gain * rise, p[0])
    drop = rise * math.exp(-((speed / p[0]) ** 2))
    stem = stem_step(
        Stem(state.x, state.v, state.direction, state.armed != 0.0),
        value.target,
        value.excess,
        dt,
        Friction(f.static_up, f.static_down, level + drop, level + drop, f.stiffness),
        theta.delta,
        forced,
        poles,
        decay,
        phi1,
        phi2,
    )
    return moved(value, stem, value.p2)


@njit
def settled(speed: float, free: float, drop: float, fall: float) -> float:
    """Return the speed w that the stem comes to: w + drop exp(-(w / fall)^2) = free.

    Parameters
    ----------
    speed : float
        Where it starts, in the direction of the slip [%/s].
    free, drop : float
        Speed at the end of the step without Stribeck friction, and what that takes off [%/s].
    fall : float
        Speed at which friction falls [%/s].
    """
    near = far = max(speed, 0.0)
    faster = excess_drag(near, free, drop, fall) < 0.0
    for _ in range(MOST_STEPS):  # from the start, so that of several roots the first is met
        near = far
        stride = max(0.15 * fall, 0.3 * (near - 2.0 * fall))
        far = min(near + stride, free) if faster else max(near - stride, 0.0)
        if far == near or (excess_drag(far, free, drop, fall) < 0.0) != faster:
            break
    for _ in range(MOST_STEPS):
        if abs(far - near) <= 1e-6 * (fall + far):
            break
        middle = 0.5 * (near + far)
        if (excess_drag(middle, free, drop, fall) < 0.0) == faster:
            near = middle
        else:
            far = middle
    return far


@njit
def excess_drag(speed: float, free: float, drop: float, fall: float) -> float:
    """Return by how much the stem is faster than its drag allows; see `settled`."""
    ratio = speed / fall
    return speed + drop * math.exp(-ratio * ratio) - free


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
    longest_step=0.01,
    order=-20,
    explanation='A lubricated packing loses friction only as the stem picks up speed.',
    symptom='Slow motion meets almost static friction; repeated slips whose size varies.',
    confirm='Slow and fast ramps: the offset p2-x while moving depends on the speed.',
    twins={
        'presliding': 'presliding shows as motion below f_s: small reversals',
        'dwell_friction': 'that one depends on the time at rest: steps after short and long rests',
    },
    references=('models.md sec. 4.1; Armstrong-Helouvry, Dupont, Canudas de Wit 1994',),
)
