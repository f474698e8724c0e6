# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stage u to p1: the backlash of the electro-pneumatic converter, eq. (1)."""

from numba import njit


@njit
def backlash(p1: float, u: float, f_d1: float) -> float:
    """Return the inlet pressure after the command `u`, eq. (1) as a play operator.

    Parameters
    ----------
    p1, u : float
        Inlet pressure of the sample before and the new command [% of span].
    f_d1 : float
        Half-width of the backlash [% of span].
    """
    return min(max(p1, u - f_d1), u + f_d1)
