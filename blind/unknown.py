# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Effects that no catalogue lists: a diagnosis has to say that it does not know them."""

from collections.abc import Callable

import numpy as np

from .effects import Changes, Rng
from .physics import Physics


def spring_relaxation(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let the spring push back more after each move, then relax."""
    return {'relaxation': rng.uniform(0.2, 0.6), 'relaxation_time': rng.uniform(8.0, 40.0)}


def uneven_smoothing(rng: Rng, valve: Physics, length: float) -> Changes:
    """Smooth the command the less the further it is off."""
    return {'smoothing': rng.uniform(8.0, 25.0), 'smoothing_error': rng.uniform(1.0, 4.0)}


def supply_ripple(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let the chamber pressure swing with the compressor."""
    return {'ripple': rng.uniform(1.0, 3.0), 'ripple_omega': 2 * np.pi / rng.uniform(4.0, 30.0)}


def warming_restriction(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let both time constants swing with the temperature."""
    return {
        'warming': rng.uniform(0.6, 2.0),
        'warming_omega': 2 * np.pi / (length * rng.uniform(0.4, 1.0)),
    }


def stem_kicks(rng: Rng, valve: Physics, length: float) -> Changes:
    """Kick the stem at irregular times."""
    return {
        'kick': valve.f_s * rng.uniform(1.8, 3.0),
        'kick_interval': rng.uniform(15.0, 40.0),
    }


def friction_swing(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let friction swing to and fro, as a packing does that warms up and cools down."""
    return {'swing': rng.uniform(0.5, 0.9), 'swing_omega': 2 * np.pi / rng.uniform(120.0, 300.0)}


def chamber_temperature(rng: Rng, valve: Physics, length: float) -> Changes:
    """Heat the air by compression: a second, slower pole of p2."""
    return {'thermal': rng.uniform(0.15, 0.4), 'thermal_time': rng.uniform(10.0, 40.0)}


def wrinkled_diaphragm(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let the effective area wander with the pressure."""
    return {'area_wave': rng.uniform(2.0, 5.0), 'area_period': rng.uniform(20.0, 45.0)}


def supply_dips(rng: Rng, valve: Physics, length: float) -> Changes:
    """Lose supply pressure for some seconds now and then."""
    return {'dip': rng.uniform(0.15, 0.5), 'dip_interval': rng.uniform(30.0, 80.0)}


def cyclic_sensor(rng: Rng, valve: Physics, length: float) -> Changes:
    """Read the position with the error of a bad resolver."""
    return {'cyclic': rng.uniform(1.0, 3.0), 'cyclic_period': rng.uniform(18.0, 35.0)}


UNKNOWN: dict[str, Callable[[Rng, Physics, float], Changes]] = {
    draw.__name__: draw
    for draw in (
        spring_relaxation,
        uneven_smoothing,
        supply_ripple,
        warming_restriction,
        stem_kicks,
        friction_swing,
        chamber_temperature,
        wrinkled_diaphragm,
        supply_dips,
        cyclic_sensor,
    )
}
