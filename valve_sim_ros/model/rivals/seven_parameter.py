# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The seven-parameter model of Armstrong-Helouvry, Dupont and Canudas de Wit (1994).

Reconstruction from the literature at large: no source that prints the equations could be
retrieved, and only limits are tested. Stuck, the contact is a spring k_t about a reference. The
stem breaks away above f_d plus a static excess that rises with the dwell time t_2,
F(t_2) = F_a + (f_s - f_d - F_a) t_2/(t_2 + gamma), and slides against
f_d + (a_2/a_1)|v| + F(t_2)/(1 + (v(t - tau_L)/v_s)^2). F_a is the last term at the end of the
slide before. Its seven are f_d, a_2/a_1, f_s - f_d, k_t, v_s, tau_L and gamma; steps are 1 ms.
"""

import math

from numba import njit
import numpy as np

from ..declarations import Parameter
from ..pipeline import Array
from .declaration import Rival
from .layout import A_1, A_2, DIRECTION, F_D, F_S, OWN, P1, P2, V, X
from .physical import chamber, hold, levels, seven, stribeck_speed, substeps

K_T, V_S, TAU_L, GAMMA = range(OWN, OWN + 4)
REFERENCE, DWELL, RESIDUE, EXCESS, NEXT, SLOTS_START = range(5, 11)
"""Layout of the state: position of the unloaded contact spring [%], dwell time [s], Stribeck term
at the last stop [%], static excess of this slide [%], next slot, then the past speeds [%/s]."""
SLOTS = 500
"""Past speeds kept, one per sub-step."""
LONG_AGO = 1e9


@njit
def begin(p1: float, p2: float, x: float, theta: Array) -> Array:
    """Return a stem that has rested for ever."""
    state = np.zeros(SLOTS_START + SLOTS)
    state[P1], state[P2], state[X] = p1, p2, x
    state[DWELL] = LONG_AGO
    state[REFERENCE] = x - min(max(p2 - x, -theta[F_S]), theta[F_S]) / theta[K_T]
    return state


@njit
def static_excess(dwell: float, residue: float, theta: Array) -> float:
    """Return how far the breakaway level stands above f_d [%] after `dwell` seconds of rest."""
    final, gamma = theta[F_S] - theta[F_D], theta[GAMMA]
    return final if gamma == 0.0 else residue + (final - residue) * dwell / (dwell + gamma)


@njit
def rest(p: float, h: float, state: Array, theta: Array) -> None:
    """Stay stuck for `h` seconds under force p, or break away."""
    k_t, reference = theta[K_T], state[REFERENCE]
    state[X] = (p + k_t * reference) / (1.0 + k_t)
    load = k_t * (state[X] - reference)
    excess = static_excess(state[DWELL], state[RESIDUE], theta)
    state[DWELL] += h
    if abs(load) > theta[F_D] + excess:
        state[EXCESS] = excess
        state[DIRECTION] = 1.0 if load > 0.0 else -1.0
        state[V] = 0.0
        for slot in range(SLOTS):
            state[SLOTS_START + slot] = 0.0


@njit
def stays(p: float, state: Array, theta: Array) -> bool:
    """Tell whether force p is too small to break away now; later it takes no less."""
    k_t, reference = theta[K_T], state[REFERENCE]
    load = k_t * ((p + k_t * reference) / (1.0 + k_t) - reference)
    excess = static_excess(state[DWELL], state[RESIDUE], theta)
    return abs(load) <= theta[F_D] + excess


@njit
def slide(p: float, h: float, lag: int, state: Array, theta: Array) -> None:
    """Slide for `h` seconds under force p, friction `lag` sub-steps behind the speed, or stop."""
    a_1, direction = theta[A_1], state[DIRECTION]
    here = int(state[NEXT])
    state[SLOTS_START + here] = state[V]
    past = state[SLOTS_START + (here - lag if here >= lag else here - lag + SLOTS)]
    state[NEXT] = here + 1 if here + 1 < SLOTS else 0
    stribeck = state[EXCESS] / (1.0 + (past / theta[V_S]) ** 2)
    force = p - state[X] - direction * (theta[F_D] + stribeck)
    v = (state[V] + h * a_1 * force) / (1.0 + h * theta[A_2])
    if direction * v < 0.0:
        load = min(max(p - state[X], -theta[F_D] - stribeck), theta[F_D] + stribeck)
        state[REFERENCE] = state[X] - load / theta[K_T]
        state[DIRECTION] = state[V] = state[DWELL] = 0.0
        state[RESIDUE] = stribeck
    else:
        state[V] = v
        state[X] += h * v


@njit
def seven_parameter(
    motion: tuple[float, float, float], dt: float, state: Array, theta: Array
) -> float:
    """Take the stem through one sample and return x."""
    target, excess, rate = motion
    count = substeps(dt, theta[A_1])
    h = dt / max(count, 1)
    if count and state[DIRECTION] == 0.0:
        final = target + excess * math.exp(-rate * dt)
        # p2 goes one way within a sample: if neither end breaks it loose, nothing between does
        if stays(target + excess, state, theta) and stays(final, state, theta):
            rest(final, dt, state, theta)
            return state[X]
    lag = min(int(theta[TAU_L] / h + 0.5), SLOTS - 1) if count else 0
    decay = math.exp(-rate * h)
    for _ in range(count):
        excess *= decay
        if state[DIRECTION] == 0.0:
            rest(target + excess, h, state, theta)
        else:
            slide(target + excess, h, lag, state, theta)
    return state[X]


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from the command; the interface of `Rival`."""
    return seven_parameter(chamber(u, dt, state, theta), dt, state, theta)


@njit
def driven(p2: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from a measured p2; the interface of `Rival`."""
    return seven_parameter(hold(p2, state), dt, state, theta)


MODEL = Rival(
    name='seven_parameter',
    title='Armstrong-Helouvry, Dupont and Canudas de Wit 1994, seven parameters',
    parameters=(
        *seven(),
        Parameter(
            'k_t',
            'k_t',
            '-',
            1e3,
            1.0,
            1e6,
            'log',
            "Stiffness of the stuck contact over the spring's",
        ),
        stribeck_speed(0.1, 1e-6),
        Parameter(
            'tau_L', 'τ_L', 's', 0.01, 0.0, 0.05, 'linear', 'Lag of friction behind the speed'
        ),
        Parameter(
            'gamma',
            'γ',
            's',
            0.0,
            0.0,
            1000.0,
            'linear',
            'Dwell time after which half of the static excess has risen',
        ),
    ),
    advance=advance,
    driven=driven,
    begin=begin,
    channel='p2',
    from_friction=levels,
    held=('a_1', 'k_t', 'v_s', 'tau_L', 'gamma'),
    work=120.0,
    reconstructed='all equations and constants; only the limits are tested',
)
