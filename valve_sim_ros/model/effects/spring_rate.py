# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Spring rate other than nominal."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return the spring's relative stiffness."""
    offset, f = value
    return offset, Friction(
        f.static_up, f.static_down, f.dynamic_up, f.dynamic_down, f.stiffness * p[0]
    )


EFFECT = Effect(
    id='spring_rate',
    title='Spring rate off nominal',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'factor',
            'k',
            '-',
            1.2,
            0.2,
            5.0,
            'log',
            'Spring force per travel, relative to nominal',
            neutral=1.0,
            starts=(0.65, 0.8, 0.9, 1.12, 1.25, 1.5),
            usual=(0.045, 0.45),
        ),
    ),
    slots={'force_slot': force},
    order=60,
    explanation='A wrong, broken or corroded spring, or another bench range.',
    symptom='The slope of x over p2 is off, zero is not.',
    confirm='Read p2 and x at rest at several openings.',
    twins={
        'sensor_calibration': 'a span error moves the stops too and scales slips: drive to stops',
        'spring_nonlinearity': 'a bend needs the whole stroke: use all of it',
    },
)
