# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Air leaking from the actuator chamber."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def flow(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, float]:
    """Return target and rate of p2' = (p1 - p2) / T_g - k_l p2."""
    target, rate = value
    total = rate + p[0]
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
    ),
    slots={'flow_slot': flow},
    order=30,
    explanation='Air escapes from the chamber through the diaphragm, a fitting or a seal.',
    symptom='p2 settles below p1, the more so the higher the pressure; emptying seems faster.',
    confirm='Hold u high for several time constants and compare p2 with p1; spray the fittings.',
    twins={
        'ip_calibration': 'with p1 unmeasured a loss of pressure is a span error: record p1',
        'sensor_calibration': 'with x alone a loss of pressure is a span error: record p1 and p2',
        'spring_rate': 'with x alone a loss of pressure is a stiffer spring: record p2',
    },
)
