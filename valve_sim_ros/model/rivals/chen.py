# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chen, Tan and Huang (2008): two-layer binary tree with f_s and f_d; revised by Li et al. (2014).

Reconstruction: the abstracts confirm the two layers, the purpose and the weakness that the
revision cures (a reversal while moving); the trees themselves could not be retrieved. Layer one
asks whether the valve was moving, layer two whether it goes on or breaks away. The original
spends a sample on stopping; the revision tests again at once.
"""

from numba import njit

from ..declarations import Parameter
from ..pipeline import Array
from .data_driven import dynamic_level, levels, static_level
from .declaration import Rival
from .layout import X
from .xch import two_state_start, two_states

F_S, F_D, REVISED = range(3)


@njit
def advance(u: float, dt: float, state: Array, theta: Array) -> float:
    """Take one sample; the interface of `Rival`."""
    two_states(u, state, theta[F_S], theta[F_D], theta[REVISED] >= 0.5)
    return state[X]


MODEL = Rival(
    name='chen',
    title='Chen, Tan and Huang 2008, revised by Li et al. 2014',
    parameters=(
        static_level(),
        dynamic_level(),
        Parameter(
            'revised',
            '-',
            '-',
            1.0,
            0.0,
            1.0,
            'linear',
            'Switch: 0 for Chen 2008, which answers a reversal one sample late, 1 for Li 2014',
        ),
    ),
    advance=advance,
    driven=advance,
    begin=two_state_start,
    channel='u',
    from_friction=levels,
    held=('revised',),
    confirmed='two layers, pure deadzone as a limit, the weakness at reversals, by the abstracts',
    reconstructed='both trees; the revised one equals Kano with a neutral start',
    remark='stops at every sign change of the command: do not feed it a noisy copy of u',
    presets={'original': {'revised': 0.0}, 'revised': {'revised': 1.0}},
)
