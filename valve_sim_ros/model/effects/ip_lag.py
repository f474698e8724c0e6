# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""First-order lag of the electro-pneumatic converter."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter, upstream
from ..memory import lagged


@njit
def command(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the command on its way, by the share of the lag that lies before the backlash."""
    if p[1] <= 0.0:
        return value
    if math.isnan(memory[3]):
        memory[3] = memory[4] = value
    memory[3] = lagged(memory[3], memory[4], p[0] * p[1], dt)
    memory[4] = value
    return memory[3]


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return p1 on its way to what the converter asked for since the last step."""
    if math.isnan(memory[0]):
        memory[0], memory[1] = state.p1, value
    after = p[0] * (1.0 - p[1])
    before, asked = memory[0], memory[1]
    if p[1] > 0.0:  # what is asked for does not step, it moves
        asked = 0.5 * (asked + value)
    memory[0] = value if after <= 0.0 < p[1] else lagged(before, asked, after, dt)
    # the chamber is given the mean over the step
    memory[2] = asked - before + after / dt * (before - memory[0]) if dt > 0.0 else 0.0
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
            usual=(0.05, 4.0),
        ),
        upstream(1.0),
    ),
    variants=(('time_constant',), ('time_constant', 'upstream')),
    slots={'command_slot': command, 'inlet_slot': inlet, 'tubing_slot': tubing},
    memory=5,
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
