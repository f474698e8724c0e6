# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole study: every set generated, diagnosed and scored, and the table of them all."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
import subprocess

from . import runner, sets
from .outcomes import read_all, tried
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


def version(root: Path) -> str:
    """Return what git calls the version under test."""
    try:
        found = subprocess.run(
            ('git', 'describe', '--always', '--dirty', '--exclude=*'),
            cwd=root,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'
    return found.stdout.strip()


def scored(folder: Path, verdicts: Path) -> Scored:
    """Score one set."""
    about = read_json(folder / 'set.json')
    signals = ','.join(about['signals'])
    return Scored(about['set'], signals, read_all(folder, verdicts), about['count'])


def study(split: str, share: float, seed: int, out: Path, progress: Progress) -> list[Scored]:
    """Generate and diagnose all sets, then open their keys; if interrupted, of those diagnosed.

    Parameters
    ----------
    split : str
        Which half.
    share : float
        Share of each set's records.
    seed : int
        Seed of all sets.
    out : Path
        Where sets and verdicts go; what is there already is used.
    progress : callable
        Given a title and a total, returns what is called with the number done.
    """
    folders = []
    for name, signals, count in SETS:
        folder = out / f'{name}_{split}_{signals.replace(",", "")}'
        wanted = max(round(share * count), 1)
        if not (folder / 'set.json').exists():
            bar = progress(f'{folder.name}: records', wanted)
            sets.generate(name, split, tuple(signals.split(',')), wanted, seed, folder, bar)
        folders.append(folder)
    with suppress(KeyboardInterrupt):
        for folder in folders:
            bar = progress(f'{folder.name}: verdicts', read_json(folder / 'set.json')['count'])
            runner.run(folder, folder / 'verdicts', progress=bar)
    return [
        scored(folder, folder / 'verdicts')
        for folder in folders
        if tried(folder, folder / 'verdicts')
    ]
