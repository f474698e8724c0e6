# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The score as text: one set for the terminal, all sets for the committed table."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from . import score
from .outcomes import Outcome
from .score import Rate, Row

TARGETS = {
    'singles p1,p2,x': 'exactly ≥ 95 %, within twins ≥ 99 %, no effect below 80 %',
    'singles p2,x': 'exactly ≥ 90 %, within twins ≥ 97 %',
    'singles x': 'exactly ≥ 80 %, within twins ≥ 97 %',
    'clean': 'false alarms ≤ 1 %',
    'left_out': 'unknown ≥ 90 %, misnamed ≤ 5 %',
    'unknown': 'unknown ≥ 90 %, misnamed ≤ 5 %',
    'pairs': 'both ≥ 80 %, at least one ≥ 97 %',
}


class Scored(NamedTuple):
    """A set with its outcomes; `signals` as in 'p2,x'; how many records a whole study has."""

    kind: str
    signals: str
    outcomes: list[Outcome]
    drawn: int = 0

    @property
    def size(self) -> str:
        """Return how many records were diagnosed, of how many if not all were."""
        done = len(self.outcomes)
        return f'{done} of {self.drawn} records' if self.drawn > done else f'{done} records'

    @property
    def target(self) -> str:
        """Return what it has to reach."""
        return TARGETS.get(f'{self.kind} {self.signals}', TARGETS.get(self.kind, ''))


def percentages(values: np.ndarray) -> str:
    """Return median and tenth percentile of shares."""
    if not values.size:
        return 'no record with a gap'
    median, tenth = 100.0 * np.percentile(values, [50, 10])
    return f'median {median:.1f} %, tenth percentile {tenth:.1f} % ({values.size} records)'


def seconds(outcomes: Sequence[Outcome]) -> str:
    """Return the time of the diagnosis."""
    taken = [each.seconds for each in outcomes if each.seconds > 0.0] or [float('nan')]
    median, most = np.percentile(taken, [50, 90])
    return f'median {median:.1f} s, ninetieth percentile {most:.1f} s'


def lines(scored: Scored) -> list[tuple[str, str]]:
    """Return name and figure of all that is told of a set."""
    found = [(rate.name, str(rate)) for rate in score.rates(scored.kind, scored.outcomes)]
    if scored.kind in ('singles', 'pairs'):
        if scored.kind == 'singles':
            rows = score.confusion(scored.outcomes)
            worst = min(rows, key=lambda row: row.exact.count / row.exact.total)
            found.append(('worst effect, exactly', f'{worst.truth}: {worst.exact}'))
        found.append(('twins stated per effect', f'{score.twins_stated(scored.outcomes):.2f}'))
        found.append(('gap closed, never seen', percentages(score.closed(scored.outcomes))))
    found.append(('seconds for 900 s at 5 Hz', seconds(scored.outcomes)))
    return found


def calibration(sets: Sequence[Scored]) -> str:
    """Return the calibration over the sets whose effects the catalogue has, or that have none."""
    found = score.calibration(
        each
        for scored in sets
        if scored.kind in ('singles', 'pairs', 'clean')
        for each in scored.outcomes
    )
    if not found.effects:
        return 'no effect named'
    return (
        f'{100 * found.error:.1f} % over {found.effects} effects named (on average '
        f'{100 * found.mean_stated:.1f} % stated, {100 * found.share_right:.1f} % right)'
    )


def share(rate: Rate) -> str:
    """Return a rate as counts."""
    return f'{rate.count}/{rate.total}'


def matrix(scored: Scored) -> list[Row]:
    """Return the confusion matrix; of the pairs, those that were not named exactly."""
    rows = score.confusion(scored.outcomes)
    return [row for row in rows if scored.kind != 'pairs' or row.exact.count < row.exact.total]


def matrix_row(row: Row) -> str:
    """Return what was said of an effect, most frequent first."""
    others = [f'{said} {count}' for said, count in row.said.items() if said != row.truth]
    return ', '.join(others)


def one_by_one(scored: Scored) -> str:
    """Return a line per record."""
    text = []
    for each in scored.outcomes:
        stated = [
            f'{name} {100 * probability:.0f} %'
            + (f' (or {", ".join(sorted(twins))})' if twins else '')
            for name, probability, twins in zip(
                each.named, each.probabilities, each.twins, strict=True
            )
        ]
        closed = '' if each.closed is None else f'closed {100 * each.closed:.1f} %'
        mark = 'ok ' if each.exact or (not each.truth and each.verdict == 'adequate') else '-- '
        text.append(
            f'{mark}{each.record} {" + ".join(each.truth) or "none":40} {each.verdict:15} '
            f'{"; ".join(stated)}  {closed}  {each.seconds:.1f} s'
        )
    return '\n'.join(text)


def as_text(scored: Scored) -> str:
    """Return the score of one set for the terminal."""
    text = [f'{scored.kind} {scored.signals}: {scored.size}']
    if scored.target:
        text.append(f'  {"target":28}{scored.target}')
    text += [f'  {name:28}{figure}' for name, figure in lines(scored)]
    text.append(f'  {"calibration error":28}{calibration([scored])}')
    text.append(f'  {"hidden":44}{"exact":>8}{"twins":>8}  said instead')
    for row in matrix(scored):
        counts = f'{share(row.exact):>8}{share(row.within):>8}'
        text.append(f'  {row.truth:44}{counts}  {matrix_row(row)}')
    return '\n'.join(text)


def as_markdown(sets: Sequence[Scored], split: str, version: str, command: str) -> str:
    """Return the table of all sets, for the documentation."""
    singles = [each for scored in sets if scored.kind == 'singles' for each in scored.outcomes]
    text = [
        '# Diagnosis of hidden effects: results on blind records',
        '',
        f'Made with version {version}, {split} half, by',
        '',
        f'    {command}',
        '',
        'The records come from a simulator that shares no code with the package (`blind/`); the',
        'keys were sealed when the records were made and opened after the verdicts. Intervals are',
        'Wilson, 95 %.',
        '',
        f'* Expected calibration error of the probability stated: {calibration(sets)}; '
        'target ≤ 5 %.',
        '* Gap closed on records never seen: '
        f'{percentages(score.closed(singles))}; '
        'target median ≥ 98 %, tenth percentile ≥ 90 %.',
        f'* Time: {seconds([o for s in sets for o in s.outcomes])} for 900 s at 5 Hz, one record '
        'at a time; target ≤ 20 s.',
    ]
    for scored in sets:
        signals = scored.signals.replace(',', ', ')
        text += ['', f'## {scored.kind} — u, {signals}: {scored.size}', '']
        if scored.target:
            text += [f'Target: {scored.target}.', '']
        text += ['| | |', '|---|---|']
        text += [f'| {name} | {figure} |' for name, figure in lines(scored)]
        text += ['', '| hidden | exactly | within twins | said instead |', '|---|---|---|---|']
        text += [
            f'| {row.truth} | {share(row.exact)} | {share(row.within)} | {matrix_row(row)} |'
            for row in matrix(scored)
        ]
    return '\n'.join(text) + '\n'
