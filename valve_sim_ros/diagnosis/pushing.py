# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What pushes a stem behind effects that are known: worked out once, whatever stem is tried."""

import numpy as np

from ..model.pipeline import Array
from .interleaving import Rows

PARTS = 8
"""Into so many parts is a step cut where a held stem moves between samples as well."""
AHEAD = ('f_d1', 'T_g1', 'T_g2', 'p1_0', 'p2_0')
"""What p2 depends on beside the effects before it; starting values of later stretches as well."""


def leading(p2: Array, dt: Array, filling: float, emptying: float) -> Array:
    """Return the inlet pressure, held from row to row, that leads the chamber of eq. (5) along p2.

    Parameters
    ----------
    p2, dt : ndarray, shape (m,)
        Chamber pressure [% of span], and the time since the row before [s].
    filling, emptying : float
        Time constants of the chamber [s].
    """
    change, step = np.diff(p2, append=p2[-1:]), np.append(dt[1:], 0.0)
    gain = -np.expm1(-step / np.where(change > 0.0, filling, emptying))
    return np.where(gain > 0.0, p2 + change / np.maximum(gain, 1e-12), p2)


def finer(now: Array, dt: Array, u: Array, rows: Rows) -> tuple[Array, Array, Array, Rows]:
    """Return what `interleaved` does, each step cut into PARTS."""
    share = np.arange(1, PARTS + 1) / PARTS
    between = (now[:-1, None] + np.diff(now)[:, None] * share).ravel()
    sent = np.repeat(u[:-1], PARTS)
    sent[PARTS - 1 :: PARTS] = u[1:]
    return (
        np.append(now[:1], between),
        np.append(dt[:1], np.repeat(dt[1:] / PARTS, PARTS)),
        np.append(u[:1], sent),
        PARTS * rows,
    )
