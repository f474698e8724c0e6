# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stages before the stem may be what their data leave open: slips hang on less than that."""

from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from ..model.pipeline import Array
from .adequacy import leftover
from .evolution import evolve
from .fitting import Fitter, GENERATIONS, POPULATION, Valve
from .intervals import covariance
from .stages import Group, groups
from .unknowns import to_point, to_values

WIDEST = 1.0
"""Standard deviation beyond which data say next to nothing [steps of the unknowns]."""


def loosened(fitter: Fitter, group: Group, valve: Valve) -> Valve:
    """Return a valve fitted to a group of stages while those before it give way a little.

    Whether a slip that only just comes does come may hang on a hundredth of a per cent of p2,
    less than p1 and p2 tell: no friction makes up for that.

    Parameters
    ----------
    fitter : Fitter
        At the bench.
    group : Group
        The stages in question.
    valve : Valve
        Fitted to this group and those before.

    Returns
    -------
    Valve
        As good for the signals before as noise allows; its cost counts how far it goes there.
    """
    own, signal, drive = fitter.problem(group, valve)
    before = [each for each in groups(fitter.bench.signals) if each.signal in group.drive]
    open_ways = [_left_open(fitter, each, valve) for each in before]
    ways = block_diag(*open_ways, np.eye(len(own)))
    unknowns = [u for each in before for u in fitter.problem(each, valve)[0]] + [*own]
    point = to_point(unknowns, valve.values)
    inflation = leftover(fitter.residuals(valve, signal, drive)).inflation
    count = point.size - len(own)

    def there(move: Array) -> Valve:
        return replace(valve, values=to_values(unknowns, point + ways @ move, valve.values))

    def score(move: Array, bound: float) -> float:
        away = inflation * float(np.sum(move[:count] ** 2))
        return away + fitter.score(there(move), signal, drive, bound - away)

    rng = np.random.default_rng(fitter.seed)
    found = evolve(score, np.zeros(point.size), WIDEST, rng, GENERATIONS, POPULATION)
    return replace(there(found.point), cost=found.cost)


def _left_open(fitter: Fitter, group: Group, valve: Valve) -> Array:
    """Return the ways in which a fit of a group may be off, a standard deviation each, (n, n)."""
    left = leftover(fitter.residuals(valve, group.signal))
    variances, axes = np.linalg.eigh(covariance(fitter, group, valve, left.inflation))
    ways: Array = axes * np.sqrt(np.clip(variances, 0.0, WIDEST**2))
    return ways
