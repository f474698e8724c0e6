# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Search of rugged costs by evolution: CMA-ES after Hansen (2016), arXiv:1604.00772."""

from collections.abc import Callable
import math

import numpy as np

from ..model.pipeline import Array
from .descent import Minimum
from .workers import cheapest

BOUND = 6.0
"""Points this many times as costly as the best are all the same."""


def evolve(
    cost: Callable[[Array, float], float],
    point: Array,
    spread: float,
    rng: np.random.Generator,
    generations: int,
    size: int,
) -> Minimum:
    """Search around `point`; return the best point seen.

    Parameters
    ----------
    cost : callable
        Cost of a point; it may stop counting at its second argument.
    point : ndarray, shape (n,)
        Where to begin.
    spread : float
        Standard deviation at the beginning.
    rng : Generator
        Source of chance.
    generations, size : int
        How many generations of how many points.
    """
    n = point.size
    parents = size // 2
    weights = math.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    weights /= weights.sum()
    mass = 1.0 / float(np.sum(weights**2))
    c_sigma = (mass + 2) / (n + mass + 5)
    damping = 1 + 2 * max(0.0, math.sqrt((mass - 1) / (n + 1)) - 1) + c_sigma
    c_path = (4 + mass / n) / (n + 4 + 2 * mass / n)
    c_one = 2 / ((n + 1.3) ** 2 + mass)
    c_rank = min(1 - c_one, 2 * (mass - 2 + 1 / mass) / ((n + 2) ** 2 + mass))
    expected = math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n))
    mean, sigma, covariance = point.copy(), 1.0, np.eye(n)
    path_sigma, path = np.zeros(n), np.zeros(n)
    best = Minimum(point, cost(point, math.inf))
    for generation in range(generations):
        values, axes = np.linalg.eigh(covariance)
        roots = np.sqrt(np.maximum(values, 1e-20))
        steps = rng.standard_normal((size, n)) * roots @ axes.T
        points = mean + sigma * spread * steps
        costs = np.array(cheapest(cost, points, parents, BOUND * best.cost))
        order = np.argsort(costs, kind='stable')[:parents]
        if costs[order[0]] < best.cost:
            best = Minimum(points[order[0]], float(costs[order[0]]))
        move = weights @ steps[order]
        mean = mean + sigma * spread * move
        path_sigma = (1 - c_sigma) * path_sigma + math.sqrt(c_sigma * (2 - c_sigma) * mass) * (
            axes @ ((axes.T @ move) / roots)
        )
        length = float(np.linalg.norm(path_sigma))
        quick = (
            length / math.sqrt(1 - (1 - c_sigma) ** (2 * generation + 2))
            < (1.4 + 2 / (n + 1)) * expected
        )
        path = (1 - c_path) * path
        if quick:
            path += math.sqrt(c_path * (2 - c_path) * mass) * move
        covariance = (
            (1 - c_one - c_rank) * covariance
            + c_one * (np.outer(path, path) + (0 if quick else c_path * (2 - c_path)) * covariance)
            + c_rank * (steps[order].T * weights) @ steps[order]
        )
        sigma *= math.exp((c_sigma / damping) * (length / expected - 1))
        if spread * sigma * np.sqrt(values.max()) < 0.03:
            break
    return best
