# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far the optimum would scatter if the measurement were repeated."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..model.pipeline import Array
from .colour import scatter
from .problem import Problem, STEP
from .stretches import Mask

PRIOR = 12.0
"""Information of knowing only the legal range: one over the variance of a uniform share."""
LEAST_VARIANCE = 0.05
"""Least variance of the residuals over that of the noise assumed: clean simulations have none."""
LEAST_STEP, MOST_STEP = 1e-6, 5e-2
ROUNDS = 3
GRADIENT_STEP = 1e-6


@dataclass(frozen=True)
class Covariance:
    """Scatter around an optimum, in shares of the unknowns' ranges.

    Attributes
    ----------
    problem : Problem
        What was fitted; `point` belongs to it.
    point : ndarray, shape (size,)
        The optimum.
    matrix : ndarray, shape (size, size)
        Covariance of the point.
    plain : ndarray, shape (size, size)
        What it would be if the residuals did not remember.
    unseen : ndarray of bool, shape (size,)
        Unknowns that could take any value in their range without a visible change.
    """

    problem: Problem
    point: Array
    matrix: Array
    plain: Array
    unseen: Mask

    def of(self, quantity: Callable[[dict[str, float]], float]) -> tuple[float, float]:
        """Return a function of the parameters at the optimum and its standard error."""
        gradient = self._gradient(quantity)
        value = quantity(self.problem.values(self.point))
        return value, float(np.sqrt(gradient @ self.matrix @ gradient))

    def correlation(self, quantities: list[Callable[[dict[str, float]], float]]) -> Array:
        """Return the correlation matrix of functions of the parameters."""
        rows = np.array([self._gradient(quantity) for quantity in quantities])
        matrix = rows @ self.matrix @ rows.T
        sizes = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
        return np.asarray(matrix / np.outer(sizes, sizes))

    def inflation(self, quantity: Callable[[dict[str, float]], float]) -> float:
        """Return by how much the memory of the residuals widens the variance of a quantity."""
        gradient = self._gradient(quantity)
        plain = float(gradient @ self.plain @ gradient)
        return float(gradient @ self.matrix @ gradient) / plain if plain > 0.0 else 1.0

    def ridge(self, quantity: Callable[[dict[str, float]], float]) -> Array:
        """Return how the point follows if a quantity is moved by 1 and the others make up."""
        across = self.matrix @ self._gradient(quantity)
        return np.asarray(across / max(float(self._gradient(quantity) @ across), 1e-300))

    def _gradient(self, quantity: Callable[[dict[str, float]], float]) -> Array:
        """Return the derivatives of a quantity by the shares."""
        result = np.zeros(self.point.size)
        for index in range(len(self.problem.unknowns)):
            step = GRADIENT_STEP if self.point[index] < 0.5 else -GRADIENT_STEP
            moved = self.point.copy()
            moved[index] += step
            values = self.problem.values
            result[index] = (quantity(values(moved)) - quantity(values(self.point))) / step
        return result


def covariance(problem: Problem, point: Array) -> Covariance:
    """Return the covariance of a least-squares optimum (sandwich formula).

    Derivatives are taken over about one standard error, where the intervals will lie, not in
    the limit: the cost has small kinks. Knowing that all values are in range bounds the scatter
    of what the data do not see.
    """
    residuals = problem.residuals(point)
    known = max(int(np.count_nonzero(residuals)), 1)
    variance = max(float(residuals @ residuals) / known, LEAST_VARIANCE)
    own = PRIOR * np.eye(point.size)
    jacobian = problem.jacobian(point, residuals, STEP)
    bread = np.linalg.inv(jacobian.T @ jacobian / variance + own)
    for _ in range(ROUNDS):
        del jacobian  # the next one needs as much memory
        jacobian = _secants(problem, point, bread)
        information = jacobian.T @ jacobian / variance
        bread = np.linalg.inv(information + own)
    middle = scatter(problem, jacobian, residuals) / variance**2 + own
    return Covariance(problem, point, bread @ middle @ bread, bread, np.diag(information) < 1.0)


def _secants(problem: Problem, point: Array, matrix: Array) -> Array:
    """Return the derivatives of the residuals over one standard error each way, shape (m, size).

    The steps go along the axes of the ellipsoid of scatter: far along the ridges of the cost,
    little across them.
    """
    sizes, axes = np.linalg.eigh(matrix)
    steps = axes * np.sqrt(np.maximum(sizes, LEAST_STEP**2))
    steps *= np.minimum(1.0, MOST_STEP / np.abs(steps).max(axis=0))
    changes = np.empty((problem.blocks[-1][1].stop, point.size), order='F')
    moves = np.empty_like(steps)
    for index, step in enumerate(steps.T):
        ahead, behind = np.clip(point + step, 0.0, 1.0), np.clip(point - step, 0.0, 1.0)
        moves[:, index] = ahead - behind
        changes[:, index] = problem.residuals(ahead) - problem.residuals(behind)
    turn = np.linalg.inv(moves)
    for _, rows in problem.blocks:
        changes[rows] = changes[rows] @ turn
    return changes
