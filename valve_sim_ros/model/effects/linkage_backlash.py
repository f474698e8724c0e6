# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Play between the stem and its position sensor."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..electro_pneumatic import backlash


@njit
def sensor(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return x behind a play of the given width."""
    if math.isnan(memory[0]):
        memory[0] = value
    memory[0] = backlash(memory[0], value, 0.5 * p[0])
    return memory[0]


EFFECT = Effect(
    id='linkage_backlash',
    title='Play in the feedback linkage',
    stage='sensor',
    parameters=(
        EffectParameter(
            'width',
            'b',
            '%',
            1.5,
            0.0,
            20.0,
            'linear',
            'Play between stem and sensor',
            starts=(0.6, 1.5, 3.0, 5.0),
            usual=(0.2, 7.0),
        ),
    ),
    slots={'sensor_slot': sensor},
    memory=1,
    order=0,
    imitated='friction',
    balance=lambda f_s, width: max(f_s - 0.5 * width, 0.1 * f_s),
    explanation='A loose joint between the stem and the position sensor.',
    symptom='Measured x holds after each reversal although the force moved on.',
    confirm='Watch stem and sensor by hand while the valve reverses.',
    twins={
        'dwell_friction': 'that one depends on the time at rest: steps after different rests',
        'hysteresis': 'distributed hysteresis gives way from the first moment: slow reversals',
    },
)
