# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kano, Maruta, Kugemoto and Shimizu (2004): deadband plus stickband S and slip jump J.

Confirmed by two public codes of identical logic. The start is neutral, so that an upward and a
downward first move need the same. S and J that differ per direction are left out.
"""

from numba import njit
import numpy as np

from ..pipeline import Array
from .data_driven import bands, FIRST, follow, slip_jump, stick_band
from .declaration import Rival
from .layout import P1, P2, X

S, J = range(2)
STOPPED_AT, RESTS, DIRECTION, CHANGE = range(FIRST, FIRST + 4)


@njit
def begin(p1: float, p2: float, x: float, theta: Array) -> Array:
    """Return a stopped valve that breaks away at |u - x| > (S + J)/2 either way."""
    state = np.zeros(FIRST + 4)
    state[P1], state[P2], state[X] = p1, p2, x
    state[STOPPED_AT] = x + 0.5 * (theta[S] - theta[J])
    state[RESTS] = state[DIRECTION] = 1.0
    return state


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample; the interface of `Rival`."""
    before = state[P1]
    change = u - before
    if change * state[CHANGE] <= 0.0 and state[RESTS] == 0.0:
        state[STOPPED_AT] = before
        state[RESTS] = 1.0
    moves = state[RESTS] == 0.0
    if not moves:
        travelled = state[DIRECTION] * (u - state[STOPPED_AT])
        if -travelled > theta[S]:
            state[DIRECTION] = -state[DIRECTION]
            moves = True
        elif travelled > theta[J]:
            moves = True
    if moves:
        state[X] = u - state[DIRECTION] * 0.5 * (theta[S] - theta[J])
        state[RESTS] = 0.0
    state[CHANGE] = change
    follow(u, state)
    return state[X]


MODEL = Rival(
    name='kano',
    title='Kano, Maruta, Kugemoto and Shimizu 2004',
    parameters=(stick_band(), slip_jump()),
    advance=advance,
    driven=advance,
    begin=begin,
    channel='u',
    from_friction=bands,
    confirmed='the law, by two public codes of identical logic',
    remark='stops at every sign change of the command: do not feed it a noisy copy of u',
)
