# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""LuGre: Canudas de Wit, Olsson, Astrom and Lischinsky (1995), bristles with a state of their own.

Confirmed by a public reconstruction of the paper, a public code and two public libraries. In
% of span: z' = v - sigma_0 |v| z / g(v), g = f_d + (f_s - f_d) exp(-(v/v_s)^2), friction
sigma_0 z + sigma_1 z' + (a_2/a_1) v. The step is linearly implicit, stable at any length.
The model drifts under a load that oscillates below f_s; that is known and kept.
"""

import math

from numba import njit
import numpy as np

from ..declarations import Parameter
from ..pipeline import Array
from .declaration import Rival
from .layout import A_1, A_2, F_D, F_S, OWN, P1, P2, V, X
from .physical import chamber, hold, levels, seven, stribeck_speed

SIGMA_0, SIGMA_1, V_S = range(OWN, OWN + 3)
Z = 4
STEP = 2e-3
"""Longest sub-step [s]."""


@njit
def begin(p1: float, p2: float, x: float, theta: Array) -> Array:
    """Return a resting stem whose bristles carry the force on it, as far as they can."""
    state = np.zeros(5)
    state[P1], state[P2], state[X] = p1, p2, x
    state[Z] = min(max(p2 - x, -theta[F_S]), theta[F_S]) / theta[SIGMA_0]
    return state


@njit
def bristle_step(
    h: float, p: float, x: float, v: float, z: float, theta: Array
) -> tuple[float, float, float]:
    """Take x [%], v [%/s] and the bristles' deflection z [%] through `h` seconds under force p."""
    f_s, f_d, a_1, sigma_0, sigma_1 = (
        theta[F_S],
        theta[F_D],
        theta[A_1],
        theta[SIGMA_0],
        theta[SIGMA_1],
    )
    g = f_d + (f_s - f_d) * math.exp(-((v / theta[V_S]) ** 2))
    shrink = 1.0 / (1.0 + h * sigma_0 * abs(v) / max(g, 1e-9))
    carried = sigma_0 * shrink * z + sigma_1 * (shrink - 1.0) * z / h
    resistance = h + h * sigma_0 * shrink + sigma_1 * shrink + theta[A_2] / a_1
    v = (v + h * a_1 * (p - x - carried)) / (1.0 + h * a_1 * resistance)
    return x + h * v, v, shrink * (z + h * v)


@njit
def bristles(motion: tuple[float, float, float], dt: float, state: Array, theta: Array) -> float:
    """Take the stem through one sample and return x."""
    target, excess, rate = motion
    count = math.ceil(dt / STEP - 1e-9)
    h = dt / max(count, 1)
    decay = math.exp(-rate * h)
    x, v, z = state[X], state[V], state[Z]
    for _ in range(count):
        excess *= decay
        x, v, z = bristle_step(h, target + excess, x, v, z, theta)
    state[X], state[V], state[Z] = x, v, z
    return x


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from the command; the interface of `Rival`."""
    return bristles(chamber(u, dt, state, theta), dt, state, theta)


@njit
def driven(p2: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from a measured p2; the interface of `Rival`."""
    return bristles(hold(p2, state), dt, state, theta)


MODEL = Rival(
    name='lugre',
    title='LuGre, Canudas de Wit et al. 1995',
    parameters=(
        *seven(),
        Parameter(
            'sigma_0',
            'σ_0',
            '-',
            1e3,
            1.0,
            1e6,
            'log',
            "Stiffness of the bristles over the spring's",
        ),
        Parameter(
            'sigma_1',
            'σ_1',
            's',
            math.sqrt(0.5),
            1e-6,
            1e4,
            'log',
            "Damping of the bristles over the spring's stiffness; good: sqrt(sigma_0/a_1)",
        ),
        stribeck_speed(0.1, 1e-6),
    ),
    advance=advance,
    driven=driven,
    begin=begin,
    channel='p2',
    from_friction=levels,
    held=('a_1', 'sigma_0', 'sigma_1', 'v_s'),
    work=100.0,
    confirmed='the law and its published constants, by public codes and libraries',
    remark='creeps under a load that oscillates below f_s',
)
