# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that falls gradually with the stem's speed."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return f_d + (f_s - f_d) exp(-(v / v_s)^2) at the speed at the start of the step."""
    offset, f = value
    ratio = state.v / p[0] if p[0] > 0.0 else math.inf
    share = math.exp(-ratio * ratio) if p[0] > 0.0 else 0.0
    return offset, Friction(
        f.static_up,
        f.static_down,
        f.dynamic_up + share * (f.static_up - f.dynamic_up),
        f.dynamic_down + share * (f.static_down - f.dynamic_down),
        f.stiffness,
    )


EFFECT = Effect(
    id='stribeck_friction',
    title='Stribeck friction',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'velocity',
            'v_s',
            '%/s',
            5.0,
            0.0,
            100.0,
            'linear',
            'Speed at which friction falls',
            starts=(1.0, 4.0, 15.0),
        ),
    ),
    slots={'force_slot': force},
    longest_step=0.01,
    order=40,
    explanation='A lubricated packing loses friction only as the stem picks up speed.',
    symptom='Slow motion meets almost static friction; repeated slips whose size varies.',
    confirm='Slow and fast ramps: the offset p2-x while moving depends on the speed.',
    twins={
        'presliding': 'presliding shows as motion below f_s: small reversals',
        'dwell_friction': 'that one depends on the time at rest: steps after short and long rests',
    },
    references=('models.md sec. 4.1; Armstrong-Helouvry, Dupont, Canudas de Wit 1994',),
)
