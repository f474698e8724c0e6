# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The verdicts on a set: one folder per record; those that exist are not made again."""

from collections.abc import Callable, Collection
from pathlib import Path
import time
import traceback

from .seal import read_json, write_json

LEFT_OUT = 'left_out'
"""The set whose hidden effects are taken out of the catalogue, one record at a time."""


def hidden(folder: Path, record: str) -> tuple[str, ...]:
    """Return the effects of the key: for the verdict to do without them, nothing else."""
    return tuple(read_json(folder / 'keys' / f'{record}.json')['effects'])


def verdict(path: Path, out: Path, seed: int, without: tuple[str, ...]) -> None:
    """Diagnose one record into a folder, and note how long it took.

    What goes wrong is noted too, and counts as a wrong verdict until it is made again.
    """
    # here, since the generator must not import what it tests
    from valve_sim_ros.diagnosis import diagnose, PATIENCE

    out.mkdir(parents=True, exist_ok=True)
    for name in ('error.txt', 'seconds.json'):
        (out / name).unlink(missing_ok=True)
    began = time.perf_counter()
    try:
        diagnose([path], seed=seed, without=without, patience=PATIENCE).write(out)
    except Exception:  # whatever a diagnosis may do wrong must not end the study; it is scored
        (out / 'error.txt').write_text(traceback.format_exc(), encoding='utf-8')
    else:
        write_json(out / 'seconds.json', time.perf_counter() - began)


def one(folder: Path, out: Path, seed: int, path: Path) -> None:
    """Diagnose one record of a set; without its effects if they are to be left out."""
    left_out = read_json(folder / 'set.json')['set'] == LEFT_OUT
    without = hidden(folder, path.stem) if left_out else ()
    verdict(path, out / path.stem, seed, without)


def run(
    folder: Path,
    out: Path,
    *,
    seed: int = 0,
    limit: int | None = None,
    known: Collection[str] = (),
    progress: Callable[[int], object] = lambda done: None,
) -> int:
    """Diagnose the records of a set that have no verdict yet, one by one: each takes all cores.

    Parameters
    ----------
    folder, out : Path
        The set; where the verdicts go.
    seed : int
        Of the diagnosis.
    limit : int, optional
        Only the first so many records.
    known : collection of str, optional
        Records that need no verdict.
    progress : callable
        Called with 1 for each record that has a verdict.

    Returns
    -------
    int
        Number of records that could not be diagnosed.
    """
    paths = sorted(each for each in (folder / 'records').iterdir() if each.name[0] != '.')[:limit]
    missing = [
        path
        for path in paths
        if path.stem not in known and not (out / path.stem / 'seconds.json').exists()
    ]
    progress(len(paths) - len(missing))
    for path in missing:
        one(folder, out, seed, path)
        progress(1)
    return sum((out / path.stem / 'error.txt').exists() for path in paths)
