# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mechanical stops inside the stroke."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion, moved
from ..stem import Friction, Stem

FAR = 60.0
RIGID, STEP = 1e-3, 0.02
"""Compliance up to which a stop is hard, and the longest step while the stem moves in one [s]."""


@njit
def within(x: float, p: Any) -> float:
    """Return the place of the stop beyond which x is, or x."""
    return min(max(x, p[0]), p[1])


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return the springs that yield: those of the valve, and of a stop that is pushed."""
    place = within(state.x, p)
    if p[2] <= RIGID or place == state.x:
        return value
    offset, f = value
    stop = f.stiffness / p[2]
    return offset + stop * place, Friction(
        f.static_up, f.static_down, f.dynamic_up, f.dynamic_down, f.stiffness + stop
    )


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Stop the stem where it would leave the stroke; it rests there, or a little beyond."""
    stem = value.stem
    place = within(stem.x, p)
    yields = p[2] > RIGID
    if place == stem.x or (yields and within(state.x, p) != state.x):
        return value
    # what would take it further on its own presses it into the stop
    share = p[2] / (1.0 + p[2]) if yields else 0.0
    stopped = Stem(place + share * (stem.x - place), 0.0, 0.0, False)
    return moved(value, stopped, value.p2)


@njit
def stride(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the longest step while the stem moves: it may leave a stop."""
    return min(value, STEP) if p[2] > RIGID and within(state.x, p) != state.x else value


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
        EffectParameter(
            'compliance',
            'c',
            '-',
            0.0,
            0.0,
            0.3,
            'linear',
            'How far a stop yields, relative to the spring; 0: it is hard',
            starts=(0.04,),
            step=0.005,
        ),
    ),
    slots={'force_slot': force, 'motion_slot': motion, 'stride_slot': stride},
    order=75,
    variants=(
        ('upper',),
        ('lower',),
        ('lower', 'upper'),
        ('upper', 'compliance'),
        ('lower', 'compliance'),
        ('lower', 'upper', 'compliance'),
    ),
    explanation='A hand wheel, a limit screw, a foreign body or the seat ends the stroke early.',
    symptom='x is flat while p2 moves on.',
    confirm='Drive p2 well beyond the flat and back.',
    twins={
        'position_dependent_friction': 'a bump lets go at a higher p2: raise p2 further',
        'supply_limit': 'with x alone a limited p1 looks the same: record p1 or p2',
    },
)
