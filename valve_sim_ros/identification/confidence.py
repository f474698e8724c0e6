# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How sure the levels of a fitted rival are: how far each can go without a worse fit."""

import numpy as np

from ..model.pipeline import Array
from .candidates import Candidates, legal, SAME
from .result import Identification
from .uncertainty import Estimate, IDENTIFIED, SMALL, WEAK

REACHES = (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8, 25.6, 51.2)
"""Distances tried from the optimum [% of span; for ln a_2 a twentieth of it]."""
DIRECTIONS = ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0))
CHI_SQUARED = 3.84
"""95 % point for one degree of freedom."""
LEAST_NOISE = 0.02
"""Noise of x that is assumed at least [% of span]."""


def estimates_of(
    candidates: Candidates, point: Array, outputs: list[Array], base: Identification | None
) -> dict[str, Estimate]:
    """Return value, half-width of the 95 % region and verdict of each parameter.

    The region is that of the likelihood, scaled by the residual variance and by the correlation
    of neighbouring residuals, and looked for along the axes and diagonals of (f_s, f_d).
    """
    region = _region(candidates, point, outputs)
    values, centre = candidates.values(region), candidates.values(point[None])
    searched = set(candidates.model.from_friction(8.0, 4.0))
    searched |= {'a_2'} if point.size == 3 else set()
    estimates = {}
    for parameter in candidates.model.parameters:
        name, value = parameter.name, float(centre[parameter.name][0])
        if name in searched:
            low, high = float(values[name].min()), float(values[name].max())
            half = max(value - low, high - value)
            words = _verdict(parameter.unit, value, low, high)
            estimates[name] = Estimate(value, half, words, low, high, unit=parameter.unit)
        elif base is not None and name in base.estimates and name not in candidates.model.held:
            estimates[name] = base.estimates[name]
        else:
            words = 'held at its default: data of this kind cannot tell it'
            estimates[name] = Estimate(value, float('inf'), words, unit=parameter.unit)
    return estimates


def _region(candidates: Candidates, point: Array, outputs: list[Array]) -> Array:
    """Return the tried points that fit as well as the optimum, itself among them."""
    errors = np.concatenate(
        [
            (output[2] - run.x)[run.counts]
            for output, run in zip(outputs, candidates.runs, strict=True)
        ]
    )
    variance = max(float(np.mean(errors**2)), LEAST_NOISE**2)
    lag = float(np.corrcoef(errors[1:], errors[:-1])[0, 1]) if errors.std() > 0.0 else 0.0
    lag = min(max(lag, 0.0), 0.99)
    margin = CHI_SQUARED * variance * (1.0 + lag) / (1.0 - lag)
    steps = [
        sign * reach * np.array([*direction, 0.0][: point.size])
        for direction in DIRECTIONS
        for reach in REACHES
        for sign in (1.0, -1.0)
    ]
    if point.size == 3:
        steps += [np.array([0.0, 0.0, s * r / 20.0]) for r in REACHES for s in (1.0, -1.0)]
    tried = np.concatenate([point[None], legal(point + np.array(steps))])
    best = float(np.sum(errors**2))
    costs = candidates.costs(tried, 1.0 + (margin + SAME) / max(best, SAME))
    region: Array = tried[costs <= costs[0] + margin]
    return region


def _verdict(unit: str, value: float, low: float, high: float) -> str:
    """Say in words how well one value is known."""
    half = max(value - low, high - value)
    relative = half / abs(value) if value else float('inf')
    if relative <= IDENTIFIED or (unit == '%' and half <= SMALL):
        return 'identified'
    if relative <= WEAK:
        return 'weakly identified'
    return f'not identified by this data: {low:.4g} to {high:.4g} fit as well'
