# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page about a diagnosis: one HTML file that stands alone."""

import os

from ..diagnosis.decision import decisions
from ..diagnosis.outcome import Ladder
from ..diagnosis.proof import Gap
from ..diagnosis.result import Diagnosis, Named, PARTIAL
from ..model.effects import CATALOGUE
from ..model.files import write_text
from . import diagnosis_plots as plots
from .page import embed, number, render

TITLES = {
    'adequate': 'Nothing is missing',
    'missing_effect': 'Missing: {}',
    'unknown_effect': 'An unknown effect is missing',
}


def write_report(result: Diagnosis, path: str | os.PathLike[str]) -> None:
    """Write the report of a diagnosis, aside first and then renamed into place."""
    write_text(path, report(result))


def report(result: Diagnosis) -> str:
    """Return the report of a diagnosis as HTML."""
    titles = ' and '.join(CATALOGUE[named.rung.effect].title for named in result.effects)
    settled = bool(result.effects) or not result.partial
    return render(
        'diagnosis.html',
        title=TITLES[result.verdict].format(titles) if settled else 'Stopped early',
        result=result,
        partial=PARTIAL,
        settled=settled,
        effects=[_effect(result, named) for named in result.effects],
        stages=[_stage(ladder) for ladder in result.ladders],
        places=[
            (
                place.signal,
                place.condition,
                f'{place.share_of_gap:.0%}',
                f'{place.share_of_time:.0%}',
            )
            for place in result.places
        ],
        gaps=[_gap(name, gap) for name, gap in result.gaps.items()],
        overlay=embed(plots.before_and_after(result)),
        residuals=embed(plots.residuals(result)),
        condition=embed(plots.against_condition(result)) if result.places else None,
        quality=[line for recording in result.recordings for line in recording.quality.lines()],
    )


def _effect(result: Diagnosis, named: Named) -> dict[str, object]:
    """Return what the page says of one effect."""
    rung = named.rung
    effect = CATALOGUE[rung.effect]
    units = {f'{rung.effect}.{p.name}': (p.unit, p.description) for p in effect.parameters}
    return {
        'id': rung.effect,
        'effect': effect,
        'rung': rung,
        'parameters': [
            (
                name,
                number(value),
                ' to '.join(number(bound) for bound in named.intervals[name]),
                *units[name],
            )
            for name, value in named.values.items()
        ],
        'decide_by': decisions(rung, result.bench.signals),
        'ladder': embed(plots.ladder(rung)),
    }


def _stage(ladder: Ladder) -> tuple[str, ...]:
    """Return one row of the table of stages."""
    return (
        ' and '.join(ladder.group.stages),
        ladder.group.signal,
        ladder.told,
        number(ladder.before.excess, 3),
        number(ladder.after.excess, 3),
    )


def _gap(name: str, gap: Gap) -> tuple[str, ...]:
    """Return one row of the table of gaps."""
    closed = gap.closed
    return (
        name,
        number(gap.noise, 2),
        *(
            number(each, 3)
            for halves in (gap.before, gap.after)
            for each in (halves.fitted, halves.held_out)
        ),
        'no gap' if closed is None else f'{closed:.1%}',
        number(gap.eta_before.held_out, 5),
        number(gap.eta_after.held_out, 5),
    )
