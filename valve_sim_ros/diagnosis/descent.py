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

MOST_TRIES, TRIES = 6, 2
"""So often is a step damped more before it is given up, less often with carried derivatives."""
MOST_CARRIED, WORTHWHILE = 3, 0.02
"""Derivatives are carried over so many steps, each of which gains such a part of the cost."""


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
    """Follow the slope from `point` for at most `most` steps.

    Derivatives are carried on from step to step (Broyden 1965) and differenced anew where they
    gain little.
    """
    now = residuals(point)
    cost = cost_of(now)
    damping = 1e-2
    slopes, carried = _differences(residuals, point, now, step), 0
    while most:
        found = _step(residuals, point, now, slopes, damping, TRIES if carried else MOST_TRIES)
        if found:
            most -= 1
            move, there, damping = found
            gained = cost - cost_of(there)
            slopes = slopes + np.outer(there - now - slopes @ move, move) / (move @ move)
            point, now, cost = point + move, there, cost - gained
            damping = max(damping / 8.0, 1e-6)
            carried += 1
            if carried <= MOST_CARRIED and gained >= WORTHWHILE * cost:
                continue
            if carried == 1 and gained < enough * max(cost, 1.0) and gained < 1.0:
                break
        elif not carried:
            break
        if most:
            slopes, carried = _differences(residuals, point, now, step), 0
    return Minimum(point, cost)


def _differences(
    residuals: Callable[[Array], Array], point: Array, now: Array, step: float
) -> Array:
    """Return the derivatives of residuals as differences, shape (residuals, unknowns)."""
    moved = at_once(residuals, point + step * np.eye(point.size))
    return (np.stack(moved, axis=1) - now[:, None]) / step


def _step(
    residuals: Callable[[Array], Array],
    point: Array,
    now: Array,
    slopes: Array,
    damping: float,
    tries: int,
) -> tuple[Array, Array, float] | None:
    """Return a move that lowers the cost, the residuals there and the damping, or None."""
    weights = np.sqrt(np.minimum(1.0, HUBER / np.maximum(np.abs(now), 1e-12)))
    jacobian = slopes * weights[:, None]
    normal, gradient = jacobian.T @ jacobian, jacobian.T @ (now * weights)
    diagonal = np.diag(normal) + 1e-9 * max(np.trace(normal), 1e-12)
    cost = cost_of(now)
    for _ in range(tries):
        move = -np.linalg.solve(normal + np.diag(damping * diagonal), gradient)
        move = np.clip(move, -30.0, 30.0)
        there = residuals(point + move)
        if cost_of(there) < cost:
            return move, there, damping
        damping *= 6.0
    return None


def walk(
    cost: Callable[[Array, float], float],
    minimum: Minimum,
    steps: tuple[float, ...] = (1.0, 0.3, 0.1),
) -> Minimum:
    """Try steps along each axis, ever shorter, and keep what lowers the cost.

    Steps that do so double: a state long forgotten may be far off, and hardly matters. `cost` may
    stop counting at its second argument.
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
                    way *= 2.0
    return Minimum(point, best)
