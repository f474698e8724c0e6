# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Valves as they are found in plants, without any of the effects."""

import numpy as np

from .physics import Physics


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def either_sign(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a number of this size and any sign."""
    return float(rng.choice((-1.0, 1.0)) * rng.uniform(low, high))


def base_valve(rng: np.random.Generator) -> Physics:
    """Return a random valve; nine of ten stems do not overshoot, three stop before the others.

    One of two has its seat at 0 % and a stop at 100 %, which effects may press the stem against.
    """
    friction = rng.uniform(2.0, 12.0)
    slow = rng.random() < 0.12
    while True:
        stiffness, rate = log_uniform(rng, 800.0, 5000.0), rng.uniform(5.0, 30.0)
        damping = 0.5 * np.sqrt(stiffness) / rate
        if damping > (1.0 if rng.random() < 0.95 else 0.5):
            break
    return Physics(
        f_d1=log_uniform(rng, 0.3, 3.0),
        T_g1=log_uniform(rng, 1.0, 12.0),
        T_g2=log_uniform(rng, 30.0, 100.0) if slow else log_uniform(rng, 1.0, 30.0),
        f_s=friction,
        f_d=friction * rng.uniform(0.3, 0.9),
        a_1=stiffness,
        a_2=stiffness / rate,
        delta=log_uniform(rng, 1e-4, 0.1) if rng.random() < 0.3 else 1e-5,
        **({'stop_low': 0.0, 'stop_high': 100.0} if rng.random() < 0.5 else {}),
    )
