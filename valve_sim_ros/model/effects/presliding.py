# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Elastic motion of the stem below breakaway: bristles that slide (LuGre) or that break."""

import math
from typing import Any

from numba import njit

from ..bristles import Bent, Bristles, through
from ..declarations import Effect, EffectParameter
from ..slip import forced_gain, stem_poles
from ..state import Motion, moved
from ..stem import Stem, through_events, visible

STIFFEST, MOST_ELASTIC = 200.0, 0.95
"""Bristles are not stiffer than this, relative to the spring: their travel is then not seen; and
they slide before they break."""


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Replace the step of the stem by one on bristles."""
    if p[0] <= 0.0:
        return held(value, state, p[2], dt) if p[2] > 0.0 and state.direction == 0.0 else value
    friction, theta, target = value.friction, value.theta, value.target
    stiffness = min(1.0 / p[0], STIFFEST)
    inertia, damping = visible(theta.a_1, theta.a_2)
    omega = math.sqrt(inertia * stiffness)
    elastic = min(p[3], MOST_ELASTIC)
    b = Bristles(inertia, damping, stiffness, 2.0 * stiffness / omega, p[1], elastic, friction)
    z = memory[0]
    if math.isnan(z):
        force = target + value.excess - friction.stiffness * state.x
        z = min(max(force, -friction.static_down), friction.static_up) / stiffness
    bent = through(Bent(state.x, state.v, z), target, value.excess, value.rate, dt, b, memory)
    memory[0] = bent.z
    return moved(value, Stem(bent.x, bent.v, 0.0, False), value.p2)


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
            MOST_ELASTIC,
            'linear',
            'Share of f_d up to which the bristles bend without sliding',
            neutral=0.0,
            starts=(0.6,),
            step=0.03,
        ),
    ),
    slots={'motion_slot': motion},
    memory=2,
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
    light=('stuck_compliance',),
    twins={
        'sensor_quantisation': 'small steps of a coarse sensor hide micro-motion: finer sensor',
        'hysteresis': 'hysteresis of the converter shows in p1 already: record p1',
    },
    references=(
        'Canudas de Wit, Olsson, Astrom, Lischinsky 1995 (LuGre); models.md sec. 4.3',
        'Dupont, Hayward, Armstrong, Altpeter 2002, Single state elastoplastic friction models',
    ),
)
