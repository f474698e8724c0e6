# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Zero and span of the electro-pneumatic converter."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter, upstream


@njit
def command(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Apply the share of zero and span that lies before the backlash."""
    return p[0] * p[2] + (1.0 + (p[1] - 1.0) * p[2]) * value


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Apply the share of zero and span that lies after the backlash."""
    after = 1.0 - p[2]
    return p[0] * after + (1.0 + (p[1] - 1.0) * after) * value


EFFECT = Effect(
    id='ip_calibration',
    title='Zero or span error of the electro-pneumatic converter',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'zero',
            'p_0',
            '%',
            3.0,
            -30.0,
            30.0,
            'linear',
            'p1 where it should be 0',
            starts=(-2.0, 0.0, 2.0),
            usual=(0.4, 5.5),
            shown='zeros',
        ),
        EffectParameter(
            'span',
            's',
            '-',
            1.0,
            0.5,
            1.5,
            'linear',
            'Change of p1 per change of u',
            neutral=1.0,
            starts=(0.93, 1.0, 1.07),
            usual=(0.008, 0.13),
            shown='spans',
        ),
        upstream(0.5),
    ),
    variants=(('zero', 'span', 'upstream'),),
    slots={'command_slot': command, 'inlet_slot': inlet},
    order=0,
    explanation='The converter is out of adjustment: its line from u to p1 is shifted or tilted.',
    symptom='The static line between u and p1 is off by a constant, by a slope, or both.',
    confirm='Hold u at 0, 50 and 100 % and read p1.',
    twins={
        'ip_nonlinearity': 'a bow vanishes at both ends of the span: use the whole span of u',
        'sensor_calibration': 'with x alone a zero of p1 and one of the sensor are one: record p1',
    },
)
