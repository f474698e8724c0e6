# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What it takes to declare a parameter or an option of the model, once."""

from dataclasses import dataclass
import math
from numbers import Real
from typing import Literal

from .errors import ModelError


@dataclass(frozen=True)
class Parameter:
    """One number of the model; ROS descriptors, YAML, search bounds and tables derive from it.

    Attributes
    ----------
    name : str
        Name in YAML files, ROS parameters and results.
    symbol : str
        Symbol as printed in the source, for tables and reports.
    unit : str
        Unit of the value; ``%`` is per cent of span.
    default, lower, upper : float
        Value used when none is given and the closed range of legal values, in `unit`.
    scale : {'linear', 'log'}
        How a search should walk the range.
    description : str
        One plain sentence for descriptors and tables.
    """

    name: str
    symbol: str
    unit: str
    default: float
    lower: float
    upper: float
    scale: Literal['linear', 'log']
    description: str

    def __post_init__(self) -> None:
        """Refuse a declaration that contradicts itself."""
        if not self.lower <= self.default <= self.upper or not math.isfinite(
            self.upper - self.lower
        ):
            raise ModelError(
                f'{self.name}: default {self.default} lies outside [{self.lower}, {self.upper}]'
            )
        if self.scale == 'log' and self.lower <= 0:
            raise ModelError(f'{self.name}: a logarithmic scale needs a lower bound above 0')

    def checked(self, value: object) -> float:
        """Return `value` as a float, or raise a sentence.

        Parameters
        ----------
        value : object
            Candidate value in `unit`.

        Returns
        -------
        float

        Raises
        ------
        ModelError
            If the value is no number, not finite, or outside the declared range.
        """
        if isinstance(value, bool) or not isinstance(value, Real):
            raise ModelError(
                f'{self.name} = {value!r}: expected a number in {self.unit}; '
                f'write for example {self.name}: {self.default}'
            )
        number = float(value)
        if not math.isfinite(number):
            raise ModelError(
                f'{self.name} = {number}: expected a finite number between '
                f'{self.lower:g} and {self.upper:g} {self.unit}'
            )
        if not self.lower <= number <= self.upper:
            raise ModelError(
                f'{self.name} = {number:g} {self.unit}: expected a value between '
                f'{self.lower:g} and {self.upper:g} {self.unit}'
            )
        return number


@dataclass(frozen=True)
class Option:
    """One choice by name, e.g. which form of an equation is used."""

    name: str
    default: str
    choices: tuple[str, ...]
    description: str

    def checked(self, value: object) -> str:
        """Return `value` if it is one of the choices, else raise a ModelError."""
        if value not in self.choices:
            raise ModelError(f'{self.name} = {value!r}: expected one of {", ".join(self.choices)}')
        return str(value)
