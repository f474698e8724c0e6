# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search: a global one per stage in the order of the flow, then a joint local polish."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import differential_evolution, least_squares

from ..model.pipeline import Array
from .problem import Problem, UNKNOWNS

if TYPE_CHECKING:
    Progress = Callable[[float, str], None]

GENERATIONS = 60
POPULATION = 8
"""Members per unknown."""
MOST_STEPS = 30
RATIO = UNKNOWNS.index('a_1/a_2')
USUAL_RATIOS = (0.87, 0.6, 0.3)
"""Shares of the logarithmic range: about 10, 2 and 0.3 1/s. The cost is nearly flat in a_1/a_2 far
from the optimum, so it takes no part in the global search and several starts in the polish."""


def search(problem: Problem, seed: int, progress: 'Progress') -> tuple[Array, Array]:
    """Maximise the fitness of all measured signals, each weighed by its noise.

    Each stage's unknowns are searched globally (differential evolution) on the first measured
    signal that sees them, the stages before held at what was found; at last all are polished
    together (least squares). No start is needed; the same seed gives the same result.

    Parameters
    ----------
    problem : Problem
        What to fit.
    seed : int
        Seed of the global search.
    progress : callable
        Called with the share done, 0 to 1, and what is being done.

    Returns
    -------
    point : ndarray, shape (size,)
        Best point of the unit cube.
    jacobian : ndarray, shape (m, size)
        Of the residuals there.
    """
    point = np.full(problem.size, 0.5)
    point[RATIO] = USUAL_RATIOS[0]
    stages = problem.stages()
    for number, (signal, unknowns) in enumerate(stages):
        progress(number / (len(stages) + 1), f'searching {signal}')
        point = _global(problem, point, signal, unknowns, seed)
    progress(len(stages) / (len(stages) + 1), 'polishing all together')
    return polish(problem, point, USUAL_RATIOS)


def _global(problem: Problem, point: Array, signal: str, unknowns: list[int], seed: int) -> Array:
    """Search some unknowns on one signal; the others stay."""

    def cost(part: Array) -> float:
        trial = point.copy()
        trial[unknowns] = part
        residuals = problem.residuals(trial, (signal,))
        return float(residuals @ residuals)

    found = differential_evolution(
        cost,
        [(0.0, 1.0)] * len(unknowns),
        maxiter=GENERATIONS,
        popsize=POPULATION,
        init='sobol',
        tol=1e-6,
        polish=False,
        seed=seed,
    )
    best = point.copy()
    best[unknowns] = found.x
    return best


def polish(problem: Problem, point: Array, ratios: tuple[float, ...] = ()) -> tuple[Array, Array]:
    """Polish all unknowns on all signals, from `point` and from it with other stem speeds.

    Returns what `search` does.
    """
    starts = [point]
    for share in ratios:
        if share != point[RATIO]:
            starts.append(point.copy())
            starts[-1][RATIO] = share
    return min((_descend(problem, start) for start in starts), key=lambda end: end[2])[:2]


def _descend(problem: Problem, point: Array) -> tuple[Array, Array, float]:
    """Go down from one start; steps of falling size pass over small kinks of the cost."""
    start = np.clip(point, 1e-9, 1.0 - 1e-9)
    for step in (1e-3, 1e-5):
        found = least_squares(
            problem.residuals,
            start,
            bounds=(0.0, 1.0),
            diff_step=step,
            x_scale=0.1,
            max_nfev=MOST_STEPS,
        )
        start = np.clip(found.x, 1e-9, 1.0 - 1e-9)
    return found.x, found.jac, float(found.cost)
