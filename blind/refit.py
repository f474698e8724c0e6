# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much of an effect a valve without it could imitate by other values of its constants.

A rough, sampled valve (play, lag, sticking stem) is fitted to the noise-free signals; what it
leaves over, beyond what it leaves over on the valve without the effect, can be found.
"""

from math import exp

import numba
import numpy as np
from scipy.optimize import minimize

from .physics import Physics
from .plant import Trace
from .visibility import largest

EVALUATIONS = 250


@numba.njit
def _rough(u, p1, p2, have_p1, have_p2, theta, period, phase):
    """Return p1, p2 and x of the rough valve at the samples, shape (3, n)."""
    f_d1, T_g1, T_g2, f_s, f_d, rate = theta
    out = np.empty((3, u.size))
    out[0, 0], out[1, 0], out[2, 0] = p1[0], p2[0], p2[0]
    x, way = p2[0], 0.0
    part = 1.0 - exp(-period * rate)
    for k in range(1, u.size):
        out[0, k] = min(max(out[0, k - 1], u[k] - f_d1), u[k] + f_d1)
        pressure = out[1, k - 1]
        for late in range(2):
            drive = p1[k - 1 + late] if have_p1 else out[0, k - 1 + late]
            span = period * (phase if late else 1.0 - phase)
            pressure = drive + (pressure - drive) * exp(
                -span / (T_g1 if drive > pressure else T_g2)
            )
        out[1, k] = pressure
        force = (p2[k] if have_p2 else pressure) - x
        if way == 0.0 and abs(force) > f_s:
            way = 1.0 if force > 0.0 else -1.0
        if way != 0.0:
            move = force - way * f_d
            if move * way > 0.0:
                x += part * move
            else:
                way = 0.0
        out[2, k] = x
    return out


def left_over(
    trace: Trace,
    u: np.ndarray,
    base: Physics,
    noise: dict[str, float],
    signals: tuple[str, ...],
    period: float,
    phase: float,
) -> dict[str, float]:
    """Return what the best rough valve leaves of each signal where most [multiples of noise].

    The first tenth is left out: the rough valve does not know how the record began.
    """
    start = np.log([base.f_d1, base.T_g1, base.T_g2, base.f_s, base.f_d, base.a_1 / base.a_2])
    after = u.size // 10

    def residuals(logs: np.ndarray) -> dict[str, np.ndarray]:
        rough = _rough(
            u, trace.p1, trace.p2, 'p1' in signals, 'p2' in signals, np.exp(logs), period, phase
        )
        rows = {'p1': 0, 'p2': 1, 'x': 2}
        return {
            name: (rough[rows[name]] - getattr(trace, name))[after:] / noise[name]
            for name in signals
        }

    def cost(logs: np.ndarray) -> float:
        if np.abs(logs - start).max() > 4.0:
            return 1e12
        return sum(float(np.minimum(each**2, 1e3).sum()) for each in residuals(logs).values())

    simplex = np.vstack([start, start + 0.25 * np.eye(start.size)])
    found = minimize(
        cost,
        start,
        method='Nelder-Mead',
        options={'maxfev': EVALUATIONS, 'initial_simplex': simplex},
    )
    return {name: largest(each) for name, each in residuals(found.x).items()}
