# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""First-order lag of the electro-pneumatic converter."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..memory import lagged


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return p1 on its way to what the converter asked for since the last step."""
    if math.isnan(memory[0]):
        memory[0], memory[1] = state.p1, value
    before = memory[0]
    memory[0] = lagged(before, memory[1], p[0], dt)
    # the chamber is given the mean over the step
    memory[2] = memory[1] - before + p[0] / dt * (before - memory[0]) if dt > 0.0 else 0.0
    memory[1] = value
    return memory[0]


@njit
def tubing(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the mean of p1 over the step, `value` at its start."""
    return value + memory[2]


EFFECT = Effect(
    id='ip_lag',
    title='Lag of the electro-pneumatic converter',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'time_constant',
            'tau',
            's',
            1.0,
            0.0,
            20.0,
            'linear',
            'Time constant of p1 after u',
            starts=(0.2, 0.7, 2.0),
        ),
    ),
    slots={'inlet_slot': inlet, 'tubing_slot': tubing},
    memory=3,
    longest_step=0.1,
    order=30,
    explanation='The converter fills its outlet through a restriction, so p1 follows u gradually.',
    symptom='p1 rounds after each step of u.',
    confirm='Record p1 beside u during a few steps.',
    twins={
        'ip_dead_time': 'a dead time shifts the step of p1 without rounding it: record p1',
        'linkage_backlash': 'with x alone both delay small reversals: record p1',
    },
)
