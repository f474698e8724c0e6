# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Karnopp (1985): below the speed delta the stem stands still, whatever its momentum.

Confirmed by a public code and by public documentation. The defaults are Table 1 of the paper as
printed; its viscous coefficient of 1.59 kg/s is almost surely 3.5 lbf s/in = 612.9 N s/m misread
as 3.5 lb/s, which makes the stem over-damped (zeta = 1.147 instead of 0.003): that is the preset
`corrected`. The dead zone is delta_0/x_m. Table 1 has no Stribeck speed and the paper drops the
term; v_s > 0 brings it back.
"""

from dataclasses import replace

from numba import njit

from ..parameters import DELTA
from ..pipeline import Array
from .declaration import Rival
from .layout import OWN
from .physical import at_rest, chamber, hold, levels, seven, stribeck_speed
from .stick_slip import stick_slip

DEAD_ZONE, V_S = OWN, OWN + 1

MASS, SPRING, TRAVEL = 1.36, 5.25e4, 0.1016
"""Table 1: moving mass [kg], spring constant [N/m], x_m [m]."""
STATIC, COULOMB, VISCOUS, VISCOUS_CORRECTED = 1708.0, 1423.0, 1.59, 612.9
"""Table 1: friction [N] and viscous coefficient [N s/m]; the last is the corrected one."""
STOPPED = 1e-4
"""Table 1: delta_0, speed that counts as zero [m/s]."""


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from the command; the interface of `Rival`."""
    motion = chamber(u, dt, state, theta)
    return stick_slip(motion, dt, state, theta, theta[DEAD_ZONE], theta[V_S])


@njit
def driven(p2: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample from a measured p2; the interface of `Rival`."""
    return stick_slip(hold(p2, state), dt, state, theta, theta[DEAD_ZONE], theta[V_S])


MODEL = Rival(
    name='karnopp',
    title='Karnopp 1985',
    parameters=(
        *seven(
            f_s=100.0 * STATIC / (SPRING * TRAVEL),
            f_d=100.0 * COULOMB / (SPRING * TRAVEL),
            a_1=SPRING / MASS,
            a_2=VISCOUS / MASS,
        ),
        replace(
            DELTA,
            default=100.0 * STOPPED / TRAVEL,
            description='Half-width of the dead zone of the speed, delta_0/x_m',
        ),
        stribeck_speed(0.0, 0.0),
    ),
    advance=advance,
    driven=driven,
    begin=at_rest,
    channel='p2',
    from_friction=levels,
    held=('a_1', 'delta', 'v_s'),
    work=4.0,
    confirmed='the law, by a public code and public documentation; Table 1 by the paper',
    reconstructed='the corrected viscous coefficient; the Stribeck speed',
    presets={'table_1': {}, 'corrected': {'a_2': VISCOUS_CORRECTED / MASS}},
)
