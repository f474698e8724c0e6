# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Force of the process fluid on the plug."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return the tangent at x of a closing force F (1 - q x / w)^(1 / q), q = 0: F exp(-x / w)."""
    offset, f = value
    strength, reach, shape = p
    opening = max(state.x, 0.0) / reach
    if shape < 1e-3:
        here = strength * math.exp(-opening)
        fall = here / reach
    else:
        rest = max(1.0 - shape * opening, 1e-9)
        fall = strength / reach * rest ** (1.0 / shape - 1.0)
        here = fall * reach * rest
    stiffness = max(f.stiffness - fall, 0.05)
    tangent = stiffness - f.stiffness
    return offset - here + tangent * state.x, Friction(
        f.static_up, f.static_down, f.dynamic_up, f.dynamic_down, stiffness
    )


EFFECT = Effect(
    id='fluid_force',
    title='Fluid force on the plug',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'force',
            'F_p',
            '%',
            8.0,
            -40.0,
            40.0,
            'linear',
            'Closing force at the seat',
            starts=(-12.0, -5.0, 5.0, 12.0),
            usual=(3.0, 20.0),
        ),
        EffectParameter(
            'reach',
            'w',
            '%',
            30.0,
            3.0,
            200.0,
            'log',
            'Opening over which it would fall to 0 at its first rate',
            neutral=30.0,
            starts=(20.0, 60.0),
        ),
        EffectParameter(
            'shape',
            'q',
            '-',
            0.0,
            0.0,
            1.0,
            'linear',
            'How it falls: 0 exponentially, 1/2 as a parabola, 1 linearly',
            starts=(0.0,),
            step=0.05,
        ),
    ),
    slots={'force_slot': force},
    stride=0.04,
    order=80,
    explanation='The pressure drop over the plug pushes it, most near the seat.',
    symptom='x over p2 is shifted near the seat and less so when open.',
    confirm='Repeat the stroke without process pressure.',
    twins={
        'spring_preload': 'a preload shifts the whole stroke alike: use all of it',
        'spring_nonlinearity': 'a bend of the spring is largest when open: use the whole stroke',
    },
)
