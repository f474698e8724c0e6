# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""He and Wang (2014): He's semi-physical model with K_1, f_s1 and f_d1.

The paper confirms that its signature is He's with f_s = f_s1 and
f_d = f_d1 - (K_1 - 1)(f_s1 - f_d1); its estimates fit that to four digits. The flow chart could
not be retrieved: the default is the signature form, which alone gives the paper's equal fitness
for Kano's model; `force` = 1 is a reconstruction of the chart with the stem's flight by
K_1 (f_s1 - f_d1). K_1 = 1.99 is the paper's, from zeta = 0.003; K_1 = 1 suits an over-damped stem.
"""

from numba import njit

from ..declarations import Parameter
from ..pipeline import Array
from .data_driven import at_rest, dynamic_level, follow, sign, static_level
from .declaration import Rival
from .he import residual_law
from .layout import X

K_1, F_S1, F_D1, FORCE = range(4)
PAPER_K_1 = 1.99


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample; the interface of `Rival`."""
    k_1, f_s1, f_d1 = theta[K_1], theta[F_S1], theta[F_D1]
    if theta[FORCE] >= 0.5:
        residual = u - state[X]
        if abs(residual) > f_s1:
            state[X] += k_1 * (residual - sign(residual) * f_d1)
    else:
        state[X] = residual_law(u, state[X], f_s1, f_d1 - (k_1 - 1.0) * (f_s1 - f_d1))
    follow(u, state)
    return state[X]


MODEL = Rival(
    name='he_semi_physical',
    title='He and Wang 2014, semi-physical',
    parameters=(
        Parameter(
            'K_1',
            'K_1',
            '-',
            PAPER_K_1,
            1.0,
            2.0,
            'linear',
            'Peak factor of the slip; 1.99 for zeta = 0.003, 1 for an over-damped stem',
        ),
        static_level('he_f_s1'),
        dynamic_level('he_f_d1', 8.7848),
        Parameter(
            'force',
            '-',
            '-',
            0.0,
            0.0,
            1.0,
            'linear',
            'Switch: 0 for the signature form, 1 for the force form',
        ),
    ),
    advance=advance,
    driven=advance,
    begin=at_rest,
    channel='u',
    from_friction=lambda f_s, f_d: {
        'he_f_s1': f_s,
        'he_f_d1': (f_d + (PAPER_K_1 - 1.0) * f_s) / PAPER_K_1,
    },
    held=('K_1', 'force'),
    confirmed="the relation of f_s1, f_d1 and K_1 to He's signature, by the paper's own numbers",
    reconstructed='the flow chart (force = 1)',
)
