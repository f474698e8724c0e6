# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that changes through the record."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..drift import drifted, SETTLING
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return friction times 1 + r t, or what that settles to."""
    offset, f = value
    factor = max(1.0 + p[0] * drifted(state.time, p[1]), 0.02)
    return offset, Friction(
        f.static_up * factor,
        f.static_down * factor,
        f.dynamic_up * factor,
        f.dynamic_down * factor,
        f.stiffness,
    )


EFFECT = Effect(
    id='friction_drift',
    title='Friction changes with time',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'rate',
            'r',
            '1/h',
            1.0,
            -60.0,
            60.0,
            'linear',
            'Relative change of friction per hour',
            starts=(-3.0, -1.0, 1.0, 3.0, 7.0),
        ),
        SETTLING,
    ),
    variants=(('rate',), ('rate', 'settling')),
    slots={'force_slot': force},
    order=20,
    explanation='The packing wears, dries out, warms up or was tightened during the record.',
    symptom='The band of p2-x grows or shrinks from the start to the end of the record.',
    confirm='Repeat the same strokes at the start and at the end.',
    twins={
        'position_dependent_friction': 'that one depends on x: repeat the same stroke later',
    },
)
