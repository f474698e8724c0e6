# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the physical friction models share: the base valve's first two stages, and its parameters.

They replace only the stem: x'' + a_1 (x - p2 + friction) = 0, friction in % of span. The first
seven parameters are those of the base valve, in its order.
"""

from dataclasses import replace
import math
from typing import Any

from numba import njit
import numpy as np

from ..declarations import Parameter
from ..electro_pneumatic import backlash
from ..parameters import PAPER_SEVEN
from ..pipeline import Array
from ..pneumatic import chamber_pressure, is_filling
from .layout import F_D1, P1, P2, T_G1, T_G2, X

LONGEST_STEP = 1e-3
"""Longest sub-step of the models that have no closed form [s]."""


@njit
def chamber(u: float, dt: float, state: Array, theta: Array) -> tuple[float, float, float]:
    """Take p1 and p2 through one sample, eq. (1) and (5).

    Returns
    -------
    target, excess, rate : float
        p2(tau) = target + excess exp(-rate tau) over the sample [% of span, 1/s].
    """
    held, p2 = state[P1], state[P2]
    state[P1] = backlash(held, u, theta[F_D1])
    time_constant = theta[T_G1] if is_filling(held, state[P1], p2, False) else theta[T_G2]
    rate = 1.0 / time_constant
    state[P2] = chamber_pressure(p2, held, math.exp(-rate * dt))
    return held, p2 - held, rate


@njit
def hold(p2: float, state: Array) -> tuple[float, float, float]:
    """Put a measured p2 in the place of the first two stages; returns what `chamber` does."""
    state[P1] = p2
    state[P2] = p2
    return p2, 0.0, 1.0


@njit
def at_rest(p1: float, p2: float, x: float, theta: Array) -> Array:
    """Return a resting stem."""
    state = np.zeros(6)
    state[P1], state[P2], state[X] = p1, p2, x
    return state


@njit
def substeps(dt: float, a_1: float) -> int:
    """Return into how many sub-steps a sample falls: at most 1 ms, a tenth of a radian."""
    return math.ceil(dt / min(LONGEST_STEP, 0.1 / math.sqrt(a_1)) - 1e-9)


def seven(**defaults: float) -> tuple[Parameter, ...]:
    """Return the base valve's seven parameters, some with other defaults."""
    return tuple(replace(p, default=defaults.get(p.name, p.default)) for p in PAPER_SEVEN)


def stribeck_speed(default: float, lower: float) -> Parameter:
    """Declare the speed at which friction has fallen from static to dynamic."""
    return Parameter(
        'v_s',
        'v_s',
        '%/s',
        default,
        lower,
        1000.0,
        'linear' if lower == 0.0 else 'log',
        'Stribeck speed; 0 for none' if lower == 0.0 else 'Stribeck speed',
    )


def levels(f_s: Any, f_d: Any) -> dict[str, Any]:
    """Return f_s and f_d as they are."""
    return {'f_s': f_s, 'f_d': f_d}
