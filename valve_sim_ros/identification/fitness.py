# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How well a fitted signal matches a measured one."""

import math

import numpy as np

from ..model.pipeline import Array


def fitness(measured: Array, fitted: Array) -> float:
    """Return eta of eq. (11), 100 (1 - |x - xhat|^2 / |x - mean(x)|^2), squared norms.

    Parameters
    ----------
    measured, fitted : ndarray, shape (n,)
        Signals [% of span]; samples that are NaN in `measured` do not count.

    Returns
    -------
    float
        Per cent; NaN if the measured signal is constant or empty.
    """
    known = np.isfinite(measured)
    if not known.any():
        return float('nan')
    x, estimate = measured[known], fitted[known]
    spread = float(np.sum((x - x.mean()) ** 2))
    return 100.0 * (1.0 - float(np.sum((x - estimate) ** 2)) / spread) if spread else float('nan')


def nrmse_fit(eta: float) -> float:
    """Return 100 (1 - |x - xhat| / |x - mean(x)|), the fit of system identification tools [%].

    It follows from `eta`, the same with squared norms.
    """
    missing = 1.0 - eta / 100.0
    return 100.0 * (1.0 - math.sqrt(missing)) if missing >= 0.0 else math.nan
