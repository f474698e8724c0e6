# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A valve as a set of checked numbers: what files, ROS parameters and searches agree on."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
import difflib
from typing import Any

import numpy as np

from .composition import compose, Composition
from .declarations import Option, Parameter
from .effects import CATALOGUE
from .errors import ModelError
from .parameters import BASE, BRANCH
from .pipeline import Array
from .rivals import RIVALS

BASE_MODEL = 'base'
MODEL = Option(
    'model',
    BASE_MODEL,
    (BASE_MODEL, *RIVALS),
    'Which valve model: base is the semi-physical one, the others are the models it is compared '
    'with',
)
EFFECTS = 'effects'
"""Name of the list of effects in files and ROS parameters."""


@dataclass(frozen=True)
class ValveSpec:
    """Checked parameters and options of one valve.

    Attributes
    ----------
    values : mapping of str to float
        One value for each of `parameters`; those not given take their default.
    branch : {'zoh', 'printed'}
        Form of the condition in eq. (5).
    model : str
        'base', or the name of a rival model.
    effects : tuple of str
        Ids of the effects added to the base model, `effects.CATALOGUE`.

    Raises
    ------
    ModelError
        If a name is unknown, a value ill-typed, not finite or out of range, or f_d > f_s.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    branch: str = BRANCH.default
    model: str = BASE_MODEL
    effects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Fill in defaults and refuse what does not fit."""
        object.__setattr__(self, 'branch', BRANCH.checked(self.branch))
        object.__setattr__(self, 'model', MODEL.checked(self.model))
        object.__setattr__(self, 'effects', self._checked_effects(self.effects))
        declared = {parameter.name: parameter for parameter in self.parameters}
        for name in self.values:
            if name not in declared:
                raise ModelError(self._unknown(name, declared))
        checked = {
            name: parameter.checked(self.values.get(name, parameter.default))
            for name, parameter in declared.items()
        }
        if checked.get('f_d', -np.inf) > checked.get('f_s', np.inf):
            raise ModelError(
                f'f_d = {checked["f_d"]:g} % exceeds f_s = {checked["f_s"]:g} %: dynamic friction '
                'cannot be above static friction; lower f_d or raise f_s, both in one change'
            )
        object.__setattr__(self, 'values', checked)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The declared parameters of this model with these effects, in order."""
        if self.model != BASE_MODEL:
            return tuple(RIVALS[self.model].parameters)
        return (*BASE, *(p for name in self.effects for p in CATALOGUE[name].qualified))

    def changed(self, changes: Mapping[str, Any]) -> 'ValveSpec':
        """Return this valve with some values or options replaced, checked as a whole.

        Values of effects that are no longer listed, or of another model, are dropped.
        """
        values = dict(changes)
        options = {
            'branch': values.pop(BRANCH.name, self.branch),
            'model': values.pop(MODEL.name, self.model),
            'effects': self._checked_effects(values.pop(EFFECTS, self.effects)),
        }
        if options['model'] != self.model:
            kept = {}
        elif options['effects'] == self.effects:
            kept = dict(self.values)
        else:
            known = {p.name for p in ValveSpec(**options).parameters}
            kept = {name: value for name, value in self.values.items() if name in known}
        return replace(self, values={**kept, **values}, **options)

    @property
    def theta(self) -> Array:
        """The parameters as the compiled code receives them."""
        if self.model != BASE_MODEL:
            return np.array([self.values[parameter.name] for parameter in self.parameters])
        values = [self.values[parameter.name] for parameter in BASE]
        return np.array([*values, float(self.branch == 'printed')])

    @property
    def active(self) -> tuple[str, ...]:
        """The effects that are not at their neutral values."""
        return tuple(
            name
            for name in self.effects
            if any(
                self.values[f'{name}.{parameter.name}'] != parameter.neutral
                for parameter in CATALOGUE[name].parameters
            )
        )

    @property
    def composition(self) -> Composition:
        """The active effects as the compiled code receives them."""
        return compose(self.active, self.values)

    def _checked_effects(self, effects: Iterable[str]) -> tuple[str, ...]:
        """Return the effects without repetitions, or refuse what is not in the catalogue."""
        if isinstance(effects, str) or not all(isinstance(name, str) for name in effects):
            raise ModelError(f'effects = {effects!r}: expected a list such as [air_leak]')
        names = tuple(dict.fromkeys(name for name in effects if name))
        for name in names:
            if name not in CATALOGUE:
                raise ModelError(f'unknown effect {name!r}: {_hint(name, CATALOGUE)}')
        if names and self.model != BASE_MODEL:
            raise ModelError(
                f'effects = {list(names)}: they belong to model base; {self.model} takes none'
            )
        return names

    def _unknown(self, name: str, declared: Iterable[str]) -> str:
        """Say what is wrong with an unknown parameter, and what to write instead."""
        effect = name.partition('.')[0]
        if effect in CATALOGUE and effect not in self.effects:
            return f'{name} given, but {effect} is not among the effects: add effects: [{effect}]'
        return f'unknown parameter {name!r}: {_hint(name, declared)}'


def _hint(name: str, known: Iterable[str]) -> str:
    """Return the closest known name, or all of them."""
    close = difflib.get_close_matches(name, list(known), 1)
    return f'did you mean {close[0]}?' if close else f'known are {", ".join(known)}'
