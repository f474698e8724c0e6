# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Elastic motion of the stem below breakaway: bristles that slide (LuGre) or that break."""

import math
from typing import Any, NamedTuple

from numba import njit

from ..declarations import Effect, EffectParameter
from ..slip import forced_gain, stem_poles
from ..state import Motion, moved
from ..stem import Friction, Stem, through_events, visible

STIFFEST = 200.0
"""Bristles are not stiffer than this, relative to the spring: their travel is then not seen."""
STEP, STABLE = 0.008, 2.0
"""Longest step [s], and longest step times the fastest rate."""
SLOW, FAST = 1e-3, 6.0
"""Speeds below which all of f_s - f_d is left, and beyond which nothing [v_s]."""


class Bristles(NamedTuple):
    """Constants of the stem on its bristles.

    k/m [1/s^2], F_v/m [1/s], stiffness and damping [s] of the bristles relative to the spring, v_s
    [%/s], share of f_d up to which they do not slide, and friction.
    """

    inertia: float
    damping: float
    stiffness: float
    bristle_damping: float
    drop_speed: float
    elastic: float
    friction: Friction


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Replace the step of the stem by short ones with bristles (classical Runge-Kutta)."""
    if p[0] <= 0.0:
        return held(value, state, p[2], dt) if p[2] > 0.0 and state.direction == 0.0 else value
    friction, theta = value.friction, value.theta
    stiffness = min(1.0 / p[0], STIFFEST)
    inertia, damping = visible(theta.a_1, theta.a_2)
    omega = math.sqrt(inertia * stiffness)
    b = Bristles(inertia, damping, stiffness, 2.0 * stiffness / omega, p[1], p[3], friction)
    x, v, z = state.x, state.v, memory[0]
    if math.isnan(z):
        force = value.target + value.excess - friction.stiffness * x
        z = min(max(force, -friction.static_down), friction.static_up) / stiffness
    count = math.ceil(dt / min(STEP, STABLE / (damping + 2.0 * omega)))
    h = dt / max(count, 1)
    half_decay = math.exp(-0.5 * value.rate * h)
    now = value.excess
    for _ in range(count):
        middle = now * half_decay
        end = middle * half_decay
        a1, z1 = rates(value.target + now, x, v, z, b)
        v2 = v + 0.5 * h * a1
        a2, z2 = rates(value.target + middle, x + 0.5 * h * v, v2, z + 0.5 * h * z1, b)
        v3 = v + 0.5 * h * a2
        a3, z3 = rates(value.target + middle, x + 0.5 * h * v2, v3, z + 0.5 * h * z2, b)
        v4 = v + h * a3
        a4, z4 = rates(value.target + end, x + h * v3, v4, z + h * z3, b)
        x += h / 6.0 * (v + 2.0 * (v2 + v3) + v4)
        v += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        z += h / 6.0 * (z1 + 2.0 * (z2 + z3) + z4)
        now = end
    memory[0] = z
    return moved(value, Stem(x, v, 0.0, False), value.p2)


@njit
def held(value: Any, state: Any, compliance: float, dt: float) -> Motion:
    """Repeat the step of a resting stem that gives way, in proportion, until its hold breaks."""
    f, theta, target, excess, rate = (
        value.friction,
        value.theta,
        value.target,
        value.excess,
        value.rate,
    )
    begin, end = target + excess, target + excess * math.exp(-rate * dt)
    # the stem follows the pressure, and its spring takes a part of that
    softer = 1.0 + f.stiffness * compliance
    force = begin - f.stiffness * state.x
    level, wait, direction = end, 0.0, 0.0
    if not -f.static_down <= force <= f.static_up:
        level, direction = begin, math.copysign(1.0, force)
    elif end > begin + (f.static_up - force) * softer:
        level, direction = begin + (f.static_up - force) * softer, 1.0
    elif end < begin - (f.static_down + force) * softer:
        level, direction = begin - (f.static_down + force) * softer, -1.0
    x = state.x + compliance / softer * (level - begin)
    if direction == 0.0:
        return moved(value, Stem(x, 0.0, 0.0, False), value.p2)
    if level != begin:
        wait = -math.log((level - target) / excess) / rate
    left = dt - wait
    stem = through_events(
        Stem(x, 0.0, direction, False),
        target,
        level - target,
        left,
        f,
        theta.delta,
        forced_gain(rate, theta.a_1, theta.a_2, f.stiffness),
        stem_poles(theta.a_1 * f.stiffness, theta.a_2),
        math.exp(-rate * left),
    )
    return moved(value, stem, value.p2)


@njit(forceinline=True)
def sliding(z: float, v: float, level: float, dynamic: float, b: Bristles) -> float:
    """Return the share of the bristles that slide: all, or none while they are bent but little."""
    if b.elastic <= 0.0:
        return 1.0
    first, last = b.elastic * dynamic, level
    force = b.stiffness * abs(z)
    if z * v <= 0.0 or force <= first:
        return 0.0
    return (
        0.5 - 0.5 * math.cos(math.pi * (force - first) / (last - first)) if force < last else 1.0
    )


@njit(forceinline=True)
def rates(p2: float, x: float, v: float, z: float, b: Bristles) -> tuple[float, float]:
    """Return the rates of the stem's speed [%/s^2] and of the bristles [%/s]."""
    f = b.friction
    static, dynamic = (f.static_up, f.dynamic_up) if v >= 0.0 else (f.static_down, f.dynamic_down)
    ratio = v / b.drop_speed
    level = dynamic + 1e-6
    if abs(ratio) < FAST:
        fall = math.exp(-ratio * ratio) if abs(ratio) > SLOW else 1.0
        level += (static - dynamic) * fall
    slope = v - b.stiffness * abs(v) * z / level * sliding(z, v, level, dynamic, b)
    force = p2 - f.stiffness * x - b.stiffness * z - b.bristle_damping * slope
    return b.inertia * force - b.damping * v, slope


