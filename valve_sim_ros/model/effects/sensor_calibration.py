# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Zero and span of the position sensor."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter


@njit
def sensor(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return zero + span x."""
    return p[0] + p[1] * value


def place(measured: float, zero: float, span: float) -> float:
    """Return the true position of a stem that is measured somewhere [% of span]."""
    return (measured - zero) / span


EFFECT = Effect(
    id='sensor_calibration',
    title='Zero or span error of the position sensor',
    stage='sensor',
    parameters=(
        EffectParameter(
            'zero',
            'x_0',
            '%',
            3.0,
            -30.0,
            30.0,
            'linear',
            'Measured x where it should be 0',
            starts=(-3.0, 0.0, 3.0),
            shown='zeros',
            usual=(0.4, 5.5),
        ),
        EffectParameter(
            'span',
            's',
            '-',
            1.0,
            0.5,
            2.0,
            'linear',
            'Change of measured per true x',
            neutral=1.0,
            starts=(0.9, 1.0, 1.1),
            shown='spans',
            usual=(0.008, 0.16),
        ),
    ),
    slots={'sensor_slot': sensor},
    order=20,
    explanation='The position transmitter is out of adjustment.',
    symptom='Measured x is off a line, the stops included.',
    confirm='Drive to both stops and read x.',
    twins={
        'spring_preload': 'a preload does not move the stops: drive to both stops',
        'spring_rate': 'a spring does not move the stops: drive to both stops',
        'ip_calibration': 'with x alone a zero of p1 and one of the sensor are one: record p1',
    },
)
