# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page about an identification: one HTML file that stands alone."""

import os

from ..identification.result import Identification
from ..identification.text import interval
from ..model.files import write_text
from . import plots
from .page import embed, number, render

MOST_RECORDINGS = 6
"""So many recordings are drawn; the numbers are of all."""


def write_report(result: Identification, path: str | os.PathLike[str]) -> None:
    """Write the report of an identification, aside first and then renamed into place."""
    write_text(path, report(result))


def report(result: Identification) -> str:
    """Return the report of an identification as HTML."""
    drawn = range(min(len(result.recordings), MOST_RECORDINGS))
    return render(
        'identification.html',
        result=result,
        parameters=[_row(result, name) for name in result.estimates],
        doubtful=[name for name, each in result.estimates.items() if not each.identified],
        combinations=_combinations(result),
        fitness=_fitness(result),
        recordings=[_recording(result, index) for index in drawn],
        left_out=len(result.recordings) - len(drawn),
        signature=embed(plots.signature(result)),
        intervals=embed(plots.intervals(result)),
        correlation=embed(plots.correlation(result)) if result.assessment else None,
        profiles=embed(plots.profiles(result)) if result.profiles else None,
        profile_lines=[f'{each.name}: {each.text()}' for each in result.profiles],
        provenance=_provenance(result),
    )


def _row(result: Identification, name: str) -> tuple[str, ...]:
    """Return one row of the table of parameters."""
    estimate = result.estimates[name]
    return (
        name,
        number(estimate.value, 5),
        interval(estimate),
        number(estimate.standard_error, 2),
        estimate.unit,
        estimate.verdict,
    )


def _combinations(result: Identification) -> list[tuple[str, ...]]:
    """Return rows of what is known although its parts are not."""
    found = result.assessment.combinations if result.assessment else {}
    return [
        (name, number(each.value, 5), interval(each), each.unit) for name, each in found.items()
    ]


def _fitness(result: Identification) -> list[tuple[str, ...]]:
    """Return rows of eta: all data, then fitted and held out side by side."""
    rows: list[tuple[str, ...]] = [
        ('all data', name, _eta(eta), '', number(result.nrmse[name]))
        for name, eta in result.eta_by_signal.items()
    ]
    for part, etas in result.eta_held_out.items():
        rows += [
            (f'{part} held out', name, _eta(etas['fitted'][name]), _eta(held), '')
            for name, held in etas['held_out'].items()
        ]
    return rows


def _eta(value: float) -> str:
    """Return a fitness with as many decimals as matter."""
    return f'{value:.3f}' if value == value else '–'


def _recording(result: Identification, index: int) -> dict[str, object]:
    """Return what the page shows about a recording."""
    recording = result.recordings[index]
    return {
        'name': ', '.join(recording.provenance.paths) or f'recording {index + 1}',
        'overlay': embed(plots.overlay(result, index)),
        'residuals': embed(plots.residuals(result, index)),
        'quality': recording.quality.lines(),
    }


def _provenance(result: Identification) -> list[tuple[str, str]]:
    """Return rows of what the result was made from."""
    rows = [
        (path, f'sha256 {digest}')
        for recording in result.recordings
        for path, digest in recording.provenance.digests.items()
    ]
    rows += [
        (f'searched {name}', f'{low:.4g} to {high:.4g}' + (' of f_s' if name == 'f_d' else ''))
        for name, (low, high) in result.bounds.items()
    ]
    rows += [(f'noise of {name}', f'{noise:.3g} %') for name, noise in result.noise.items()]
    return [*rows, ('seed', str(result.seed)), ('version', result.version)]
