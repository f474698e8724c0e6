# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A positioner hidden between the command and the converter."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def command(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the output of a PI controller of the stem position, u + K (u - x) + I."""
    gain, integral_gain = p
    error = value - state.x
    raised = value + gain * error + memory[0]
    if 0.0 < raised < 100.0 or raised * error < 0.0 or (raised >= 100.0 and error < 0.0):
        memory[0] += integral_gain * dt * error
    return min(max(raised, 0.0), 100.0)


EFFECT = Effect(
    id='positioner_loop',
    title='Positioner in the loop',
    stage='u-p1',
    parameters=(
        EffectParameter('gain', 'K', '-', 1.0, 0.0, 20.0, 'linear', 'Proportional gain on u - x'),
        EffectParameter(
            'integral_gain', 'K_i', '1/s', 0.0, 0.0, 5.0, 'linear', 'Integral gain on u - x'
        ),
    ),
    slots={'command_slot': command},
    memory=1,
    longest_step=0.04,
    order=0,
    variants=(('gain',), ('gain', 'integral_gain')),
    explanation='A positioner compares the stem with the command and drives the converter harder.',
    symptom='p1 moves while u rests, and overshoots after each step until the stem has followed.',
    confirm='Hold u after a step and watch p1; or bypass the positioner.',
    twins={'ip_calibration': 'a span error does not move p1 while u rests: record p1'},
)
