# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the fit holds on data that it has not seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

import numpy as np

from ..model.pipeline import Array
from ..model.spec import ValveSpec
from ..recordings.recording import OUTPUTS
from .choices import WAYS
from .errors import IdentificationError
from .fitness import fitness
from .problem import Problem
from .search import refit
from .stretches import Mask
from .uncertainty import Estimate
from .watch import Watch

THIRDS = {'first third': (0.0, 1.0 / 3.0), 'last third': (2.0 / 3.0, 1.0)}
MOST_BAGS = 8
WORSE = 1.5
"""Errors held out that are larger than fitted ones by this factor call for words,"""
LOSS = 2.0
"""if eta is lower by so many points too."""
APART = 4.0
"""Standard errors by which a parameter must move between parts of the data to be drifting."""
LEAST_DRIFT = 0.03
"""And the share of its value."""
MISFIT, CLEAR_DRIFT = 1.5, 0.1
"""Where residuals are larger than noise by this factor, this share of the value is enough."""


@dataclass(frozen=True)
class HoldOut:
    """A fit to part of the data, and how it does on the rest.

    Attributes
    ----------
    name : str
        What was held out.
    spec : ValveSpec
        The valve fitted to the rest.
    eta : mapping of str to mapping
        'fitted' and 'held_out' fitness of eq. (11) by signal [%].
    error_ratio : mapping of str to float
        By signal, the root mean square error held out over that on the fitted data.
    """

    name: str
    spec: ValveSpec
    eta: Mapping[str, Mapping[str, float]]
    error_ratio: Mapping[str, float]


def parts_of(problem: Problem, way: str) -> dict[str, list[Mask]]:
    """Return what is held out, by name: a mask by stretch.

    Parameters
    ----------
    problem : Problem
        The data.
    way : {'auto', 'time', 'bags', 'none'}
        The outer thirds of the time, each recording in turn, or nothing; 'auto' is by recording
        if there are several.
    """
    if way not in WAYS:
        raise IdentificationError(f'hold-out {way!r}: expected one of {", ".join(WAYS)}')
    bags = sorted({stretch.recording for stretch in problem.stretches})
    if way == 'bags' and len(bags) < 2:
        raise IdentificationError(
            'hold-out by bags needs at least two recordings: give more, or hold out by time'
        )
    if way == 'none':
        return {}
    if way == 'bags' or (way == 'auto' and len(bags) > 1):
        return {
            f'recording {bag + 1}': [
                np.full(stretch.u.size, stretch.recording == bag) for stretch in problem.stretches
            ]
            for bag in bags[:MOST_BAGS]
        }
    place = np.arange(sum(stretch.u.size for stretch in problem.stretches), dtype=float)
    place /= place.size
    ends = np.cumsum([stretch.u.size for stretch in problem.stretches])[:-1]
    return {
        name: np.split((place >= start) & (place < stop), ends)
        for name, (start, stop) in THIRDS.items()
    }


def hold_out(
    problem: Problem, point: Array, name: str, masks: Sequence[Mask], watch: Watch
) -> HoldOut:
    """Fit again without the samples in `masks`, starting from the fit to all."""
    rest = problem.withheld([~mask for mask in masks])
    found = refit(rest, point, watch).point
    # the data left do not see a start that is held out: it has to be given
    found = rest.with_starts(found, point, masks)
    outputs = rest.simulate(found)
    eta, errors = {}, {}
    for part, chosen in (('fitted', [~mask for mask in masks]), ('held_out', masks)):
        eta[part] = etas(problem, outputs, chosen)
        errors[part] = _errors(problem, outputs, chosen)
    ratio = {
        signal: errors['held_out'][signal] / max(errors['fitted'][signal], 1e-9)
        for signal in problem.signals
    }
    return HoldOut(name, rest.spec(found), eta, ratio)


def etas(
    problem: Problem, outputs: Sequence[Array], chosen: Sequence[Mask] | None = None
) -> dict[str, float]:
    """Return eta by signal over the samples chosen by masks, all by default."""
    return {name: fitness(*_pairs(problem, outputs, chosen, name)) for name in problem.signals}


def remarks(
    hold_outs: Sequence[HoldOut], estimates: Mapping[str, Estimate], misfit: float
) -> list[str]:
    """Say it if the fit does not hold on data it has not seen, and which way it fails.

    `misfit` is the root mean square of all residuals over the noise: 1 for the true model.
    """
    lines = []
    drifting = _drift(hold_outs, estimates, misfit)
    for each in hold_outs:
        worst = max(each.error_ratio, key=lambda name: _order(each.error_ratio[name]))
        ratio = each.error_ratio[worst]
        loss = each.eta['fitted'][worst] - each.eta['held_out'][worst]
        if not (ratio > WORSE and loss > LOSS):
            continue
        if drifting or misfit > MISFIT:
            words = 'the valve drifts or the model lacks something'
        else:
            words = 'over-fitted: too little or too different data for these parameters'
        lines.append(
            f'{each.name} held out: errors of {worst} are {ratio:.2g} times those of the fitted '
            f'part; {words}'
        )
    return lines + drifting


def _drift(
    hold_outs: Sequence[HoldOut], estimates: Mapping[str, Estimate], misfit: float
) -> list[str]:
    """Name the parameters that depend on which part of the data is held out."""
    lines = []
    for name, estimate in estimates.items():
        hidden = estimate.verdict.startswith('not')
        if hidden or len(hold_outs) < 2 or name not in hold_outs[0].spec.values:
            continue
        ordered = sorted(hold_outs, key=lambda each: each.spec.values[name])
        low, high = (each.spec.values[name] for each in (ordered[0], ordered[-1]))
        apart = (high - low) / abs(estimate.value) if estimate.value else 0.0
        clear = APART * estimate.standard_error / max(abs(estimate.value), 1e-12)
        # where nothing fits, the intervals are wide because of the drift itself
        if apart > max(clear, LEAST_DRIFT) or (misfit > MISFIT and apart > CLEAR_DRIFT):
            lines.append(
                f'{name} drifts: {low:.4g} {estimate.unit} without the {ordered[0].name}, '
                f'{high:.4g} {estimate.unit} without the {ordered[-1].name}'
            )
    return lines


def _errors(
    problem: Problem, outputs: Sequence[Array], chosen: Sequence[Mask]
) -> dict[str, float]:
    """Return the root mean square error by signal, NaN without samples."""
    result = {}
    for name in problem.signals:
        measured, fitted = _pairs(problem, outputs, chosen, name)
        squares = (measured - fitted)[np.isfinite(measured)] ** 2
        result[name] = math.sqrt(squares.mean()) if squares.size else math.nan
    return result


def _pairs(
    problem: Problem, outputs: Sequence[Array], chosen: Sequence[Mask] | None, name: str
) -> tuple[Array, Array]:
    """Return measured and fitted values of a signal; what is not chosen is NaN."""
    measured = [stretch.measured[name] for stretch in problem.stretches]
    if chosen is not None:
        measured = [
            np.where(mask, values, np.nan) for values, mask in zip(measured, chosen, strict=True)
        ]
    fitted = [output[OUTPUTS.index(name)] for output in outputs]
    return np.concatenate(measured), np.concatenate(fitted)


def _order(ratio: float) -> float:
    """Return a ratio for comparison: one that is not there comes last."""
    return ratio if math.isfinite(ratio) else -1.0
