# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A result in words: the same lines on the console, in reports and in the head of fitted.yaml."""

from collections.abc import Mapping
import math
from typing import TYPE_CHECKING

from .uncertainty import Estimate

if TYPE_CHECKING:
    from .result import Identification


def lines(result: 'Identification') -> list[str]:
    """Return a result as lines of text."""
    text = []
    if result.partial:
        text.append('PARTIAL: stopped before the end; the best so far, intervals are rough')
    text.append(f'{"parameter":<9} {"value":>10} {"95 % interval":>21} unit   verdict')
    units = {parameter.name: parameter.unit for parameter in result.spec.parameters}
    for name, estimate in result.estimates.items():
        text.append(_row(name, estimate, units.get(name, '1/s')))
    combinations = result.assessment.combinations if result.assessment else {}
    shown = {name: each for name, each in combinations.items() if name not in result.estimates}
    if shown:
        text.append('known although the parts are not:')
        text += [_row(name, estimate, estimate.unit) for name, estimate in shown.items()]
    for profile in result.profiles:
        text.append(f'profile of {profile.name}: 95 %: {profile.text()}')
    text += eta_lines(result)
    return text + [f'NOTE: {remark}' for remark in result.remarks]


def eta_lines(result: 'Identification') -> list[str]:
    """Return fitness on all data, and fitted against held out side by side."""
    text = ['eta on all data: ' + percent(result.eta_by_signal)]
    text += [
        f'{name} held out: fitted {percent(etas["fitted"])} | held out {percent(etas["held_out"])}'
        for name, etas in result.eta_held_out.items()
    ]
    return text


def comments(result: 'Identification', date: str) -> list[str]:
    """Return the head of fitted.yaml: from what, by what, how well."""
    digests = [
        f'data: {path} sha256 {digest}'
        for recording in result.recordings
        for path, digest in recording.provenance.digests.items()
    ]
    ranges = [
        f'{name} {low:.4g} to {high:.4g}' + (' of f_s' if name == 'f_d' else '')
        for name, (low, high) in result.bounds.items()
    ]
    return [
        f'Fitted by valve_sim_ros {result.version}, seed {result.seed}, {date}',
        *digests,
        *([f'searched: {", ".join(ranges)}'] if ranges else []),
        *result.lines(),
    ]


def percent(etas: Mapping[str, float]) -> str:
    """Return fitness by signal as text."""
    return ', '.join(
        f'{name} {eta:.2f} %' if math.isfinite(eta) else f'{name} –' for name, eta in etas.items()
    )


def interval(estimate: Estimate) -> str:
    """Return a 95 % interval as text."""
    if math.isfinite(estimate.lower):
        return f'{estimate.lower:.4g} to {estimate.upper:.4g}'
    return f'± {estimate.half_width:.3g}' if math.isfinite(estimate.half_width) else '-'


def _row(name: str, estimate: Estimate, unit: str) -> str:
    """Return one line of the table."""
    return (
        f'{name:<9} {estimate.value:>10.5g} {interval(estimate):>21} {unit:<6} {estimate.verdict}'
    )
