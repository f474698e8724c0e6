# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Levels of friction tried on a rival model: costs of many candidates at once, grids that narrow.

The fitness of data-driven models is piecewise constant or jumps in f_s, so no gradients are used:
a coarse grid over the legal range, then grids about the best candidates, each finer than the last.
Physical models, slower and smoother, go downhill by simplices instead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from ..model.pipeline import Array
from ..model.rivals.declaration import Channel, Rival
from ..model.rivals.run import sweeper

ALL = np.inf
SLACK = 1.5
"""Candidates worse than the best by more than this factor are given up on the way."""
FINEST = 2e-4
"""Grids narrow down to this step [% of span]."""
WIDTH = 3
"""Points to each side of the centre of a grid; the next grid is finer by as much."""
SAME = 1e-9
"""Relative difference of cost that does not count."""
SCANS = ((1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0))
"""Lines along which a coarse optimum is looked for again: the moment of a jump is sensitive to
f_s - f_d (a ramp) or f_s + f_d (a reversal), its level to f_d."""
SIMPLEX = (1.0, 1.0, 0.3)
"""First step of the descent in f_s, f_d [% of span] and ln a_2."""


@dataclass(frozen=True)
class Run:
    """A run of samples without a gap, as a rival's kernels receive it.

    Attributes
    ----------
    inputs, dt, x : ndarray, shape (n,)
        Input [% of span], steps [s], measured position [% of span].
    counts : ndarray of bool, shape (n,)
        Which samples of x count.
    origin : ndarray, shape (3,)
        p1, p2, x at the start [% of span].
    """

    inputs: Array
    dt: Array
    x: Array
    counts: Array
    origin: Array


@dataclass(frozen=True)
class Candidates:
    """Points (f_s, f_d[, ln a_2]) and the squared errors of x that a rival leaves there.

    Attributes
    ----------
    model : Rival
        The model.
    channel : {'u', 'p2'}
        What drives it.
    fixed : mapping of str to float
        Values of the parameters that are not searched.
    runs : sequence of Run
        The data.
    """

    model: Rival
    channel: Channel
    fixed: dict[str, float]
    runs: Sequence[Run]

    def values(self, points: Array) -> dict[str, Array]:
        """Return the parameters at `points`, shape (m, 2 or 3), within their bounds."""
        values = {**self.fixed, **self.model.from_friction(points[:, 0], points[:, 1])}
        if points.shape[1] == 3:
            values['a_2'] = np.exp(points[:, 2])
        m = points.shape[0]
        return {
            p.name: np.clip(np.broadcast_to(values[p.name], m), p.lower, p.upper)
            for p in self.model.parameters
        }

    def costs(self, points: Array, slack: float = SLACK) -> Array:
        """Return the sum of squared errors of x at each point; infinite where given up."""
        values = self.values(points)
        thetas = np.stack([values[p.name] for p in self.model.parameters], axis=1)
        kernel = self.model.driven if self.channel == 'p2' else self.model.advance
        sweep = sweeper(self.model.name, kernel, self.model.begin)
        costs = np.zeros(points.shape[0])
        for run in self.runs:
            sweep(run.inputs, run.dt, run.x, run.counts, run.origin, thetas, costs, slack)
        return costs


def legal(points: Array) -> Array:
    """Return points with |f_d| <= f_s, the nearest ones: S and J are not negative."""
    points = points.copy()
    points[:, 0] = np.maximum(points[:, 0], 0.0)
    points[:, 1] = np.clip(points[:, 1], -points[:, 0], points[:, 0])
    return points


