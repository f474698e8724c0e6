# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Spring force that bends along the stroke."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return the tangent at x of the spring force x (1 + c (x/100)^2) + b 4 x/100 (1 - x/100)."""
    offset, f = value
    hardening, bow = p
    share = min(max(state.x / 100.0, 0.0), 1.0)  # beyond the stroke it goes on straight
    slope = 3.0 * hardening * share * share + 0.04 * bow * (1.0 - 2.0 * share)
    tangent = max(f.stiffness + slope, 0.05) - f.stiffness
    extra = 100.0 * hardening * share**3 + 4.0 * bow * share * (1.0 - share)
    offset -= extra - tangent * 100.0 * share
    return offset, Friction(
        f.static_up, f.static_down, f.dynamic_up, f.dynamic_down, f.stiffness + tangent
    )


EFFECT = Effect(
    id='spring_nonlinearity',
    title='Nonlinear spring',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'hardening',
            'c',
            '-',
            0.3,
            -0.5,
            3.0,
            'linear',
            'Relative extra spring force when fully open, growing with the cube of x',
            starts=(-0.2, -0.05, 0.03, 0.1, 0.4, 1.0),
            usual=(0.03, 1.2),
        ),
        EffectParameter(
            'bow',
            'b',
            '%',
            0.0,
            -25.0,
            25.0,
            'linear',
            'Extra spring force at mid stroke',
            starts=(-10.0, -3.0, -1.0, 1.0, 3.0, 10.0),
            usual=(1.0, 20.0),
        ),
    ),
    slots={'force_slot': force},
    stride=0.04,
    order=70,
    variants=(('hardening',), ('bow',)),
    explanation='Coils close up, or the effective area of the diaphragm changes along the stroke.',
    symptom='The line of x over p2 bends.',
    confirm='Read p2 and x at rest at five openings over the whole stroke.',
    twins={
        'spring_preload': 'a bend needs the whole stroke: use all of it',
        'spring_rate': 'a bend needs the whole stroke: use all of it',
        'sensor_calibration': 'an error of the sensor is a straight line: use the whole stroke',
        'ip_nonlinearity': 'with p1 and p2 unmeasured both bend the line u-x: record p2',
    },
)
