# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How sure the fitted values are, and which of them the data cannot see."""

from dataclasses import dataclass

import numpy as np

from ..model.pipeline import Array
from .problem import A_1_HELD, Problem, UNKNOWNS

RATIO = UNKNOWNS.index('a_1/a_2')
IDENTIFIED, WEAK = 0.05, 0.30
"""Relative half-widths of the 95 % interval up to which a value counts as (weakly) identified."""
SMALL = 0.1
"""A friction or backlash known to so many per cent of span is identified, however small."""
PRIOR = 12.0
"""Information of knowing only the legal range: one over the variance of a uniform share."""


@dataclass(frozen=True)
class Estimate:
    """A fitted value with the half-width of its 95 % interval and a verdict in words."""

    value: float
    half_width: float
    verdict: str


def assess(problem: Problem, point: Array, jacobian: Array) -> dict[str, Estimate]:
    """Judge every parameter and the ratio a_1/a_2.

    The covariance is that of least squares, scaled by the residual variance and by the
    correlation of neighbouring residuals, plus the knowledge that values are in range.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    point : ndarray, shape (size,)
        The optimum.
    jacobian : ndarray, shape (m, size)
        Of the weighted residuals there.
    """
    residuals = problem.residuals(point)
    variance = max(float(np.mean(residuals**2)), 1e-12)
    lag = float(np.corrcoef(residuals[1:], residuals[:-1])[0, 1]) if residuals.std() > 0 else 0.0
    lag = min(max(lag, 0.0), 0.99)
    variance *= (1.0 + lag) / (1.0 - lag)
    information = jacobian.T @ jacobian / variance + PRIOR * np.eye(problem.size)
    covariance = np.linalg.inv(information)
    estimates = {}
    base = _physical(problem, point)
    step = 1e-6
    for index, name in enumerate(UNKNOWNS):
        gradient = np.array(
            [
                (_physical(problem, point + step * unit)[index] - base[index]) / step
                for unit in np.eye(problem.size)
            ]
        )
        half = 1.96 * float(np.sqrt(gradient @ covariance @ gradient))
        estimates[name] = Estimate(
            base[index], half, _verdict(name, base[index], half, float(point[index]))
        )
    static = estimates['f_s']
    if 'not identified' in static.verdict:
        # f_d is searched as a share of f_s: it cannot be known better than that
        half = max(estimates['f_d'].half_width, static.half_width)
        estimates['f_d'] = Estimate(estimates['f_d'].value, half, static.verdict)
    ratio = estimates['a_1/a_2']
    for name, value in (('a_1', A_1_HELD), ('a_2', A_1_HELD / base[RATIO])):
        estimates[name] = Estimate(
            value,
            float('inf'),
            f'not separately identifiable: a_1 is held at {A_1_HELD:g} 1/s^2, only '
            f'a_1/a_2 = {ratio.value:.3g} 1/s is fitted ({ratio.verdict})',
        )
    return estimates


def _physical(problem: Problem, point: Array) -> list[float]:
    """Return the unknowns in their units, in the order of `UNKNOWNS`."""
    values = problem.values(point)
    return [values[name] for name in UNKNOWNS[:RATIO]] + [values['a_1'] / values['a_2']]


def _verdict(name: str, value: float, half: float, share: float) -> str:
    """Say in words how well one value is known."""
    if (share < 1e-4 or share > 1.0 - 1e-4) and not (
        name in ('f_d1', 'f_s', 'f_d') and share < 0.5
    ):
        return 'at the bound of its range: not identified by this data, or the model does not fit'
    relative = half / value if value > 0.0 else float('inf')
    if relative <= IDENTIFIED or (name in ('f_d1', 'f_s', 'f_d') and half <= SMALL):
        return 'identified'
    if relative <= WEAK:
        return 'weakly identified'
    return 'not identified by this data'
