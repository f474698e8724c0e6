# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that varies along the stroke."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return friction times 1 + slope + bump at the stem's place halfway through the step."""
    offset, f = value
    slope, height, centre, width = p
    x = state.x + 0.5 * dt * state.v
    away = (x - centre) / width
    factor = 1.0 + slope * (x - 50.0) / 50.0 + height * math.exp(-0.5 * away * away)
    factor = max(factor, 0.02)
    return offset, Friction(
        f.static_up * factor,
        f.static_down * factor,
        f.dynamic_up * factor,
        f.dynamic_down * factor,
        f.stiffness,
    )


EFFECT = Effect(
    id='position_dependent_friction',
    title='Friction varies along the stroke',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'slope',
            'g_1',
            '-',
            0.0,
            -0.95,
            0.95,
            'linear',
            'Relative change of friction from mid stroke to fully open',
            starts=(-0.7, -0.35, 0.35, 0.7),
        ),
        EffectParameter(
            'height',
            'h',
            '-',
            1.0,
            0.0,
            10.0,
            'linear',
            'Relative extra friction at the bump',
            starts=(0.6, 2.0),
            usual=(0.3, 3.0),
        ),
        EffectParameter(
            'centre',
            'x_c',
            '%',
            50.0,
            -10.0,
            110.0,
            'linear',
            'Place of the bump',
            neutral=50.0,
            starts=(15.0, 30.0, 42.0, 50.0, 58.0, 70.0, 85.0),
        ),
        EffectParameter(
            'width',
            'w',
            '%',
            8.0,
            1.0,
            50.0,
            'log',
            'Standard width of the bump',
            neutral=8.0,
            starts=(8.0,),
        ),
    ),
    slots={'force_slot': force},
    stride=0.02,
    order=10,
    variants=(('slope',), ('height', 'centre', 'width')),
    explanation='Scoring, deposits or a bent stem make some places of the stroke stiffer.',
    symptom='The band of p2-x widens along the stroke, or the stem hangs up at one place.',
    confirm='A slow ramp over the whole stroke in both directions.',
    twins={
        'friction_drift': 'that one grows with time, not with x: repeat the same stroke later',
        'travel_stops': 'a stop holds x for good: raise p2 further',
    },
)
