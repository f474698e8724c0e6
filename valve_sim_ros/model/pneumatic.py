# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stage p1 to p2: filling and emptying of the actuator chamber, eq. (5).

Over one sample the inlet pressure is held, so the chamber pressure is exactly
p2(tau) = target + (p2(0) - target) exp(-rate tau).
"""

from numba import njit


@njit
def is_filling(p1_held: float, p1_new: float, p2: float, printed: bool) -> bool:
    """Tell which time constant rules the coming sample, the condition of eq. (5).

    Parameters
    ----------
    p1_held, p1_new : float
        Inlet pressure held over the sample, p1(t-1), and that of its end, p1(t) [% of span].
    p2 : float
        Chamber pressure at the start of the sample [% of span].
    printed : bool
        Compare p1(t) as printed, instead of the p1(t-1) that eq. (5) lets act.
    """
    return (p1_new if printed else p1_held) > p2


@njit
def chamber_pressure(p2: float, target: float, decay: float) -> float:
    """Return p2 at the end of the sample; `decay` is exp(-T_s / T_g), eq. (5)."""
    return target + (p2 - target) * decay
