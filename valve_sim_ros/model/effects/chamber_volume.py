# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chamber volume that grows as the valve opens."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion, moved


@njit
def flow(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, float]:
    """Return the rate for the volume at the start of the step."""
    target, rate = value
    return target, rate / max(1.0 + p[0] * state.x / 100.0, 0.05)


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Let the displaced volume change p2, isothermally; half a step ahead, as p2 acts late.

    The place before is kept: where a search puts the stem elsewhere, the air gives way too.
    """
    ratio, displacement, absolute = p
    place = value.stem.x + 0.5 * dt * value.stem.v
    before = max(1.0 + ratio * (state.x if math.isnan(memory[0]) else memory[0]) / 100.0, 0.05)
    after = max(1.0 + ratio * place / 100.0, 0.05)
    memory[0] = place
    change = (value.p2 + absolute) * (before / after - 1.0)
    return moved(value, value.stem, value.p2 + displacement * change)


EFFECT = Effect(
    id='chamber_volume',
    title='Chamber volume depends on the travel',
    stage='p1-p2',
    parameters=(
        EffectParameter(
            'ratio',
            'kappa',
            '-',
            1.0,
            0.0,
            10.0,
            'linear',
            'Swept over dead volume',
            starts=(0.4, 1.2, 3.0),
        ),
        EffectParameter(
            'displacement',
            'd',
            '-',
            0.0,
            0.0,
            1.5,
            'linear',
            'Share of the pressure change by the moving stem; 1 is isothermal air',
            starts=(0.3, 0.9),
        ),
        EffectParameter(
            'absolute_pressure',
            'p_abs',
            '%',
            150.0,
            5.0,
            400.0,
            'log',
            'Absolute pressure where p2 = 0; 152 with 0.2 to 1.0 bar',
            neutral=150.0,
        ),
    ),
    slots={'flow_slot': flow, 'motion_slot': motion},
    memory=1,
    stride=0.01,
    order=10,
    feedback=True,
    variants=(('ratio',), ('ratio', 'displacement', 'absolute_pressure')),
    explanation='The opening stem enlarges the chamber, so the same flow raises p2 more slowly.',
    symptom='Rates of p2 fall as x opens; p2 dips at each slip.',
    confirm='Compare the time constants of small steps of u at 20 % and at 80 %.',
    twins={
        'nonlinear_flow': 'that one depends on p1 - p2, not on x: small steps at both ends',
        'spring_nonlinearity': 'with x alone both act at high opening: record p2',
    },
    references=('Suggested by the source paper, sec. 2; isothermal gas law for the displacement',),
)