EFFECT = Effect(
    id='presliding',
    title='Presliding of the packing',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'compliance',
            '1/sigma_0',
            '-',
            0.1,
            0.0,
            3.0,
            'linear',
            'Elastic travel of the stuck stem per force, relative to that of the spring',
            starts=(0.1, 0.35),
            usual=(0.05, 1.2),
        ),
        EffectParameter(
            'drop_speed',
            'v_s',
            '%/s',
            0.1,
            0.005,
            20.0,
            'log',
            'Speed at which friction has fallen from f_s to f_d',
            neutral=0.1,
            starts=(0.1,),
        ),
        EffectParameter(
            'stuck_compliance',
            'c',
            '-',
            0.0,
            0.0,
            3.0,
            'linear',
            'The same if the packing gives way in proportion until its hold breaks',
            starts=(0.06, 0.2, 0.5),
            usual=(0.03, 1.2),
            step=0.02,
        ),
        EffectParameter(
            'elastic',
            'z_ba/z_d',
            '-',
            0.0,
            0.0,
            0.95,
            'linear',
            'Share of f_d up to which the bristles bend without sliding',
            neutral=0.0,
            starts=(0.6,),
            step=0.03,
        ),
    ),
    slots={'motion_slot': motion},
    memory=1,
    order=-10,
    explanation='The packing gives way elastically before the stem breaks away.',
    symptom='Micro-motion below f_s, minor loops, and no clean stick.',
    confirm='Small reversals below the breakaway force, with a fine position sensor.',
    variants=(
        ('compliance', 'drop_speed'),
        ('compliance', 'drop_speed', 'elastic'),
        ('stuck_compliance',),
    ),
    laborious=True,
    twins={
        'sensor_quantisation': 'small steps of a coarse sensor hide micro-motion: finer sensor',
        'hysteresis': 'hysteresis of the converter shows in p1 already: record p1',
    },
    references=(
        'Canudas de Wit, Olsson, Astrom, Lischinsky 1995 (LuGre); models.md sec. 4.3',
        'Dupont, Hayward, Armstrong, Altpeter 2002, Single state elastoplastic friction models',
    ),
)
