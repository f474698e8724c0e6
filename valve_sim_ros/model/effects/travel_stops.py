# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mechanical stops inside the stroke."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion, moved
from ..stem import Stem

FAR = 60.0


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Stop the stem where it would leave the stroke; it rests there."""
    stem = value.stem
    x = min(max(stem.x, p[0]), p[1])
    if x == stem.x:
        return value
    stopped = Stem(x, 0.0, 0.0, False)
    return moved(value, stopped, value.p2)


EFFECT = Effect(
    id='travel_stops',
    title='Travel stops',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'lower',
            'x_lo',
            '%',
            0.0,
            -FAR,
            99.0,
            'linear',
            'Lowest position',
            neutral=-FAR,
            starts=(0.0, 8.0, 15.0, 22.0, 30.0, 40.0),
        ),
        EffectParameter(
            'upper',
            'x_hi',
            '%',
            80.0,
            1.0,
            100.0 + FAR,
            'linear',
            'Highest position',
            neutral=100.0 + FAR,
            starts=(50.0, 58.0, 66.0, 74.0, 82.0, 90.0, 97.0),
        ),
    ),
    slots={'motion_slot': motion},
    order=30,
    variants=(('upper',), ('lower',), ('lower', 'upper')),
    explanation='A hand wheel, a limit screw, a foreign body or the seat ends the stroke early.',
    symptom='x is flat while p2 moves on.',
    confirm='Drive p2 well beyond the flat and back.',
    twins={
        'position_dependent_friction': 'a bump lets go at a higher p2: raise p2 further',
        'supply_limit': 'with x alone a limited p1 looks the same: record p1 or p2',
    },
)
