# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Air leaking from the actuator chamber."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter

MIDDLE, LEAST = 60.0, 1.0
"""p2 at which the rate has its meaning, and below which it does not change any more [%]."""


@njit
def flow(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, float]:
    """Return target and rate of p2' = (p1 - p2) / T_g - k_l p2, k_l as it is at this p2."""
    target, rate = value
    leak_rate, exponent = p
    if exponent != 1.0:
        leak_rate *= (max(state.p2, LEAST) / MIDDLE) ** (exponent - 1.0)
    total = rate + leak_rate
    return target * rate / total, total


EFFECT = Effect(
    id='air_leak',
    title='Leaking actuator',
    stage='p1-p2',
    parameters=(
        EffectParameter(
            'leak_rate',
            'k_l',
            '1/s',
            0.01,
            0.0,
            5.0,
            'linear',
            'Loss of p2 per second and p2',
            starts=(0.003, 0.01, 0.04, 0.15),
        ),
        EffectParameter(
            'exponent',
            'n',
            '-',
            1.0,
            0.3,
            2.0,
            'linear',
            'The loss grows with this power of p2, about 60 %; 0.5 is an orifice, 1 laminar',
            neutral=1.0,
            starts=(0.5,),
        ),
    ),
    slots={'flow_slot': flow},
    order=30,
    variants=(('leak_rate',), ('leak_rate', 'exponent')),
    explanation='Air escapes from the chamber through the diaphragm, a fitting or a seal.',
    symptom='p2 settles below p1, the more so the higher the pressure; emptying seems faster.',
    confirm='Hold u high for several time constants and compare p2 with p1; spray the fittings.',
    twins={
        'ip_calibration': 'with p1 unmeasured a loss of pressure is a span error: record p1',
        'sensor_calibration': 'with x alone a loss of pressure is a span error: record p1 and p2',
        'spring_rate': 'with x alone a loss of pressure is a stiffer spring: record p2',
    },
)
