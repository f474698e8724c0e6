# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a fit may vary: the base valve's unknowns, nuisances, and parameters of effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Literal

import numpy as np

from ..model.declarations import EffectParameter
from ..model.effects import CATALOGUE
from ..model.parameters import BASE, DELTA
from ..model.pipeline import Array

DECLARED = {parameter.name: parameter for parameter in BASE}


@dataclass(frozen=True)
class Unknown:
    """One coordinate of a fit: its range, how it is walked, and the first step of a search."""

    name: str
    lower: float
    upper: float
    scale: Literal['linear', 'log']
    step: float

    def inward(self, value: float) -> float:
        """Return the coordinate of a value."""
        value = min(max(value, self.lower), self.upper)
        return math.log(value) / self.step if self.scale == 'log' else value / self.step

    def outward(self, coordinate: float) -> float:
        """Return the value at a coordinate, inside the range."""
        if self.scale == 'log':
            low, high = math.log(self.lower), math.log(self.upper)
            return math.exp(min(max(coordinate * self.step, low), high))
        return min(max(coordinate * self.step, self.lower), self.upper)


def _log(name: str, lower: float, upper: float, step: float = 0.05) -> Unknown:
    return Unknown(name, lower, upper, 'log', step)


SLOWEST = 2.0
"""A stem that lags by more than half a second is called a lag of its sensor, or of the converter:
real ones, and that of the paper, are quicker (a_1/a_2 = 2.9 and 12.2 1/s) [1/s]."""
QUICKEST, QUICKEST_BEHIND_LAGS = 200.0, 80.0
"""Stems are no quicker, nor sought quicker where lags are sought with them [1/s]."""

BASE_UNKNOWNS: dict[str, tuple[Unknown, ...]] = {
    'u-p1': (Unknown('f_d1', 0.0, DECLARED['f_d1'].upper, 'linear', 0.05),),
    'p1-p2': (_log('T_g1', 0.02, 300.0), _log('T_g2', 0.02, 300.0)),
    'p2-x': (
        _log('f_s', 0.01, DECLARED['f_s'].upper),
        Unknown('f_d/f_s', 0.0, 1.0, 'linear', 0.03),
        _log('a_1/a_2', SLOWEST, QUICKEST, 0.1),
        _log('damping', 0.1, 5.0, 0.1),
    ),
}
"""The base valve's unknowns by stage; `damping` is a_2 / (2 sqrt(a_1))."""
PHASE = Unknown('phase', -1.0, 0.999, 'linear', 0.1)
"""Share of a sample period by which a command acts before the sample that shows it."""
EARLY = Unknown('phase', 0.0, 0.999, 'linear', 0.1)
LATE = Unknown('phase', -1.0, -0.001, 'linear', 0.1)
BLEND = Unknown('blend', -0.999, 0.999, 'linear', 0.1)
"""Share of a period by which a command that goes on and on reaches p1 late; negative: sooner."""
LEAD = Unknown('lead', 0.0, 0.999, 'linear', 0.1)
"""Share of a period by which its changes come sooner than steps: it goes on between samples."""
STANDSTILL = _log(DELTA.name, DELTA.default, 0.15, 0.3)
"""Speed below which the stem stops, far more in some valves than is printed in eq. (9) [%/s]."""


def start_of(name: str) -> Unknown:
    """Return the unknown starting value of a signal."""
    return Unknown(name, -50.0, 150.0, 'linear', 0.1)


def of_effect(effect: str, name: str) -> Unknown:
    """Return the coordinate of an effect's parameter."""
    parameter = declared(effect, name)
    if parameter.step:
        return Unknown(
            f'{effect}.{name}', parameter.lower, parameter.upper, 'linear', parameter.step
        )
    if parameter.scale == 'log':
        return Unknown(f'{effect}.{name}', parameter.lower, parameter.upper, 'log', 0.05)
    step = 0.08 * max(abs(parameter.default - parameter.neutral), 0.03 * parameter.upper)
    return Unknown(f'{effect}.{name}', parameter.lower, parameter.upper, 'linear', step)


def declared(effect: str, name: str) -> EffectParameter:
    """Return the declaration of an effect's parameter."""
    return next(p for p in CATALOGUE[effect].parameters if p.name == name)


def complete(values: Mapping[str, float]) -> dict[str, float]:
    """Return values with f_d, a_1 and a_2 worked out from what the fits vary."""
    ratio = values['a_1/a_2']
    a_1 = (2.0 * values['damping'] * ratio) ** 2
    return {
        DELTA.name: DELTA.default,
        **values,
        'f_d': values['f_s'] * values['f_d/f_s'],
        'a_1': a_1,
        'a_2': a_1 / ratio,
    }


def to_values(
    unknowns: Sequence[Unknown], point: Array, values: Mapping[str, float]
) -> dict[str, float]:
    """Return `values` with those of the point."""
    moved = {u.name: u.outward(float(c)) for u, c in zip(unknowns, point, strict=True)}
    return {**values, **moved}


def to_point(unknowns: Sequence[Unknown], values: Mapping[str, float]) -> Array:
    """Return the point at which the unknowns have these values."""
    return np.array([unknown.inward(values[unknown.name]) for unknown in unknowns])
