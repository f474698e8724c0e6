# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dead time between the command and the inlet pressure."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..memory import DELAY_SIZE, delayed


@njit
def command(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return u(t - T_d), and note since when it holds."""
    now = state.time + dt
    u, _, changed = delayed(value, now, p[0], memory[2:])
    memory[1] = changed
    return u


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Note the new p1 for the chamber, which feels it before the sample ends."""
    memory[0] = value
    return value


@njit
def tubing(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the mean p1 over the step: the delayed command may change inside it."""
    now = state.time + dt
    if dt <= 0.0 or memory[1] <= now - dt:
        return value
    return value + (now - memory[1]) / dt * (memory[0] - value)


EFFECT = Effect(
    id='ip_dead_time',
    title='Dead time of the electro-pneumatic converter',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'dead_time',
            'T_d',
            's',
            0.6,
            0.0,
            20.0,
            'linear',
            'Time by which p1 follows u late',
            starts=tuple(0.05 * k for k in range(1, 81)),
        ),
    ),
    slots={'command_slot': command, 'inlet_slot': inlet, 'tubing_slot': tubing},
    memory=2 + DELAY_SIZE,
    order=100,
    explanation='The converter or the control network passes a command on only after a while.',
    symptom='p1 has the right shape but comes late after every change of u.',
    confirm='Record p1 beside u at a higher rate during a few steps.',
    twins={
        'ip_lag': 'a lag rounds the step of p1, a dead time does not: record p1',
        'tubing_dead_time': 'p1 tells on which side of the converter the time is lost: record p1',
    },
)
