# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that differs between opening and closing."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return friction times 1 + d when opening, 1 - d when closing."""
    offset, f = value
    up, down = 1.0 + p[0], 1.0 - p[0]
    return offset, Friction(
        f.static_up * up,
        f.static_down * down,
        f.dynamic_up * up,
        f.dynamic_down * down,
        f.stiffness,
    )


EFFECT = Effect(
    id='friction_asymmetry',
    title='Friction differs between opening and closing',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'difference',
            'd',
            '-',
            0.3,
            -0.95,
            0.95,
            'linear',
            'Opening friction is 1 + d, closing friction 1 - d times the mean',
            starts=(-0.5, -0.2, 0.2, 0.5),
            usual=(0.08, 0.72),
        ),
    ),
    slots={'force_slot': force},
    order=0,
    explanation='Packing, guides or the fluid resist one direction of travel more than the other.',
    symptom='The opening and the closing band of p2-x differ in width.',
    confirm='Breakaway and slip sizes in both directions: slow ramps up and down.',
    twins={
        'spring_preload': 'a preload shifts both bands alike but changes no slip: slow ramps',
        'sensor_calibration': 'a zero error shifts x also at rest: calibrate the position sensor',
    },
)
