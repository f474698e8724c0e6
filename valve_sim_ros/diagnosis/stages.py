# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groups of stages between measured signals, and the effects that may act in each."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
import math

from ..model.declarations import EffectParameter
from ..model.effects import CATALOGUE
from .starts import Starts
from .unknowns import (
    BASE_UNKNOWNS,
    declared,
    of_effect,
    PHASE,
    QUICKEST_BEHIND_LAGS,
    start_of,
    Unknown,
)

STAGE_OF = {'p1': 'u-p1', 'p2': 'p1-p2', 'x': 'p2-x'}


@dataclass(frozen=True)
class Candidate:
    """One way in which one effect may act: the parameters that a fit frees."""

    effect: str
    names: tuple[str, ...]
    stage: str

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Coordinates of the parameters that a fit frees."""
        return tuple(of_effect(self.effect, name) for name in self.names)

    @property
    def neutral(self) -> dict[str, float]:
        """All parameters of the effect at their neutral values."""
        return {f'{self.effect}.{p.name}': p.neutral for p in CATALOGUE[self.effect].parameters}

    @property
    def laborious(self) -> bool:
        """Tell whether a run with it takes many times as long as others."""
        effect = CATALOGUE[self.effect]
        return effect.laborious and not {*self.names} <= {*effect.light}

    @property
    def tier(self) -> int:
        """How late it is tried: a search for one takes many times as long as for another."""
        declared = CATALOGUE[self.effect]
        if self.laborious or declared.rugged:
            return 2
        return 1 if declared.imitated else 0

    def extends(self, others: Iterable['Candidate']) -> bool:
        """Tell whether it is the law of one of the others with more parameters."""
        same = [each for each in others if each.effect == self.effect]
        return any({*each.names} < {*self.names} for each in same)

    @property
    def places(self) -> int:
        """Number of places in which a search looks for it."""
        return math.prod(len(starts_of(declared(self.effect, name))) for name in self.names)

    def starts(self, seen: Mapping[str, tuple[float, ...]]) -> Starts:
        """Return the values from which a search starts, the others neutral.

        Parameters that the data show directly start as `seen` there.
        """
        parameters = [declared(self.effect, name) for name in self.names]
        each = [seen.get(p.shown) or starts_of(p) for p in parameters]
        names = [f'{self.effect}.{name}' for name in self.names]
        return [
            {**self.neutral, **dict(zip(names, values, strict=True))} for values in product(*each)
        ]

    def suited(self, starts: Iterable[Mapping[str, float]]) -> Starts:
        """Return the starts of the effect in which what a fit does not free is neutral."""
        fixed = {f'{self.effect}.{name}' for name in self.names} ^ {*self.neutral}
        return [
            {**self.neutral, **start}
            for start in starts
            if all(start.get(name, self.neutral[name]) == self.neutral[name] for name in fixed)
        ]

    def balanced(
        self, level: float, values: Mapping[str, float], start: Mapping[str, float]
    ) -> Starts:
        """Return frictions with which a start holds the stem as a level [%] does without it.

        The stem moves, or it slips, as it does with `values`; none if that is not declared.
        """
        effect = CATALOGUE[self.effect]
        if effect.balance is None:
            return []
        f_s = effect.balance(level, *(start[f'{self.effect}.{p.name}'] for p in effect.parameters))
        share = values['f_d/f_s']
        moves, slips = values['f_s'] * share / f_s, 1.0 - values['f_s'] * (1.0 - share) / f_s
        return [{'f_s': f_s, 'f_d/f_s': min(max(part, 0.0), 1.0)} for part in (moves, slips)]

    def let_go(self, values: Mapping[str, float]) -> Starts:
        """Return values without the effect: as they are, and with what holds the stem with it.

        The stem moves as it did; the latter only where `balance` is declared.
        """
        effect, plain = CATALOGUE[self.effect], {**values, **self.neutral}
        if effect.balance is None:
            return [plain]
        f_s = values['f_s']
        share = effect.balance(f_s, *(values[f'{effect.id}.{p.name}'] for p in effect.parameters))
        held = f_s * f_s / share
        return [plain, {**plain, 'f_s': held, 'f_d/f_s': values['f_d/f_s'] * f_s / held}]


def starts_of(parameter: EffectParameter) -> tuple[float, ...]:
    """Return the declared starts, or some around the default on both sides of the neutral."""
    if parameter.starts:
        return parameter.starts
    neutral, default = parameter.neutral, parameter.default
    if parameter.scale == 'log':
        return tuple(
            value
            for value in (default / 4, default, 4 * default)
            if parameter.lower <= value <= parameter.upper
        )
    size = abs(default - neutral) or 0.2 * (parameter.upper - neutral)
    found = [neutral + share * size for share in (0.2, 0.6, 1.5)]
    found += [neutral - share * size for share in (0.2, 0.6, 1.5)]
    return tuple(v for v in found if parameter.lower <= v <= parameter.upper)


@dataclass(frozen=True)
class Group:
    """The stages that lead from one measured signal, or u, to the next."""

    signal: str
    stages: tuple[str, ...]
    drive: tuple[str, ...]

    @property
    def has_stem(self) -> bool:
        """Whether the stem is in it: its slips make costs rugged."""
        return 'p2-x' in self.stages

    def unknowns(self, stretches: int, phase: Unknown = PHASE) -> tuple[Unknown, ...]:
        """Return what a fit of the base valve varies here."""
        base = [unknown for stage in self.stages for unknown in BASE_UNKNOWNS[stage]]
        if len(self.stages) > 1:
            slower = {'a_1/a_2': QUICKEST_BEHIND_LAGS}
            base = [replace(each, upper=slower.get(each.name, each.upper)) for each in base]
        # p1 alone shows only whether a command came before the sample
        if self.stages != ('p2-x',) and not (self.stages == ('u-p1',) and phase.lower < 0.0):
            base.append(phase)
        hidden = [
            name
            for name, stage in STAGE_OF.items()
            if stage in self.stages and name != self.signal
        ]
        starts = [
            start_of(f'{name}_0' + (f'.{index}' if index else ''))
            for index in range(min(stretches, 3))
            for name in hidden
        ]
        return (*base, *starts)

    @property
    def acting(self) -> tuple[str, ...]:
        """The stages whose effects change this signal first."""
        return (*self.stages, 'sensor') if self.signal == 'x' else self.stages

    def unknowns_of(self, candidates: Iterable[Candidate]) -> tuple[Unknown, ...]:
        """Return what a fit varies of added effects here: those of other groups stay as found."""
        acting = [each for each in candidates if each.stage in self.acting]
        return tuple(unknown for each in acting for unknown in each.unknowns)

    def candidates(self, without: Iterable[str] = ()) -> list[Candidate]:
        """Return the candidates that act in these stages."""
        found = []
        for effect in CATALOGUE.values():
            if effect.id in without:
                continue
            for names in effect.variants or (tuple(p.name for p in effect.parameters),):
                stage = declared(effect.id, names[0]).stage or effect.stage
                if stage in self.acting:
                    found.append(Candidate(effect.id, names, stage))
        return found


def groups(signals: Sequence[str]) -> list[Group]:
    """Return the groups for the measured signals, in the order of the flow."""
    found: list[Group] = []
    pending: list[str] = []
    seen: list[str] = []
    for name, stage in STAGE_OF.items():
        pending.append(stage)
        if name in signals:
            found.append(Group(name, tuple(pending), tuple(seen)))
            pending = []
            seen = [*seen, name]
    return found
