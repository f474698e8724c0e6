# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""First-order lag of the position sensor."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..memory import lagged


@njit
def sensor(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return x behind a lag; exact where x moves evenly during the step."""
    if math.isnan(memory[0]):
        memory[0] = memory[1] = value
    lag = (value - memory[1]) * p[0] / dt if dt > 0.0 else 0.0
    memory[0] = lagged(memory[0] - memory[1] + lag, 0.0, p[0], dt) + value - lag
    memory[1] = value
    return memory[0]


EFFECT = Effect(
    id='sensor_lag',
    title='Slow position sensor',
    stage='sensor',
    parameters=(
        EffectParameter(
            'time_constant',
            'tau',
            's',
            1.0,
            0.0,
            20.0,
            'linear',
            'Time constant of measured x',
            starts=(0.2, 0.7, 2.0),
            usual=(0.05, 4.0),
        ),
    ),
    slots={'sensor_slot': sensor},
    memory=2,
    longest_step=0.1,
    order=10,
    imitated='stem',
    explanation='The position transmitter filters its signal, or the stem is damped so much '
    'that it lags by half a second or more.',
    symptom='Measured slips are rounded.',
    confirm='Move the sensor by hand, or read its damping setting.',
    twins={'ip_lag': 'with x alone slow converters and slow sensors differ only at slips'},
)
