# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Zero of the position sensor that drifts."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..drift import drifted, SETTLING


@njit
def sensor(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return x with the drift so far: r t, or r (1 - exp(-k t))/k if it settles."""
    return value + p[0] * drifted(state.time, p[1])


EFFECT = Effect(
    id='sensor_drift',
    title='Drifting position sensor',
    stage='sensor',
    parameters=(
        EffectParameter(
            'rate',
            'r',
            '%/h',
            10.0,
            -400.0,
            400.0,
            'linear',
            'Drift of measured x per hour',
            starts=(-25.0, -8.0, 8.0, 25.0),
        ),
        SETTLING,
    ),
    variants=(('rate',), ('rate', 'settling')),
    slots={'sensor_slot': sensor},
    order=30,
    explanation='The zero of the position transmitter wanders, for instance with temperature.',
    symptom='A slow trend in the residual of x.',
    confirm='Return to the same stop after an hour.',
    twins={'friction_drift': 'a drift of friction widens the band to both sides: slow reversals'},
)
