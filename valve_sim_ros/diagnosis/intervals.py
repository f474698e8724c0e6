# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How well the data know the parameters of a valve."""

import numpy as np

from ..model.pipeline import Array
from .fitting import Fitter, Valve
from .stages import Group
from .unknowns import to_point, to_values

STEP = 0.3
"""Step of the derivatives [steps of the unknowns]: wide enough to average over slips."""


def intervals(
    fitter: Fitter, group: Group, valve: Valve, inflation: float
) -> dict[str, tuple[float, float]]:
    """Return 95 % intervals of what a refit would vary, from the curvature of the cost.

    Parameters
    ----------
    fitter : Fitter
        At the bench.
    group : Group
        The stages in which they act.
    valve : Valve
        Fitted.
    inflation : float
        Samples per independent value of the noise.

    Returns
    -------
    dict of str to (float, float)
        By full name; the declared range where the data say nothing.
    """
    unknowns = fitter.problem(group, valve)[0]
    point = to_point(unknowns, valve.values)
    variances = np.diag(covariance(fitter, group, valve, inflation))
    spread = np.where(variances > 0.0, 1.96 * np.sqrt(np.maximum(variances, 0.0)), np.inf)
    return {
        unknown.name: (unknown.outward(float(at - each)), unknown.outward(float(at + each)))
        for unknown, at, each in zip(unknowns, point, spread, strict=True)
    }


def covariance(fitter: Fitter, group: Group, valve: Valve, inflation: float) -> Array:
    """Return the covariance of what a refit would vary, shape (n, n) [steps of the unknowns].

    Arguments as for `intervals`; 0 where the data say nothing.
    """
    unknowns, signal, drive = fitter.problem(group, valve)
    point = to_point(unknowns, valve.values)
    moved = []
    for index in range(point.size):
        sides = []
        for way in (STEP, -STEP):
            there = point.copy()
            there[index] += way
            values = to_values(unknowns, there, valve.values)
            shifted = Valve(values, valve.effects)
            sides.append(fitter.residuals(shifted, signal, drive))
        moved.append((sides[0] - sides[1]) / (2.0 * STEP))
    jacobian = np.clip(np.stack(moved, axis=1), -50.0, 50.0)
    residual = fitter.residuals(valve, signal, drive)
    variance = float(np.mean(np.clip(residual, -4.0, 4.0) ** 2)) * inflation
    shown = jacobian.any(axis=0)
    found = np.zeros((point.size, point.size))
    inside = np.ix_(shown, shown)
    normal = jacobian[:, shown].T @ jacobian[:, shown]
    found[inside] = variance * np.linalg.pinv(normal, rcond=1e-10)
    return found
