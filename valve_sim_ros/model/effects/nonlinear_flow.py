# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Flow through the restriction that is not proportional to the pressure difference."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter

REFERENCE = 10.0
"""Pressure difference at which T_g1 and T_g2 keep their meaning [% of span]."""


@njit
def flow(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, float]:
    """Return the rate that leads to the exact end of D' = -(D_0 / T_g) (D / D_0)^n."""
    target, rate = value
    exponent = p[0]
    share = abs(state.p2 - target) / REFERENCE
    if dt <= 0.0 or share < 1e-6 or abs(exponent - 1.0) < 1e-9:
        return target, rate
    power = share ** (1.0 - exponent) - (1.0 - exponent) * rate * dt
    least = 1e-6
    end = power ** (1.0 / (1.0 - exponent)) if power > 0.0 else least
    return target, math.log(share / min(max(end, least), share)) / dt + 1e-12


EFFECT = Effect(
    id='nonlinear_flow',
    title='Nonlinear flow into the chamber',
    stage='p1-p2',
    parameters=(
        EffectParameter(
            'exponent',
            'n',
            '-',
            0.6,
            0.3,
            2.0,
            'linear',
            'Flow grows with this power of p1 - p2; 0.5 is turbulent, 1 laminar',
            neutral=1.0,
        ),
    ),
    slots={'flow_slot': flow},
    longest_step=0.1,
    order=0,
    explanation='Turbulent flow through the restriction grows less than the pressure difference.',
    symptom='The rate of p2 is not proportional to p1 - p2: small steps are relatively faster.',
    confirm='Compare the time constants of small and of large steps about the same level.',
    twins={
        'quick_exhaust': 'that one acts in one direction and above a threshold: large steps down',
        'rate_limit': 'a limit leaves small steps alone: small and large steps',
    },
)
