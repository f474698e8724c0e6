# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Coarse resolution of the position sensor."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def sensor(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return x rounded to whole steps, of which one lies at the offset."""
    return p[0] * math.floor((value - p[1]) / p[0] + 0.5) + p[1] if p[0] > 0.0 else value


EFFECT = Effect(
    id='sensor_quantisation',
    title='Coarse position sensor',
    stage='sensor',
    parameters=(
        EffectParameter(
            'step',
            'q',
            '%',
            1.0,
            0.0,
            10.0,
            'linear',
            'Smallest change of measured x',
            starts=tuple(0.1 * 1.012**k for k in range(320)),
            step=0.004,
            shown='steps',
            usual=(0.4, 6.0),
        ),
        EffectParameter(
            'offset',
            'o',
            '%',
            0.0,
            0.0,
            10.0,
            'linear',
            'A value of x at which a step lies',
            starts=(0.0,),
            step=0.004,
            shown='offsets',
        ),
    ),
    variants=(('step',), ('step', 'offset')),
    slots={'sensor_slot': sensor},
    order=40,
    explanation='The position signal has few steps, as of a coarse converter or a limit in a bus.',
    symptom='Equal steps in x.',
    confirm='List the distinct values of x.',
    twins={'presliding': 'micro-motion is smooth: list the distinct values of x'},
)
