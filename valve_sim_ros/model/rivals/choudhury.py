# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Choudhury, Thornhill and Shah (2005): S and J, driven by the sign of the command's change.

Confirmed by one faithful public port. Defects of the model itself, kept: it never answers a step
(the step's sample is a change of sign, the next one a pause); noise on u keeps it from moving;
after a pause a reversal needs J only. In the port a move after a pause needs S again at the next
sample; whether that is in the paper's chart is unknown: `latched` = 1 leaves it out.
"""

from numba import njit
import numpy as np

from ..declarations import Parameter
from ..pipeline import Array
from .data_driven import bands, FIRST, follow, sign, slip_jump, stick_band
from .declaration import Rival
from .layout import P1, P2, X

S, J, LATCHED = range(3)
STUCK_AT, PAUSED, VELOCITY, MOVING = range(FIRST, FIRST + 4)


@njit
def begin(p1: float, p2: float, x: float, theta: Array) -> Array:
    """Return a valve that has stuck at the present command."""
    state = np.zeros(FIRST + 4)
    state[P1], state[P2], state[X] = p1, p2, x
    state[STUCK_AT] = p1
    return state


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample; the interface of `Rival`."""
    limited = min(max(u, 0.0), 100.0)
    velocity = sign(limited - state[P1])
    if velocity != state[VELOCITY]:
        state[STUCK_AT] = state[P1]
        state[MOVING] = 0.0
        if velocity == 0.0:
            state[PAUSED] = 1.0
    elif velocity != 0.0:
        threshold = theta[J] if state[PAUSED] != 0.0 else theta[S]
        on = state[MOVING] != 0.0 and theta[LATCHED] >= 0.5
        if on or abs(limited - state[STUCK_AT]) > threshold:
            state[X] = limited - velocity * 0.5 * (theta[S] - theta[J])
            state[PAUSED] = 0.0
            state[MOVING] = 1.0
    if limited != u:
        state[X] = state[STUCK_AT] = limited
    state[VELOCITY] = velocity
    follow(limited, state)
    return state[X]


MODEL = Rival(
    name='choudhury',
    title='Choudhury, Thornhill and Shah 2005',
    parameters=(
        stick_band(),
        slip_jump(),
        Parameter(
            'latched',
            '-',
            '-',
            1.0,
            0.0,
            1.0,
            'linear',
            'Switch: 1 keeps moving until the command turns, 0 as the public port',
        ),
    ),
    advance=advance,
    driven=advance,
    begin=begin,
    channel='u',
    from_friction=bands,
    held=('latched',),
    confirmed='the law, by one faithful port',
    reconstructed='latched = 1',
    remark='never answers a step: its sample is a change of sign and the next one a pause',
)
