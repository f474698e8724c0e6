# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stenman, Gustafsson and Forsman (2003): one parameter, the valve jumps to the command.

Confirmed by two public simulators and by the paper's identity: He's model with f_s = d, f_d = 0.
"""

from numba import njit

from ..declarations import Parameter
from ..pipeline import Array
from .data_driven import at_rest, follow
from .declaration import Rival
from .layout import X

D = 0


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample; the interface of `Rival`."""
    if abs(u - state[X]) > theta[D]:
        state[X] = u
    follow(u, state)
    return state[X]


MODEL = Rival(
    name='stenman',
    title='Stenman, Gustafsson and Forsman 2003',
    parameters=(
        Parameter(
            'd',
            'd',
            '%',
            7.0249,
            0.0,
            60.0,
            'linear',
            'Stick band: the valve jumps to the command when |u - x| exceeds it',
        ),
    ),
    advance=advance,
    driven=advance,
    begin=at_rest,
    channel='u',
    from_friction=lambda f_s, f_d: {'d': f_s},
    confirmed='the law, by two public simulators and the identity the paper states',
)
