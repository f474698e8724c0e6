# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Spring preload: the stem moves only above a pressure."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion, moved
from ..stem import Friction, Stem


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return the opening force p2 - p_0."""
    offset, friction = value
    return offset - p[0], friction


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Let the plug rest in its seat at the closed end."""
    stem = value.stem
    if stem.x >= p[1]:
        return value
    seated = Stem(p[1], 0.0, 0.0, False)
    return moved(value, seated, value.p2)


EFFECT = Effect(
    id='spring_preload',
    title='Spring preload',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'pressure',
            'p_0',
            '%',
            5.0,
            -40.0,
            40.0,
            'linear',
            'Pressure that the preload takes',
            usual=(1.5, 16.0),
            positive=True,
        ),
        EffectParameter(
            'seat',
            'x_s',
            '%',
            0.0,
            -50.0,
            5.0,
            'linear',
            'Opening at which the plug rests in its seat; -50: out of reach',
            neutral=-50.0,
            starts=(0.0,),
            step=0.3,
        ),
    ),
    variants=(('pressure',), ('pressure', 'seat')),
    slots={'force_slot': force, 'motion_slot': motion},
    order=20,
    explanation='The spring is compressed at the closed end, or its seat has been readjusted.',
    symptom='x sits off the line x = p2 by a constant; a dead zone at the closed end.',
    confirm='Read p2 at which the stem leaves its seat, and x at rest with no friction.',
    twins={
        'sensor_calibration': 'a zero error shifts the stops too: drive to both stops',
        'friction_asymmetry': 'asymmetry changes the slips in both directions: slow ramps',
        'ip_calibration': 'with p1 and p2 unmeasured a zero of p1 is the same: record p2',
    },
)
