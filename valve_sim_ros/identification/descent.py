# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Least squares inside the unit cube: damped Gauss-Newton steps that may slide along its walls."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..model.pipeline import Array

Evaluate = Callable[[Array], Array]
Differentiate = Callable[[Array, Array, float], Array]

LEAST_GAIN = 1e-7
"""A step that lowers the cost by less than this share is the last one of its stage."""
MOST_DAMPING = 1e8


@dataclass(frozen=True)
class End:
    """Where a descent ended: the point, its residuals and their sum of squares."""

    point: Array
    residuals: Array
    cost: float


def descend(
    evaluate: Evaluate,
    differentiate: Differentiate,
    start: Array,
    *,
    most_steps: int,
    step: float,
    base: Array | None = None,
) -> End:
    """Walk down from `start` (Levenberg-Marquardt with Marquardt's scaling and projection).

    Parameters
    ----------
    evaluate : callable
        Point of the cube, shape (n,), to residuals, shape (m,).
    differentiate : callable
        (point, residuals there, step) to the jacobian, shape (m, n).
    start : ndarray, shape (n,)
        Where to start; clipped into the cube.
    most_steps : int
        Most jacobians.
    step : float
        Step of the derivatives: a large one passes over small kinks of the cost.
    base : ndarray, shape (m,), optional
        Residuals at `start`, if known.
    """
    point = np.clip(start, 0.0, 1.0)
    residuals = evaluate(point) if base is None else base
    cost = float(residuals @ residuals)
    damping = 1e-2
    for _ in range(most_steps):
        jacobian = differentiate(point, residuals, step)
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ residuals
        del jacobian  # the next one needs as much memory
        before = cost
        while damping < MOST_DAMPING:
            trial = np.clip(point + _direction(normal, gradient, damping, point), 0.0, 1.0)
            tried = evaluate(trial)
            cost_tried = float(tried @ tried)
            if cost_tried < cost:
                point, residuals, cost = trial, tried, cost_tried
                damping = max(0.1 * damping, 1e-9)
                break
            damping *= 8.0
        if before - cost <= LEAST_GAIN * before:
            break
    return End(point, residuals, cost)


def _direction(normal: Array, gradient: Array, damping: float, point: Array) -> Array:
    """Return a damped step; unknowns that would leave the cube at once stay on its wall."""
    size = point.size
    scale = np.maximum(np.diag(normal), 1e-12 * max(float(np.diag(normal).max()), 1e-30))
    free = ~(((point <= 0.0) & (gradient > 0.0)) | ((point >= 1.0) & (gradient < 0.0)))
    result = np.zeros(size)
    if free.any():
        part = normal[np.ix_(free, free)] + damping * np.diag(scale[free])
        result[free] = -np.linalg.solve(part, gradient[free])
    return result