def narrow(
    candidates: Candidates,
    starts: Array,
    steps: Array,
    keep: int,
    fine: int,
    progress: Callable[[float], object],
) -> Array:
    """Return the best point found from a grid of starts, by scans along lines and finer grids.

    Parameters
    ----------
    candidates : Candidates
        What to try them on.
    starts : ndarray, shape (m, d)
        The coarse grid.
    steps : ndarray, shape (d,)
        Its steps.
    keep, fine : int
        How many of the best go on to the next scan or grid, and how many points a scan has.
    progress : callable
        Called with the share done.
    """
    seen = legal(starts)
    costs = candidates.costs(seen)
    levels = max(int(np.ceil(np.log(steps[0] / FINEST) / np.log(WIDTH))), 1)
    for number, direction in enumerate(SCANS):
        centres = _best(seen, costs, steps, keep)
        reach = seen[:, 0].max() if number == 0 else 3.0 * steps[0]
        line = np.linspace(-reach, reach, fine)[:, None] * np.array(direction)
        seen = legal(np.concatenate([centres, *(centre + line for centre in centres)]))
        costs = candidates.costs(seen)
        progress(0.5 * (number + 1) / len(SCANS))
    steps = np.full(2, 0.3 * steps[0])
    square = np.arange(-WIDTH, WIDTH + 1) / WIDTH
    offsets = np.stack(np.meshgrid(square, square), axis=-1).reshape(-1, 2)
    for level in range(levels):
        centres = _best(seen, costs, steps, keep if level < 3 else 1)
        around = np.concatenate([centre + offsets * steps for centre in centres])
        around = legal(np.concatenate([centres, around]))
        seen, costs = around, candidates.costs(around)
        steps = steps / WIDTH
        progress(0.5 + 0.5 * (level + 1) / levels)
    return _leftmost(candidates, _best(seen, costs, steps, 1)[0])


def descend(
    candidates: Candidates,
    starts: Array,
    most: int,
    evaluations: int,
    progress: Callable[[float], object],
) -> Array:
    """Return the best point that Nelder-Mead's simplices find.

    They go down from the best start of each stem speed (third coordinate), `most` of them at
    most, and take up to `evaluations` each; other parameters and result are those of `narrow`.
    """
    starts = legal(starts)
    costs = candidates.costs(starts, 100.0 * SLACK)
    speeds = np.unique(starts[:, 2])
    bests = [np.flatnonzero(starts[:, 2] == speed) for speed in speeds]
    chosen = sorted((each[np.argmin(costs[each])] for each in bests), key=lambda i: costs[i])
    best, least = starts[chosen[0]], np.inf
    for number, index in enumerate(chosen[:most]):
        found = minimize(
            lambda point: float(candidates.costs(legal(point[None]), ALL)[0]),
            starts[index],
            method='Nelder-Mead',
            options={
                'initial_simplex': np.vstack([starts[index], starts[index] + np.diag(SIMPLEX)]),
                'maxfev': evaluations,
                'xatol': 1e-3,
                'fatol': 1e-6,
            },
        )
        if found.fun < least:
            best, least = legal(found.x[None])[0], found.fun
        progress((number + 1) / min(most, len(chosen)))
    return best


def ordered(points: Array, costs: Array) -> npt.NDArray[np.intp]:
    """Return the order from the best: equal costs by the smaller f_s, then the smaller jump."""
    scale = SAME * (1.0 + float(np.min(costs)))
    return np.lexsort((points[:, 0] - points[:, 1], points[:, 0], np.round(costs / scale)))


def _best(points: Array, costs: Array, steps: Array, keep: int) -> Array:
    """Return the best points that are not neighbours of a better one."""
    ranked = points[ordered(points, costs)]
    ranked = ranked[: np.count_nonzero(np.isfinite(costs))]
    chosen: list[Array] = []
    while len(chosen) < keep and len(ranked):
        chosen.append(ranked[0])
        ranked = ranked[(np.abs(ranked - ranked[0]) > 1.5 * steps).any(axis=1)]
    return np.array(chosen)


def _leftmost(candidates: Candidates, point: Array) -> Array:
    """Return the point with the smallest f_s of the same cost: without a jump if it can."""
    low, high = point.copy(), point.copy()
    low[0] = abs(point[1])
    best = float(candidates.costs(point[None], ALL)[0])
    enough = best * (1.0 + SAME) + SAME

    def as_good(trial: Array) -> bool:
        return bool(candidates.costs(trial[None], ALL)[0] <= enough)

    if as_good(low):
        return low
    while high[0] - low[0] > FINEST:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if as_good(middle) else (middle, high)
    return high
