# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Limited rate of the chamber pressure, or of the stem by direction."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion, moved
from ..stem import Stem

UNLIMITED = 1000.0


@njit
def flow(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, float]:
    """Return the rate that leads to the exact end of |p2'| <= r."""
    target, rate = value
    limit = min(p[0], p[3] if target > state.p2 else p[4])
    excess = abs(state.p2 - target)
    if dt <= 0.0 or rate * excess <= limit:
        return target, rate
    ramp = min((excess - limit / rate) / limit, dt)
    end = (excess - limit * ramp) * math.exp(-rate * (dt - ramp))
    return target, math.log(excess / end) / dt


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Let the stem move no further than its limits allow."""
    opening, closing = p[1], p[2]
    stem = value.stem
    x = min(max(stem.x, state.x - closing * dt), state.x + opening * dt)
    if x == stem.x:
        return value
    v = min(max(stem.v, -closing), opening)
    limited = Stem(x, v, stem.direction, stem.armed)
    return moved(value, limited, value.p2)


EFFECT = Effect(
    id='rate_limit',
    title='Limited rate',
    stage='p1-p2',
    parameters=(
        EffectParameter(
            'pressure_rate',
            'r_p',
            '%/s',
            5.0,
            0.1,
            UNLIMITED,
            'log',
            'Fastest change of p2, both ways',
            neutral=UNLIMITED,
            starts=(1.5, 4.0, 10.0, 25.0),
        ),
        EffectParameter(
            'opening_rate',
            'r_up',
            '%/s',
            UNLIMITED,
            0.1,
            UNLIMITED,
            'log',
            'Fastest opening of the stem',
            neutral=UNLIMITED,
            stage='p2-x',
            starts=(1.5, 4.0, 10.0, 25.0),
        ),
        EffectParameter(
            'closing_rate',
            'r_down',
            '%/s',
            UNLIMITED,
            0.1,
            UNLIMITED,
            'log',
            'Fastest closing of the stem',
            neutral=UNLIMITED,
            stage='p2-x',
            starts=(1.5, 4.0, 10.0, 25.0),
        ),
        EffectParameter(
            'filling_rate',
            'r_filling',
            '%/s',
            UNLIMITED,
            0.1,
            UNLIMITED,
            'log',
            'Fastest rise of p2',
            neutral=UNLIMITED,
            starts=(1.5, 4.0, 10.0, 25.0),
        ),
        EffectParameter(
            'emptying_rate',
            'r_emptying',
            '%/s',
            UNLIMITED,
            0.1,
            UNLIMITED,
            'log',
            'Fastest fall of p2',
            neutral=UNLIMITED,
            starts=(1.5, 4.0, 10.0, 25.0),
        ),
    ),
    slots={'flow_slot': flow, 'motion_slot': motion},
    stride=0.02,
    order=40,
    variants=(
        ('pressure_rate',),
        ('filling_rate',),
        ('emptying_rate',),
        ('filling_rate', 'emptying_rate'),
        ('opening_rate', 'closing_rate'),
    ),
    explanation='A restriction, a damper or a small booster limits how fast p2 or the stem moves.',
    symptom='Straight ramps of p2 or x whatever the size of the step.',
    confirm='Compare steps of different sizes: the slopes are equal.',
    twins={
        'nonlinear_flow': 'a power law changes small steps too: small and large steps',
    },
)
