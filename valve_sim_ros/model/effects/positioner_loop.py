# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A positioner hidden between the command and the converter."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter

UNLIMITED = 1000.0
"""An integral part that may be as large never is [%]."""


@njit
def command(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the output of a PI controller of the stem position, u + K (u - x) + I."""
    gain, integral_gain, overdrive, underdrive, initial, most = p
    if math.isnan(memory[0]):
        memory[0] = initial
    error = value - (state.x + dt * state.v)  # at the end of the step
    raised = value + gain * error + memory[0]
    low, high = -underdrive, 100.0 + overdrive
    # it winds up to its limit, or not at all
    if most < UNLIMITED or low < raised < high or (raised <= low) == (error > 0.0):
        memory[0] = min(max(memory[0] + integral_gain * dt * error, -most), most)
    return min(max(raised, low), high)


EFFECT = Effect(
    id='positioner_loop',
    title='Positioner in the loop',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'gain',
            'K',
            '-',
            1.0,
            0.0,
            20.0,
            'linear',
            'Proportional gain on u - x',
            starts=(0.4, 1.5),
            usual=(0.2, 4.0),
        ),
        EffectParameter(
            'integral_gain',
            'K_i',
            '1/s',
            0.0,
            0.0,
            5.0,
            'linear',
            'Integral gain on u - x',
            starts=(0.0, 0.03),
        ),
        EffectParameter(
            'overdrive',
            'o',
            '%',
            0.0,
            0.0,
            1000.0,
            'linear',
            'How far above the span of u it can drive the converter',
            neutral=1000.0,
            starts=(0.0,),
        ),
        EffectParameter(
            'underdrive',
            'o_0',
            '%',
            0.0,
            0.0,
            1000.0,
            'linear',
            'How far below the span of u it can drive the converter',
            neutral=1000.0,
            starts=(0.0,),
        ),
        EffectParameter(
            'initial_integral',
            'I_0',
            '%',
            0.0,
            -100.0,
            100.0,
            'linear',
            'Integral part at the first sample',
            starts=(0.0,),
            step=0.5,
        ),
        EffectParameter(
            'integral_limit',
            'I_m',
            '%',
            UNLIMITED,
            0.0,
            UNLIMITED,
            'linear',
            'Up to where the integral part winds up; 1000: it waits while the output is limited',
            neutral=UNLIMITED,
            starts=(20.0,),
            step=0.5,
        ),
    ),
    slots={'command_slot': command},
    memory=1,
    longest_step=0.01,
    order=0,
    variants=(
        ('gain',),
        ('gain', 'integral_gain', 'initial_integral'),
        ('gain', 'integral_gain', 'initial_integral', 'overdrive', 'underdrive'),
        (
            'gain',
            'integral_gain',
            'initial_integral',
            'overdrive',
            'underdrive',
            'integral_limit',
        ),
    ),
    explanation='A positioner compares the stem with the command and drives the converter harder.',
    symptom='p1 moves while u rests, and overshoots after each step until the stem has followed.',
    confirm='Hold u after a step and watch p1; or bypass the positioner.',
    laborious=True,
    feedback=True,
    twins={'ip_calibration': 'a span error does not move p1 while u rests: record p1'},
)
