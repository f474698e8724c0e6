# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Periodic force on the stem."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..stem import Friction


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return the opening force with A sin(2 pi f t + phase) added."""
    offset, friction = value
    amplitude, frequency, phase = p
    angle = 2.0 * math.pi * frequency * (state.time + 0.5 * dt) + phase
    return offset + amplitude * math.sin(angle), friction


@njit
def reach(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return how far the force may lie from that in the middle of a step [% of span]."""
    return value + abs(p[0]) * min(math.pi * p[1] * dt, 2.0)


EFFECT = Effect(
    id='vibration',
    title='Vibration',
    stage='p2-x',
    parameters=(
        EffectParameter(
            'amplitude',
            'A',
            '%',
            2.0,
            0.0,
            20.0,
            'linear',
            'Amplitude of the periodic force',
            starts=(0.7, 2.5),
            usual=(0.5, 5.0),
        ),
        EffectParameter(
            'frequency',
            'f',
            'Hz',
            0.2,
            0.001,
            10.0,
            'log',
            'Frequency of the periodic force',
            step=1e-4,
            neutral=0.2,
            shown='swings',
        ),
        EffectParameter(
            'phase',
            'phi',
            'rad',
            0.0,
            -3.1416,
            3.1416,
            'linear',
            'Phase at the first sample',
            starts=(-2.4, -0.8, 0.8, 2.4),
        ),
    ),
    slots={'force_slot': force, 'reach_slot': reach},
    stride=0.02,
    order=90,
    explanation='A pump, cavitation or pulsating flow shakes the stem.',
    symptom='Periodic slips and a line in the spectrum of x.',
    confirm='Record x at a higher rate while u rests.',
    laborious=True,
    twins={'sensor_drift': 'a very slow vibration is a drift: record for longer'},
)
