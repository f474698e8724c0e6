# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What it takes to declare a parameter or an option of the model, once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
import math
from numbers import Real
from typing import Any, Literal

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


@dataclass(frozen=True)
class EffectParameter(Parameter):
    """A parameter of an effect; the effect is absent while all have their neutral value.

    `stage` says where this parameter acts if that differs from the effect's own stage; `starts`
    are the values from which a search has to start where one start is not enough, and `step` its
    first step where costs are so narrow that the usual one would jump over them. `usual` is how
    far from neutral it usually lies, `positive` whether it never lies below: they decide where
    data cannot. `shown` names what of the data shows where to start, if anything does: 'swings',
    the frequencies at which the residual swings most, 'steps' and 'offsets' of grids to which x
    keeps, or 'zeros' and 'spans' with which the same holds the stem everywhere.
    """

    neutral: float = 0.0
    stage: str = ''
    starts: tuple[float, ...] = ()
    step: float = 0.0
    usual: tuple[float, ...] = ()
    positive: bool = False
    shown: Literal['', 'swings', 'steps', 'offsets', 'zeros', 'spans'] = ''

    def __post_init__(self) -> None:
        """Refuse a neutral value that is not legal."""
        super().__post_init__()
        self.checked(self.neutral)


def upstream(start: float) -> EffectParameter:
    """Return the parameter that says on which side of the play a fault of the converter acts.

    Parameters
    ----------
    start : float
        Where a search starts.
    """
    text = 'Share of it before the backlash'
    return EffectParameter('upstream', 'w', '-', 0.0, 0.0, 1.0, 'linear', text, starts=(start,))


@dataclass(frozen=True)
class Effect:
    """A physical effect that the base valve lacks.

    Attributes
    ----------
    id : str
        Public name, as in the catalogue.
    title : str
        Plain name for reports.
    stage : {'u-p1', 'p1-p2', 'p2-x', 'sensor'}
        Where in the flow it acts.
    parameters : tuple of EffectParameter
        Names without the id; elsewhere they are called ``id.name``.
    slots : mapping of str to numba function
        Which slots of the pipeline it fills, `f(value, state, p, memory, dt) -> value` with its
        own parameters as the tuple p and its own part of the memory.
    explanation, symptom, confirm : str
        What it is, what it does to the signals, and the test or topic that proves it.
    memory : int
        Numbers it must remember from sample to sample; NaN at first, and when newly switched on.
    longest_step : float
        Longest step inside a sample for which its form is accurate [s].
    stride : float
        The same while the stem moves [s].
    order : int
        Place along the signal path among the effects of one slot.
    laborious : bool
        A run with it takes many times as long: a search tries others first.
    light : tuple of str
        Parameters with which alone a run of a laborious effect takes no longer than others.
    feedback : bool
        The stem acts back through it on the stages before.
    rugged : bool
        A fit of it has many valleys: a search follows each of its starts further.
    imitated : str
        Nearly the same as what a base valve does whose 'friction' hardly drops, or whose 'stem' is
        slow: a search looks for it even where that leaves nothing but noise; for a laborious one
        only where it is such a valve.
    twins : mapping of str to str
        Effects that look alike, each with what tells them apart.
    variants : tuple of tuple of str
        Alternative sets of parameters for a search to free; one set with all by default.
    balance : callable, optional
        Of a level of f_s and its own parameters: the f_s with which it holds the stem about as
        that level does without the effect. Searches start there too.
    references : tuple of str
        Where the physics comes from.
    """

    id: str
    title: str
    stage: Literal['u-p1', 'p1-p2', 'p2-x', 'sensor']
    parameters: tuple[EffectParameter, ...]
    slots: Mapping[str, Any]
    explanation: str
    symptom: str
    confirm: str
    memory: int = 0
    longest_step: float = math.inf
    stride: float = math.inf
    order: int = 0
    laborious: bool = False
    light: tuple[str, ...] = ()
    feedback: bool = False
    rugged: bool = False
    imitated: Literal['', 'friction', 'stem'] = ''
    twins: Mapping[str, str] = field(default_factory=dict)
    variants: tuple[tuple[str, ...], ...] = ()
    balance: Callable[..., float] | None = None
    references: tuple[str, ...] = ()

    @property
    def qualified(self) -> tuple[EffectParameter, ...]:
        """The parameters under their full names, ``id.name``."""
        return tuple(replace(p, name=f'{self.id}.{p.name}') for p in self.parameters)
