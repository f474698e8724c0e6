# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dead time of the tubing between the converter and the actuator."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..memory import DELAY_SIZE, delayed, held_mean


@njit
def tubing(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the mean over the step of the p1 that left the converter T_d before."""
    now = state.time
    after, before, changed = delayed(value, now, p[0] - dt, memory)
    return held_mean(before, after, changed + dt, now + dt, dt)


EFFECT = Effect(
    id='tubing_dead_time',
    title='Dead time of the tubing',
    stage='p1-p2',
    parameters=(
        EffectParameter(
            'dead_time',
            'T_d',
            's',
            0.6,
            0.0,
            20.0,
            'linear',
            'Time by which p2 follows p1 late',
            starts=tuple(0.05 * k for k in range(1, 81)),
        ),
    ),
    slots={'tubing_slot': tubing},
    memory=DELAY_SIZE,
    explanation='A long or narrow tube passes a change of pressure on only after a while.',
    symptom='p2 has the right shape but comes late after every change of p1.',
    confirm='Record p1 and p2 at a higher rate during a few steps.',
    twins={
        'ip_dead_time': 'p1 tells on which side of the converter the time is lost: record p1',
        'ip_lag': 'with p2 or x alone a short lag looks like a dead time: record p1',
    },
)
