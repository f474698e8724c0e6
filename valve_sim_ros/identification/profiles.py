# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Profile likelihood: how the fit worsens if one parameter is held and the others make up."""

from dataclasses import dataclass

import numpy as np

from ..model.pipeline import Array
from .covariance import Covariance, LEAST_VARIANCE
from .descent import End
from .problem import Problem, STEP
from .search import polish
from .uncertainty import Estimate, parameter
from .unknowns import DECLARED
from .watch import Watch

CHI_SQUARED = 3.841459
"""95 % point for one degree of freedom."""
STRIDE = 0.5
"""Standard errors from one point of the profile to the next, growing by `GROWTH`."""
GROWTH = 1.35
MOST_POINTS = 16
STAGES = ((4, 1e-3), (1, STEP))
"""Width of the blur and step of the derivatives of each descent."""
STEEP, SHORTEST = 4.0, 0.1
BEYOND = 2.0
"""A profile ends where the rise is this multiple of the 95 % point."""


@dataclass(frozen=True)
class Profile:
    """The profile of one parameter.

    Attributes
    ----------
    name, unit : str
        Of the parameter.
    values : ndarray, shape (n,)
        Where it was held, rising.
    rise : ndarray, shape (n,)
        Twice the loss of log-likelihood there, corrected for the memory of the residuals; 3.84
        bounds the 95 % interval.
    lower, upper : float or None
        Ends of that interval; None where the data set no end.
    """

    name: str
    unit: str
    values: Array
    rise: Array
    lower: float | None
    upper: float | None

    def text(self) -> str:
        """Return the interval in words."""
        if self.lower is None and self.upper is None:
            return 'the data set no bound'
        if self.lower is None:
            return f'up to {self.upper:.4g} {self.unit}, no lower bound from the data'
        if self.upper is None:
            return f'from {self.lower:.4g} {self.unit}, no upper bound from the data'
        return f'{self.lower:.4g} to {self.upper:.4g} {self.unit}'


def profile(
    covariance: Covariance, name: str, estimate: Estimate, watch: Watch | None = None
) -> Profile:
    """Return the profile of an unknown, walking both ways from the optimum.

    Parameters
    ----------
    covariance : Covariance
        Of the problem in which a_1 is free.
    name : str
        The unknown.
    estimate : Estimate
        Its value and scatter, which sets the first stride.
    watch : Watch, optional
        Told of every simulation.
    """
    watch = watch or Watch()
    walker = _Walker(covariance, name, watch)
    start = covariance.problem.residuals(covariance.point)
    cost = float(start @ start)
    scale = max(cost / max(int(np.count_nonzero(start)), 1), LEAST_VARIANCE)
    scale *= covariance.inflation(parameter(name))
    sides = []
    for sign in (-1.0, 1.0):
        points = [(walker.centre, 0.0)]
        stride, free = STRIDE * walker.spread, covariance.point
        for _ in range(MOST_POINTS):
            if not 0.0 < points[-1][0] < walker.most:
                break
            place = min(max(points[-1][0] + sign * stride, 0.0), walker.most)
            end = walker.held(place, free + (place - points[-1][0]) * walker.ridge)
            rise = (end.cost - cost) / scale
            if rise > STEEP * CHI_SQUARED and stride > SHORTEST * walker.spread:
                # it may have lost the ridge: go on in shorter strides
                stride *= 0.3
                continue
            free = end.point
            points.append((place, rise))
            if rise > BEYOND * CHI_SQUARED:
                break
            stride *= GROWTH
        sides.append(points)
    return _joined(walker, name, estimate.unit, sides)


class _Walker:
    """Descends with one unknown held.

    The place of an unknown is its share; that of f_d, whose share is of f_s, is f_d itself.
    """

    def __init__(self, covariance: Covariance, name: str, watch: Watch) -> None:
        """Remember what is held."""
        self._problem, self._watch = covariance.problem, watch
        self._index = covariance.problem.unknowns.index(name)
        self._unknown = covariance.problem.unknowns.each[self._index]
        self.is_f_d = name == 'f_d'
        self.centre, self.most = float(covariance.point[self._index]), 1.0
        self.spread = float(np.sqrt(covariance.matrix[self._index, self._index]))
        if self.is_f_d:
            self.centre, self.spread = covariance.of(parameter(name))
            self.most = DECLARED[name].upper
            self.ridge = covariance.ridge(parameter(name))
        else:
            across = covariance.matrix[:, self._index]
            self.ridge = across / max(across[self._index], 1e-300)

    def value(self, place: float) -> float:
        """Return the parameter at a place."""
        return place if self.is_f_d else self._unknown.value(place)

    def held(self, place: float, start: Array) -> End:
        """Return the best point whose held unknown is at `place`, near `start`."""
        task = _Held(self._problem, self._index, place, start, self.is_f_d)
        end = polish(task, np.clip(start[task.others], 0.0, 1.0), self._watch, STAGES)
        return End(task.whole(end.point), end.residuals, end.cost)


class _Held:
    """A problem without one of its unknowns."""

    def __init__(
        self, problem: Problem, index: int, place: float, start: Array, is_f_d: bool
    ) -> None:
        """Hold unknown `index` at a place; `start` gives the length of a point."""
        self.blocks = problem.blocks
        self._problem, self._index, self._place = problem, index, place
        self._start, self._is_f_d = start, is_f_d
        self._static = problem.unknowns.index('f_s')
        self._f_s = problem.unknowns.each[self._static]
        self.others = np.arange(start.size) != index

    def whole(self, part: Array) -> Array:
        """Return the point of the whole problem."""
        point = self._start.copy()
        point[self.others] = part
        point[self._index] = self._place
        if self._is_f_d:
            # f_d is a share of f_s, which must not be below
            point[self._static] = max(point[self._static], self._f_s.share(self._place))
            point[self._index] = min(self._place / self._f_s.value(point[self._static]), 1.0)
        return point

    def residuals(self, point: Array) -> Array:
        """Return the residuals, shape (m,)."""
        return self._problem.residuals(self.whole(point))

    def jacobian(self, point: Array, base: Array | None, step: float) -> Array:
        """Return their derivatives, shape (m, size - 1)."""
        here = self.whole(point)
        jacobian = self._problem.jacobian(here, base, step)
        if self._is_f_d:
            # the share of f_d follows f_s
            moved = point.copy()
            moved[np.flatnonzero(self.others) == self._static] += STEP
            slope = (self.whole(moved) - here)[self._index] / STEP
            jacobian[:, self._static] += slope * jacobian[:, self._index]
        return jacobian[:, self.others]


def _joined(
    walker: _Walker, name: str, unit: str, sides: list[list[tuple[float, float]]]
) -> Profile:
    """Join both sides of a profile and find where it crosses the 95 % point."""
    ends: list[float | None] = []
    for points in sides:
        shares, rises = np.array(points).T
        above = np.flatnonzero(rises > CHI_SQUARED)
        if not above.size:
            ends.append(None)
            continue
        k = int(above[0])
        low, high = np.sqrt(np.maximum(rises[k - 1 : k + 1], 0.0))
        part = (np.sqrt(CHI_SQUARED) - low) / (high - low)
        ends.append(walker.value(float(shares[k - 1] + part * (shares[k] - shares[k - 1]))))
    points = sides[0][:0:-1] + sides[1]
    return Profile(
        name,
        unit,
        np.array([walker.value(place) for place, _ in points]),
        np.array([rise for _, rise in points]),
        ends[0],
        ends[1],
    )
