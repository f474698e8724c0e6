# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stick-slip with static, Coulomb and viscous friction, with or without a Stribeck fall."""

import math

from numba import njit

from ..pipeline import Array
from ..slip import forced_gain, free_motion, stem_poles
from ..stem import Friction, Stem, stem_step
from .layout import A_1, A_2, ARMED, DIRECTION, F_D, F_S, V, X
from .physical import substeps


@njit
def stick_slip(
    motion: tuple[float, float, float],
    dt: float,
    state: Array,
    theta: Array,
    delta: float,
    v_s: float,
) -> float:
    """Take the stem through one sample and return x.

    Parameters
    ----------
    motion : tuple of float
        target, excess, rate of p2 over the sample.
    dt : float
        Length of the sample [s].
    state : ndarray
        In the base valve's layout, updated in place.
    theta : ndarray
        First seven parameters of the base valve.
    delta : float
        Speed below which a slip stops [%/s].
    v_s : float
        Stribeck speed [%/s]; 0 for no Stribeck fall, which is solved exactly.
    """
    stem = Stem(state[X], state[V], state[DIRECTION], state[ARMED] != 0.0)
    if v_s > 0.0:
        stem = substepped(stem, motion, dt, theta, delta, v_s)
    else:
        stem = exact(stem, motion, dt, theta, delta)
    state[X], state[V], state[DIRECTION] = stem.x, stem.v, stem.direction
    state[ARMED] = 1.0 if stem.armed else 0.0
    return stem.x


@njit
def exact(
    stem: Stem, motion: tuple[float, float, float], dt: float, theta: Array, delta: float
) -> Stem:
    """Step from event to event in closed form."""
    target, excess, rate = motion
    poles = stem_poles(theta[A_1], theta[A_2])
    phi1, phi2 = free_motion(dt, poles)
    forced = forced_gain(rate, theta[A_1], theta[A_2], 1.0)
    return stem_step(
        stem,
        target,
        excess,
        dt,
        Friction(theta[F_S], theta[F_S], theta[F_D], theta[F_D], 1.0),
        delta,
        forced,
        poles,
        math.exp(-rate * dt),
        phi1,
        phi2,
    )


@njit
def substepped(
    stem: Stem,
    motion: tuple[float, float, float],
    dt: float,
    theta: Array,
    delta: float,
    v_s: float,
) -> Stem:
    """Step with friction that falls from f_s to f_d as exp(-(v/v_s)^2): no closed form."""
    target, excess, rate = motion
    f_s, f_d, a_1, a_2 = theta[F_S], theta[F_D], theta[A_1], theta[A_2]
    x, v, direction, armed = stem.x, stem.v, stem.direction, stem.armed
    count = substeps(dt, a_1)
    h = dt / max(count, 1)
    decay = math.exp(-rate * h)
    for _ in range(count):
        excess *= decay
        e = target + excess - x
        if direction == 0.0 and abs(e) > f_s:
            direction, armed = (1.0 if e > 0.0 else -1.0), False
        if direction != 0.0:
            friction = f_d + (f_s - f_d) * math.exp(-((v / v_s) ** 2))
            v = (v + h * a_1 * (e - direction * friction)) / (1.0 + h * a_2)
            speed = direction * v
            if speed < 0.0 or (armed and speed <= delta):
                v, direction = 0.0, 0.0
            else:
                x += h * v
                armed = armed or speed > delta
    return Stem(x, v, direction, armed)
