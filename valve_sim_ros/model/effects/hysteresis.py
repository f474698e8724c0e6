# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Distributed hysteresis of the converter or of the stem."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..memory import mean_of_plays

PLAYS = 5


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the mean of plays of p1."""
    if p[0] <= 0.0:
        return value
    return mean_of_plays(value, p[0], memory[:PLAYS])


@njit
def sensor(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the mean of plays of x."""
    if p[1] <= 0.0:
        return value
    return mean_of_plays(value, p[1], memory[PLAYS:])


EFFECT = Effect(
    id='hysteresis',
    title='Distributed hysteresis',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'inlet_width',
            'w_1',
            '%',
            3.0,
            0.0,
            30.0,
            'linear',
            'Half-width of the widest play that p1 passes through',
            usual=(1.0, 15.0),
        ),
        EffectParameter(
            'stem_width',
            'w_x',
            '%',
            0.0,
            0.0,
            30.0,
            'linear',
            'Half-width of the widest play that x passes through',
            stage='p2-x',
            starts=(2.0, 6.0),
            usual=(1.0, 15.0),
        ),
    ),
    slots={'inlet_slot': inlet, 'sensor_slot': sensor},
    memory=2 * PLAYS,
    order=20,
    variants=(('inlet_width',), ('stem_width',)),
    explanation='Many small plays, as in a worn linkage or a flapper, instead of a single one.',
    symptom='Rounded loops, with minor loops inside them, after each reversal.',
    confirm='Run small reversals of growing size slowly.',
    twins={
        'presliding': 'presliding acts on p2-x only: record p1 and p2',
        'linkage_backlash': 'a single play holds x completely after a reversal: slow reversals',
    },
    references=('Prandtl-Ishlinskii operator with a uniform density of play widths',),
)
