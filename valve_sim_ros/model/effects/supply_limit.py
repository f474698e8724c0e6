# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Limited air supply: p1 cannot exceed the supply pressure."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return p1, at most the supply pressure."""
    return min(value, p[0])


EFFECT = Effect(
    id='supply_limit',
    title='Supply pressure too low',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'pressure',
            'p_s',
            '%',
            75.0,
            5.0,
            150.0,
            'linear',
            'Highest p1 that the supply can give',
            neutral=150.0,
            starts=(40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 97.0),
        ),
    ),
    slots={'inlet_slot': inlet},
    order=40,
    explanation='The air supply is throttled or set too low, so the converter saturates.',
    symptom='Flat tops of p1, p2 and x while u goes on rising.',
    confirm='Step u to 100 % and read p1 against the supply gauge.',
    twins={'travel_stops': 'at a stop p1 and p2 go on rising while x stays: record p1 or p2'},
)
