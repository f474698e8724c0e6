# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Zero and span of the electro-pneumatic converter."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return p1 = zero + span p1."""
    return p[0] + p[1] * value


EFFECT = Effect(
    id='ip_calibration',
    title='Zero or span error of the electro-pneumatic converter',
    stage='u-p1',
    parameters=(
        EffectParameter('zero', 'p_0', '%', 3.0, -30.0, 30.0, 'linear', 'p1 where it should be 0'),
        EffectParameter(
            'span', 's', '-', 1.0, 0.5, 1.5, 'linear', 'Change of p1 per change of u', neutral=1.0
        ),
    ),
    slots={'inlet_slot': inlet},
    order=0,
    explanation='The converter is out of adjustment: its line from u to p1 is shifted or tilted.',
    symptom='The static line between u and p1 is off by a constant, by a slope, or both.',
    confirm='Hold u at 0, 50 and 100 % and read p1.',
    twins={
        'ip_nonlinearity': 'a bow vanishes at both ends of the span: use the whole span of u',
        'sensor_calibration': 'with x alone a zero of p1 and one of the sensor are one: record p1',
    },
)
