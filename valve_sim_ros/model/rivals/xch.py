# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Xie, Cong and Horch (2013), XCH: an improved Choudhury model with S and J.

Reconstruction: only the abstract's facts are known (two parameters, random signals allowed,
ISA standard tests). The law is the two-state one to which the thresholds of a public code of that
idea collapse; it equals Kano's model with a neutral start on any input.
"""

from numba import njit
import numpy as np

from ..pipeline import Array
from .data_driven import bands, FIRST, follow, sign, slip_jump, stick_band
from .declaration import Rival
from .layout import P1, P2, X

S, J = range(2)
MOVING = FIRST


@njit
def two_state_start(p1: float, p2: float, x: float, theta: Array) -> Array:
    """Return a stopped valve."""
    state = np.zeros(FIRST + 1)
    state[P1], state[P2], state[X] = p1, p2, x
    return state


@njit
def two_states(u: float, state: Array, f_s: float, f_d: float, at_once: bool) -> None:
    """Stop at a pause or reversal, move on or break away otherwise.

    Parameters
    ----------
    u : float
        Command [% of span].
    state : ndarray
        Updated in place.
    f_s, f_d : float
        Static and dynamic level [% of span].
    at_once : bool
        Whether a valve that stops may break away in the same sample.
    """
    moving, change = state[MOVING], u - state[P1]
    stops = moving != 0.0 and change * moving <= 0.0
    if stops:
        moving = 0.0
    if moving == 0.0 and (at_once or not stops):
        residual = u - state[X]
        if abs(residual) > f_s:
            moving = sign(residual)
    if moving != 0.0:
        state[X] = u - moving * f_d
    state[MOVING] = moving
    follow(u, state)


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample; the interface of `Rival`."""
    s, j = theta[S], theta[J]
    two_states(u, state, 0.5 * (s + j), 0.5 * (s - j), True)
    return state[X]


MODEL = Rival(
    name='xch',
    title='Xie, Cong and Horch 2013 (XCH)',
    parameters=(stick_band(), slip_jump()),
    advance=advance,
    driven=advance,
    begin=two_state_start,
    channel='u',
    from_friction=bands,
    confirmed='two parameters S and J, random inputs and ISA tests allowed, by the abstract',
    reconstructed='the law itself: it equals that of Kano with a neutral start',
    remark='stops at every sign change of the command: do not feed it a noisy copy of u',
)
