# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What drifts: on and on, or until it settles."""

import math

from numba import njit

from .declarations import EffectParameter

SETTLING = EffectParameter(
    'settling',
    'k',
    '1/h',
    0.0,
    0.0,
    100.0,
    'linear',
    'Rate at which the drift settles, as of what warms up',
    starts=(10.0,),
)


@njit
def drifted(time: float, settling: float) -> float:
    """Return the hours after `time` [s], or (1 - exp(-k t))/k if the drift settles at k [1/h]."""
    hours = time / 3600.0
    return hours if settling <= 0.0 else -math.expm1(-settling * hours) / settling
