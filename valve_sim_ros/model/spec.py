# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A valve as a set of checked numbers: what files, ROS parameters and searches agree on."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import difflib
from typing import Any

import numpy as np

from .errors import ModelError
from .parameters import BASE, BRANCH
from .pipeline import Array, PRINTED, THETA_SIZE

DEFAULTS = {parameter.name: parameter.default for parameter in BASE}


@dataclass(frozen=True)
class ValveSpec:
    """Checked parameters and options of one valve.

    Attributes
    ----------
    values : mapping of str to float
        One value for each of `parameters.BASE`; those not given take their default.
    branch : {'zoh', 'printed'}
        Form of the condition in eq. (5).

    Raises
    ------
    ModelError
        If a name is unknown, a value ill-typed, not finite or out of range, or f_d > f_s.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    branch: str = BRANCH.default

    def __post_init__(self) -> None:
        """Fill in defaults and refuse what does not fit."""
        unknown = [name for name in self.values if name not in DEFAULTS]
        if unknown:
            close = difflib.get_close_matches(unknown[0], DEFAULTS, 1)
            hint = f'did you mean {close[0]}?' if close else f'known are {", ".join(DEFAULTS)}'
            raise ModelError(f'unknown parameter {unknown[0]!r}: {hint}')
        checked = {
            parameter.name: parameter.checked(self.values.get(parameter.name, parameter.default))
            for parameter in BASE
        }
        if checked['f_d'] > checked['f_s']:
            raise ModelError(
                f'f_d = {checked["f_d"]:g} % exceeds f_s = {checked["f_s"]:g} %: dynamic friction '
                'cannot be above static friction; lower f_d or raise f_s, both in one change'
            )
        object.__setattr__(self, 'values', checked)
        object.__setattr__(self, 'branch', BRANCH.checked(self.branch))

    def changed(self, changes: Mapping[str, Any]) -> 'ValveSpec':
        """Return this valve with some values or the branch replaced, checked as a whole."""
        values = dict(changes)
        branch = values.pop(BRANCH.name, self.branch)
        return replace(self, values={**self.values, **values}, branch=branch)

    @property
    def theta(self) -> Array:
        """The parameters as the compiled code receives them, shape (THETA_SIZE,)."""
        theta = np.empty(THETA_SIZE)
        theta[:PRINTED] = [self.values[parameter.name] for parameter in BASE]
        theta[PRINTED] = float(self.branch == 'printed')
        return theta
