# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Quick-exhaust valve, or volume booster, at the actuator."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def flow(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, float]:
    """Return the mean rate of a step in which it may close; memory: whether it is open."""
    target, rate = value
    factor, threshold, reseat = p
    excess, closing = state.p2 - target, reseat * threshold
    if dt <= 0.0:
        return target, rate
    if excess <= closing or not (excess > threshold or memory[0] == 1.0):
        memory[0] = 0.0
        return target, rate
    fast = factor * rate
    until = math.log(excess / closing) / fast if closing > 0.0 else dt
    memory[0] = 1.0 if until >= dt else 0.0
    if until >= dt:
        return target, fast
    return target, (fast * until + rate * (dt - until)) / dt


EFFECT = Effect(
    id='quick_exhaust',
    title='Quick exhaust',
    stage='p1-p2',
    parameters=(
        EffectParameter(
            'factor',
            'k',
            '-',
            3.0,
            0.1,
            50.0,
            'log',
            'How much faster p2 falls above the threshold',
            neutral=1.0,
            starts=(2.0, 5.0),
            usual=(0.8, 6.0),
        ),
        EffectParameter(
            'threshold',
            'D',
            '%',
            8.0,
            0.1,
            60.0,
            'log',
            'p2 - p1 above which the exhaust opens',
            neutral=8.0,
            starts=(4.0, 8.0, 15.0),
        ),
        EffectParameter(
            'reseat',
            'D_0/D',
            '-',
            1.0,
            0.0,
            1.0,
            'linear',
            'Share of the threshold below which the exhaust closes again',
            neutral=1.0,
            starts=(0.4, 0.7),
        ),
    ),
    variants=(('factor', 'threshold'), ('factor', 'threshold', 'reseat')),
    slots={'flow_slot': flow},
    memory=1,
    longest_step=0.1,
    order=20,
    explanation='A valve at the actuator opens to the atmosphere once p2 exceeds p1 enough.',
    symptom='p2 falls fast while it is far above p1, and slowly after that; never when it rises.',
    confirm='Compare a large and a small step down.',
    twins={
        'nonlinear_flow': 'that one acts in both directions and at all sizes of step',
    },
)
