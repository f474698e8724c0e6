# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole study: every set generated, diagnosed and scored, and the table of them all."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from . import results, runner, sets
from .outcomes import Outcome, read_all, tried
from .seal import read_json
from .table import Scored

SETS = (
    # set, measured signals, number of records
    ('singles', 'p1,p2,x', 150),
    ('singles', 'p2,x', 150),
    ('clean', 'p1,p2,x', 180),
    ('clean', 'p2,x', 60),
    ('clean', 'x', 60),
    ('left_out', 'p1,p2,x', 60),
    ('unknown', 'p1,p2,x', 50),
    ('pairs', 'p1,p2,x', 60),
    ('singles', 'x', 150),
)

Progress = Callable[[str, int], Callable[[int], object]]


def scored(folder: Path, verdicts: Path) -> Scored:
    """Score one set."""
    about = read_json(folder / 'set.json')
    signals = ','.join(about['signals'])
    return Scored(about['set'], signals, read_all(folder, verdicts), about['count'])


def place(about: dict[str, Any], out: Path) -> Path:
    """Return the folder of a set."""
    signals = about['signals'].replace(',', '')
    return out / f'{about["set"]}_{about["split"]}{about["seed"]}_{signals}'


def verdicts_of(about: dict[str, Any], out: Path) -> Path:
    """Return the folder of what a version said about a set."""
    return place(about, out) / f'verdicts-{about["version"]}'


def diagnose(
    about: dict[str, Any], wanted: int, out: Path, known: set[str], progress: Progress
) -> None:
    """Diagnose the first so many records of a set, but those known; generate them if need be."""
    if len(known) >= wanted:
        return
    folder = place(about, out)
    if not (folder / 'set.json').exists() or read_json(folder / 'set.json')['count'] < wanted:
        bar = progress(f'{folder.name}: records', wanted)
        signals = tuple(about['signals'].split(','))
        sets.generate(about['set'], about['split'], signals, wanted, about['seed'], folder, bar)
    bar = progress(f'{folder.name}: verdicts', wanted)
    runner.run(folder, verdicts_of(about, out), limit=wanted, known=known, progress=bar)


def outcomes(about: dict[str, Any], out: Path, kept: Path | None) -> list[Outcome]:
    """Return all outcomes of a set, kept or new; the new ones are kept from then on."""
    known = results.read(kept, about)
    folder, verdicts = place(about, out), verdicts_of(about, out)
    if (folder / 'set.json').exists() and tried(folder, verdicts):
        names = {each.record for each in known}
        new = [each for each in read_all(folder, verdicts) if each.record not in names]
        if kept and new:
            results.add(kept, about, new)
        known = sorted([*known, *new], key=lambda each: each.record)
    return known


def study(
    split: str,
    share: float,
    seed: int,
    out: Path,
    progress: Progress,
    version: str,
    kept: Path | None = None,
) -> list[Scored]:
    """Generate and diagnose all sets, then open their keys; if interrupted, of those diagnosed.

    Parameters
    ----------
    split : str
        Which half.
    share : float
        Share of each set's records; with 0 only what is kept is scored.
    seed : int
        Seed of all sets.
    out : Path
        Where sets and verdicts go; what is there already is used.
    progress : callable
        Given a title and a total, returns what is called with the number done.
    version : str
        The version under test.
    kept : Path, optional
        File of outcomes: what this version said before is not asked again, what is new is added.
    """
    common = {'split': split, 'seed': seed, 'version': version}
    abouts = [{'set': name, 'signals': signals, **common} for name, signals, _ in SETS]
    counts = [count for _, _, count in SETS]
    with suppress(KeyboardInterrupt):
        for about, count in zip(abouts, counts, strict=True):
            known = {each.record for each in results.read(kept, about)}
            diagnose(about, round(share * count), out, known, progress)
    found = [
        Scored(about['set'], about['signals'], outcomes(about, out, kept), count)
        for about, count in zip(abouts, counts, strict=True)
    ]
    return [each for each in found if each.outcomes]
