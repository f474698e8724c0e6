# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search: starts from the physics and from everywhere, a race of the best, then a polish."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import qmc

from ..model.pipeline import Array
from .descent import End
from .problem import Problem
from .starts import staged_starts
from .view import best_of, distinct, Task, View
from .watch import Watch

BLIND = 128
"""Points spread evenly over the cube that are tried beside those of the physics."""
STARTS = 12
HEATS = ((32, 5), (8, 3), (2, 1))
"""The race: width of the blur, and how many go on to the next heat."""
STRIDES = 5
"""Steps of each descent in a heat."""
COARSE = 3e-3
"""Step of the derivatives in the race: it passes over the small kinks of the cost."""
POLISH = ((4, 1e-3), (1, 1e-3), (1, 1e-4), (1, 1e-5))
"""Width of the blur and step of the derivatives."""
MOST_STEPS = 30
HOPS = (0.7, 2.0, 6.0, 20.0, 60.0, 200.0)
"""Standard deviations by which each unknown hops off the optimum, the others following."""
HOPPERS = 6
ROUNDS = 8
HOP_WIDTH = 8
PROMISING = 1.3
"""A hop that ends within this factor of the best cost is polished."""
GAIN = 1e-6
SUSPECT = 1.04
"""Mean square of the residuals over the noise above which the optimum is doubted."""


def search(problem: Problem, seed: int = 0, watch: Watch | None = None) -> End:
    """Find the point of least weighted squares; no start is needed.

    Staged starts from the physics and the best of a Sobol sequence race down through blurs that
    fade; the winner is polished on the sharp cost, then tries hops along each unknown's ridge
    until none leads further down. If it does not come down to the noise, a second race from
    other blind starts checks it.

    Parameters
    ----------
    problem : Problem
        What to fit.
    seed : int
        Seed of the blind starts; the same seed gives the same result.
    watch : Watch, optional
        Told of every simulation; what its callback raises goes through.
    """
    watch = watch or Watch()
    best = _race(problem, seed, watch)
    if doubted(best):
        best = best_of([best, _race(problem, seed + 1, watch)], 1)[0]
    return best


def _race(problem: Problem, seed: int, watch: Watch) -> End:
    """Race the best starts; polish the winner and let it hop."""
    view = View(problem, watch)
    staged = [view.scored(point) for point in staged_starts(problem)]
    blind = (view.scored(point) for point in _blind(problem, seed))
    runners = staged + best_of(blind, STARTS - len(staged))
    for width, places in HEATS:
        blurred = View(problem, watch, width)
        ends = [blurred.descend(end.point, STRIDES, COARSE) for end in runners]
        runners = distinct(ends, places)
    return _hops(problem, polish(problem, runners[0].point, watch), watch)


def refit(problem: Problem, point: Array, watch: Watch | None = None) -> End:
    """Go down from the optimum of much the same data; search anew if it stays above the noise."""
    watch = watch or Watch()
    end = polish(problem, point, watch)
    if not doubted(end):
        return end
    return best_of([_hops(problem, end, watch), _race(problem, 0, watch)], 1)[0]


def doubted(end: End) -> bool:
    """Tell whether residuals are larger than noise alone would leave them."""
    return end.cost > SUSPECT * int(np.count_nonzero(end.residuals))


def polish(
    problem: Task,
    point: Array,
    watch: Watch | None = None,
    stages: Sequence[tuple[int, float]] = POLISH,
) -> End:
    """Go down from `point` with steps of falling size; return the best end on the sharp cost."""
    watch = watch or Watch()
    ends = []
    for width, step in stages:
        end = View(problem, watch, width).descend(point, MOST_STEPS, step)
        point = end.point
        if width == 1:
            ends.append(end)
    return best_of(ends, 1)[0]


def _hops(problem: Problem, best: End, watch: Watch) -> End:
    """Leave the optimum and go down again until nothing is further down."""
    view = View(problem, watch)
    for _ in range(ROUNDS):
        hopped = _hop(problem, view, best)
        if hopped.cost > best.cost * (1.0 - GAIN):
            break
        best = hopped
    return best


def _hop(problem: Problem, view: View, best: End) -> End:
    """Leave the optimum along the ridge of each unknown and go down again from the best places."""
    points = _around(problem, view, best)
    trials = best_of((view.scored(point) for point in points), HOPPERS)
    first = trials[0]
    if first.cost < best.cost * (1.0 - GAIN):
        return polish(problem, first.point, view.watch)
    blurred = View(problem, view.watch, HOP_WIDTH)
    ends = [blurred.descend(end.point, 3, COARSE) for end in trials]
    end = view.scored(best_of(ends, 1)[0].point)
    if end.cost < PROMISING * best.cost:
        return polish(problem, end.point, view.watch)
    return end


def _around(problem: Problem, view: View, best: End) -> list[Array]:
    """Return points along each unknown's ridge: where the others best make up for its change."""
    blurred = View(problem, view.watch, HOP_WIDTH)
    jacobian = blurred.jacobian(best.point, None, COARSE)
    residuals = blurred.scored(best.point).residuals
    variance = max(float(residuals @ residuals) / np.count_nonzero(residuals), 1e-3)
    information = jacobian.T @ jacobian + 1e-3 * np.eye(best.point.size)
    covariance = variance * np.linalg.inv(information)
    points = []
    for index in range(len(problem.unknowns)):
        ridge = covariance[:, index] / np.sqrt(covariance[index, index])
        for length in HOPS:
            points += [np.clip(best.point + by * ridge, 0.0, 1.0) for by in (-length, length)]
    return points


def _blind(problem: Problem, seed: int) -> Array:
    """Return points spread evenly over the unknowns, starting states as measured."""
    known = len(problem.unknowns)
    points = np.tile(problem.middle(), (BLIND, 1))
    points[:, :known] = qmc.Sobol(known, seed=seed).random(BLIND)
    return points
