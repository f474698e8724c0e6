# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Elastic motion of the stem below breakaway (LuGre bristles)."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..pipeline import Motion, moved
from ..stem import Stem

DROP = 1.0
"""Speed at which bristle friction has fallen from f_s to f_d [%/s]."""
INERTIA, DAMPING = 2000.0, 176.0
"""k/m [1/s^2] and F_v/m [1/s] of the source paper; only their ratio is visible in a record."""


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Replace the step of the stem by a linearly implicit one with bristles."""
    f = value.friction
    stiffness = 1.0 / max(p[0], 1e-4)
    middle = value.target + value.excess * math.exp(-0.5 * value.rate * dt)
    x, v, z = state.x, state.v, memory[0]
    damping = 2.0 * math.sqrt(stiffness / INERTIA)
    static, dynamic = (f.static_up, f.dynamic_up) if v >= 0.0 else (f.static_down, f.dynamic_down)
    ratio = v / DROP
    level = dynamic + (static - dynamic) * math.exp(-ratio * ratio) + 1e-6
    if state.time == 0.0:
        force = min(max(middle - f.stiffness * x, -f.static_down), f.static_up)
        z = force / stiffness
    alpha = 1.0 / (1.0 + dt * stiffness * abs(v) / level)
    bristles = stiffness * alpha * z + (damping * (alpha - 1.0) * z / dt if dt > 0.0 else 0.0)
    push = v + dt * INERTIA * (middle - f.stiffness * x - bristles)
    brake = dt * (f.stiffness + stiffness * alpha) + damping * alpha + DAMPING / INERTIA
    v = push / (1.0 + dt * INERTIA * brake)
    memory[0] = alpha * (z + dt * v)
    stem = Stem(x + dt * v, v, 0.0, False)
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
        ),
    ),
    slots={'motion_slot': motion},
    memory=1,
    longest_step=0.004,
    order=-10,
    explanation='The packing gives way elastically before the stem breaks away.',
    symptom='Micro-motion below f_s, minor loops, and no clean stick.',
    confirm='Small reversals below the breakaway force, with a fine position sensor.',
    twins={
        'sensor_quantisation': 'small steps of a coarse sensor hide micro-motion: finer sensor',
        'hysteresis': 'hysteresis of the converter shows in p1 already: record p1',
    },
    references=('Canudas de Wit, Olsson, Astrom, Lischinsky 1995 (LuGre); models.md sec. 4.3',),
)
