# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Least squares where single residuals jump: damped Gauss-Newton, then a walk along the axes.

Slips come a sample earlier or later as a parameter moves, so derivatives are differences over
steps of visible size, and single wild residuals count linearly (Huber).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..model.pipeline import Array
from ..model.scoring import HUBER
from .workers import at_once


class Minimum(NamedTuple):
    """Where a descent ended: point, cost."""

    point: Array
    cost: float


def cost_of(residuals: Array) -> float:
    """Return the robust sum of squares."""
    size = np.abs(residuals)
    return float(np.sum(np.where(size <= HUBER, size * size, HUBER * (2.0 * size - HUBER))))


def descend(
    residuals: Callable[[Array], Array],
    point: Array,
    most: int = 25,
    step: float = 0.2,
    enough: float = 1e-3,
) -> Minimum:
    """Follow the slope from `point` for at most `most` steps."""
    now = residuals(point)
    cost = cost_of(now)
    damping = 1e-2
    for _ in range(most):
        weights = np.sqrt(np.minimum(1.0, HUBER / np.maximum(np.abs(now), 1e-12)))
        moved = at_once(residuals, point + step * np.eye(point.size))
        jacobian = (np.stack(moved, axis=1) - now[:, None]) / step * weights[:, None]
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ (now * weights)
        diagonal = np.diag(normal) + 1e-9 * max(np.trace(normal), 1e-12)
        better = False
        for _ in range(6):
            move = -np.linalg.solve(normal + np.diag(damping * diagonal), gradient)
            move = np.clip(move, -30.0, 30.0)
            there = residuals(point + move)
            if cost_of(there) < cost:
                better = True
                break
            damping *= 6.0
        if not better:
            break
        gained = cost - cost_of(there)
        point, now, cost = point + move, there, cost - gained
        damping = max(damping / 8.0, 1e-6)
        if gained < enough * max(cost, 1.0) and gained < 1.0:
            break
    return Minimum(point, cost)


def walk(
    cost: Callable[[Array, float], float],
    minimum: Minimum,
    steps: tuple[float, ...] = (1.0, 0.3, 0.1),
) -> Minimum:
    """Try steps along each axis, ever shorter, and keep what lowers the cost.

    `cost` may stop counting at its second argument.
    """
    point, best = minimum
    for step in steps:
        for index in range(point.size):
            for way in (step, -step):
                while True:
                    moved = point.copy()
                    moved[index] += way
                    there = cost(moved, best)
                    if there >= best - 1e-9:
                        break
                    point, best = moved, there
    return Minimum(point, best)
