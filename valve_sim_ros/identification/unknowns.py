# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a fit searches for, and how it walks: each unknown as a share from 0 to 1 of its range."""

from collections.abc import Mapping
from dataclasses import dataclass
import math

import numpy as np

from ..model.parameters import BASE
from ..model.pipeline import Array

DECLARED = {parameter.name: parameter for parameter in BASE}
A_1_HELD = DECLARED['a_1'].default
RATIO = 'a_1/a_2'
RATIO_BOUNDS = (0.05, 0.5 * math.sqrt(A_1_HELD))
"""a_1/a_2 [1/s], from a very slow stem to the critically damped one at the held a_1."""
A_1_BOUNDS = (1.0, 5e4)
"""a_1 [1/s^2] where it is searched too: a_2 stays legal over all of RATIO_BOUNDS."""
SOFTNESS = 5.0
"""Curvature of the scale of sizes that may be 0: linear near 0, logarithmic further up."""
FASTEST, SLOWEST = 0.05, 20.0
"""Time constants are searched from this share of the sample time to this multiple of the record:
beyond, the data look the same whatever the value."""


@dataclass(frozen=True)
class Unknown:
    """One unknown and its scale.

    Attributes
    ----------
    name : str
        Parameter, or 'a_1/a_2'.
    unit : str
        Of the value.
    lower, upper : float
        Range that is searched.
    scale : {'log', 'soft', 'linear', 'share'}
        How a share becomes a value; 'share' is a share of f_s, for f_d.
    """

    name: str
    unit: str
    lower: float
    upper: float
    scale: str

    def value(self, share: float) -> float:
        """Return the value at a share of the range."""
        if self.scale == 'log':
            return float(self.lower * (self.upper / self.lower) ** share)
        if self.scale == 'soft':
            share = math.expm1(SOFTNESS * share) / math.expm1(SOFTNESS)
        return float(self.lower + share * (self.upper - self.lower))

    def share(self, value: float) -> float:
        """Return the share at which `value` lies, 0 to 1."""
        value = min(max(value, self.lower), self.upper)
        if self.scale == 'log':
            return math.log(value / self.lower) / math.log(self.upper / self.lower)
        share = (value - self.lower) / (self.upper - self.lower)
        if self.scale == 'soft':
            share = math.log1p(share * math.expm1(SOFTNESS)) / SOFTNESS
        return share


@dataclass(frozen=True)
class Unknowns:
    """The unknowns of a valve: the base valve's in the order in which the stages see them."""

    each: tuple[Unknown, ...]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.each)

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(unknown.name for unknown in self.each)

    def index(self, name: str) -> int:
        """Return the place of an unknown."""
        return self.names.index(name)

    def values(self, point: Array) -> dict[str, float]:
        """Return the parameters at the shares in `point`, shape (at least len(self),)."""
        found = {
            unknown.name: unknown.value(float(share))
            for unknown, share in zip(self.each, point, strict=False)
        }
        found['f_d'] *= found['f_s']
        found.setdefault('a_1', A_1_HELD)
        found['a_2'] = found['a_1'] / found.pop(RATIO)
        return found

    def point(self, values: Mapping[str, float]) -> Array:
        """Return the shares of parameter values, clipped to the range; shape (len(self),).

        What is not given has its default.
        """
        known = {name: declared.default for name, declared in DECLARED.items()} | dict(values)
        known[RATIO] = values.get(RATIO, known['a_1'] / known['a_2'])
        known['f_d'] = known['f_d'] / known['f_s'] if known['f_s'] > 0.0 else 0.5
        return np.array([unknown.share(known[unknown.name]) for unknown in self.each])


def valve_unknowns(sample_time: float, duration: float, free_a_1: bool = False) -> Unknowns:
    """Return the unknowns of a valve for records of this sample time and length [s]."""
    fastest, slowest = FASTEST * sample_time, max(SLOWEST * duration, sample_time)
    each = []
    for name in ('f_d1', 'T_g1', 'T_g2', 'f_s'):
        declared = DECLARED[name]
        lower, upper = declared.lower, declared.upper
        if declared.scale == 'log':
            lower, upper = max(lower, fastest), min(upper, slowest)
        each.append(
            Unknown(name, declared.unit, lower, upper, declared.scale.replace('linear', 'soft'))
        )
    each.append(Unknown('f_d', DECLARED['f_d'].unit, 0.0, 1.0, 'linear'))
    each.append(Unknown(RATIO, '1/s', *RATIO_BOUNDS, 'log'))
    if free_a_1:
        declared = DECLARED['a_1']
        each.append(Unknown('a_1', declared.unit, *A_1_BOUNDS, 'log'))
    return Unknowns(tuple(each))
