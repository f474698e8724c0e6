# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Static friction that grows while the stem rests."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..state import Motion
from ..stem import Friction

EXPONENTIAL = 1e-3
"""Shape below which the growth is as good as exponential."""
SHAPES = (0.0, 1.0, 8.0)
"""Shapes from which a search starts: exponential, rational, and hardly coming to an end."""


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return static friction after the time at rest so far."""
    offset, f = value
    growth, time_constant, shape = p
    if math.isnan(memory[0]):
        memory[0] = 0.0
    rest = (memory[0] + 0.5 * dt) / time_constant
    left = math.exp(-rest) if shape < EXPONENTIAL else (1.0 + shape * rest) ** (-1.0 / shape)
    factor = 1.0 + growth * (1.0 - left)
    return offset, Friction(
        f.static_up * factor,
        f.static_down * factor,
        f.dynamic_up,
        f.dynamic_down,
        f.stiffness,
    )


@njit
def motion(value: Any, state: Any, p: Any, memory: Any, dt: float) -> Motion:
    """Count the time at rest."""
    memory[0] = memory[0] + dt if value.stem.direction == 0.0 else 0.0
    return value


EFFECT = Effect(
    id='dwell_friction',
    title='Friction grows with the time at rest',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'growth',
            'g',
            '-',
            0.5,
            0.0,
            5.0,
            'linear',
            'Relative growth of f_s after long rest',
            starts=(0.3, 1.0),
            usual=(0.08, 1.8),
        ),
        EffectParameter(
            'time_constant',
            'tau',
            's',
            20.0,
            0.1,
            2000.0,
            'log',
            'Time at rest in which most of it grows',
            neutral=20.0,
            starts=(5.0, 25.0),
        ),
        EffectParameter(
            'shape',
            'c',
            '-',
            0.0,
            0.0,
            20.0,
            'linear',
            '0: 1 - exp(-t/tau); 1: t/(t + tau); else 1 - (1 + c t/tau)^(-1/c); 20: as log t',
            starts=SHAPES[1:],
        ),
    ),
    slots={'force_slot': force, 'motion_slot': motion},
    memory=1,
    longest_step=0.1,
    order=50,
    variants=(('growth', 'time_constant'), ('growth', 'time_constant', 'shape')),
    balance=lambda f_s, growth, *_: f_s / (1.0 + growth),
    explanation='The packing creeps into the stem while it rests and holds it more firmly.',
    symptom='The first jump after a long rest is larger than those after short ones.',
    confirm='Equal steps after rests of 1 s, 10 s and 100 s.',
    rugged=True,
    twins={
        'linkage_backlash': 'a loose linkage hides the start of every reversal, whatever the rest',
        'stribeck_friction': 'that one depends on the speed, not on the rest',
    },
    references=(
        'Rising static friction t/(t + tau), Armstrong-Helouvry, Dupont, Canudas de Wit 1994',
        'Static friction grows with log t, Dieterich 1972, doi:10.1029/JB077i020p03690',
    ),
)
