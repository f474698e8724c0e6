# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bow of the electro-pneumatic converter's static line."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return p1 with a parabola added that is zero at both ends of the span."""
    return value + p[0] * value * (100.0 - value) / 2500.0


EFFECT = Effect(
    id='ip_nonlinearity',
    title='Nonlinear electro-pneumatic converter',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'bow', 'c', '%', 5.0, -24.0, 24.0, 'linear', 'Deviation of p1 at mid span'
        ),
    ),
    slots={'inlet_slot': inlet},
    order=10,
    explanation='The converter meets its ends but not the straight line between them.',
    symptom='The static line between u and p1 bends, most at mid span.',
    confirm='Hold u at 0, 25, 50, 75 and 100 % and read p1.',
    twins={
        'ip_calibration': 'a wrong span shows at the ends too: use the whole span of u',
        'spring_nonlinearity': 'with x alone both bend the line u-x: record p2',
    },
)
