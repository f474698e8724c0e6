# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""He, Wang, Pottmann and Qin (2007): static and dynamic friction on the residual u - x.

Confirmed by two public codes, one in the recursive and one in this form. The valve stops after
every move, so a ramp becomes a staircase whose steps depend on the sample time: never resample
a recording before fitting it.
"""

from numba import njit

from ..pipeline import Array
from .data_driven import at_rest, dynamic_level, follow, levels, sign, static_level
from .declaration import Rival
from .layout import X

F_S, F_D = range(2)


@njit
def residual_law(u: float, x: float, f_s: float, f_d: float) -> float:
    """Return the position after the command `u`."""
    residual = u - x
    return u - sign(residual) * f_d if abs(residual) > f_s else x


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample; the interface of `Rival`."""
    state[X] = residual_law(u, state[X], theta[F_S], theta[F_D])
    follow(u, state)
    return state[X]


MODEL = Rival(
    name='he',
    title='He, Wang, Pottmann and Qin 2007',
    parameters=(static_level(), dynamic_level()),
    advance=advance,
    driven=advance,
    begin=at_rest,
    channel='u',
    from_friction=levels,
    confirmed='the law, by two public codes in two forms',
    remark='stops after every sample: its answer to a ramp depends on the sample time',
)
