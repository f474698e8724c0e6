# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The classical model: static, Coulomb and viscous friction, eq. (8), without a dead zone.

Confirmed: the same piecewise law stands in public documentation of friction blocks. Between
events it is solved in closed form; with a Stribeck speed v_s > 0 friction falls from f_s to f_d as
exp(-(v/v_s)^2) and sub-steps of at most 1 ms are taken.
"""

from numba import njit

from ..pipeline import Array
from .declaration import Rival
from .layout import OWN
from .physical import at_rest, chamber, hold, levels, seven, stribeck_speed
from .stick_slip import stick_slip

V_S = OWN


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from the command; the interface of `Rival`."""
    return stick_slip(chamber(u, dt, state, theta), dt, state, theta, 0.0, theta[V_S])


@njit
def driven(p2: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from a measured p2; the interface of `Rival`."""
    return stick_slip(hold(p2, state), dt, state, theta, 0.0, theta[V_S])


MODEL = Rival(
    name='classical',
    title='Coulomb, viscous and static friction',
    parameters=(*seven(), stribeck_speed(0.0, 0.0)),
    advance=advance,
    driven=driven,
    begin=at_rest,
    channel='p2',
    from_friction=levels,
    held=('a_1', 'v_s'),
    work=4.0,
    confirmed='the law, by public documentation of friction blocks and eq. (8)',
)
