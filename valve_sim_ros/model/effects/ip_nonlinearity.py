# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bow of the electro-pneumatic converter's static line."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter, upstream


@njit
def bowed(value: float, bow: float, exponent: float) -> float:
    """Return a value on a power law, with a parabola added: both leave the ends of the span."""
    if exponent != 1.0:
        value = math.copysign(100.0 * abs(value / 100.0) ** exponent, value)
    return value + bow * value * (100.0 - value) / 2500.0


@njit
def command(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Bend the command by the share before the backlash."""
    return bowed(value, p[0] * p[1], 1.0 + (p[2] - 1.0) * p[1])


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Bend p1 by the share after the backlash."""
    share = 1.0 - p[1]
    return bowed(value, p[0] * share, 1.0 + (p[2] - 1.0) * share)


EFFECT = Effect(
    id='ip_nonlinearity',
    title='Nonlinear electro-pneumatic converter',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'bow',
            'c',
            '%',
            5.0,
            -24.0,
            24.0,
            'linear',
            'Deviation of p1 at mid span',
            starts=(-8.0, -2.0, 2.0, 8.0),
        ),
        upstream(0.5),
        EffectParameter(
            'exponent',
            'n',
            '-',
            1.0,
            0.4,
            2.5,
            'log',
            'Power with which p1 follows the command, ends kept',
            neutral=1.0,
            starts=(0.7, 0.9, 1.1, 1.4),
        ),
    ),
    variants=(('bow', 'upstream'), ('exponent', 'upstream')),
    slots={'command_slot': command, 'inlet_slot': inlet},
    order=10,
    explanation='The converter meets its ends but not the straight line between them.',
    symptom='The static line between u and p1 bends, most at mid span.',
    confirm='Hold u at 0, 25, 50, 75 and 100 % and read p1.',
    twins={
        'ip_calibration': 'a wrong span shows at the ends too: use the whole span of u',
        'spring_nonlinearity': 'with x alone both bend the line u-x: record p2',
    },
)
