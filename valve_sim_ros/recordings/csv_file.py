# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as CSV: a header with t (or time), u and any of p1, p2, x, comment lines after #."""

import csv
from dataclasses import replace
import hashlib
import os
from pathlib import Path
from typing import Any

import numpy as np

from .errors import RecordingError
from .quality import Array, MAX_GAP_PERIODS
from .recording import Provenance, Recording, refuse_not_finite, SIGNALS
from .topics import chosen, Topics

TIMES = ('t', 'time', '__time')
"""What the column of times may be called: by `write_csv`, by hand, by PlotJuggler."""
NEAR, REGULAR = 0.25, 0.9
"""Steps of the time axis no further than this from a whole number of periods are on a grid; rows
that are not there are lost ones where so many are."""


def read_csv(path: str | os.PathLike[str], topics: Topics | None = None) -> Recording:
    """Read a CSV file with columns t [s], u and any of p1, p2, x [% of span], in any order.

    The times may also stand in a column `time` or `__time`. An empty cell is a lost sample, and so
    is every cell of a row that is missing where the others are a period apart; the command before
    a lost one holds. `topics` renames columns.

    Raises
    ------
    RecordingError
        With the line, if the file is no such table or its numbers cannot be used.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
        lines = content.decode('utf-8-sig').splitlines()
    except OSError as error:
        raise RecordingError(f'{path}: cannot be read ({error.strerror})') from None
    except UnicodeDecodeError as error:
        raise RecordingError(f'{path}: not a text file ({error})') from None
    comments = tuple(line.lstrip('# ') for line in lines if line.startswith('#'))
    rows = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and line[0] != '#']
    if not rows:
        raise RecordingError(f'{path}: empty; expected a header "t,u,x" and numbers below it')
    header = [cell.split('[')[0].strip() for cell in next(csv.reader([rows[0][1]]))]
    columns = _columns(path, header, topics)
    table = _table(path, rows, len(header))
    signals: dict[str, Any] = {}
    for name, (index, scale, offset) in columns.items():
        signals[name] = table[:, index] * scale + offset
    clock = next(name for name in TIMES if name in header)
    time = table[:, header.index(clock)]
    try:
        refuse_not_finite('t', time, np.arange(time.size, dtype=float))
        for name, values in signals.items():
            lost = np.isnan(values) & _empty(rows, header, columns[name][0])
            if name == 'u':
                lost[0] = False  # nothing is known to hold there
            refuse_not_finite(name, np.where(lost, 0.0, values), time)
        time, at = _with_lost_rows(time)
        signals = {name: np.where(at < 0, np.nan, values[at]) for name, values in signals.items()}
        lost = np.isnan(signals['u'])
        held = np.maximum.accumulate(np.where(lost, 0, np.arange(time.size)))
        signals['u'] = signals['u'][held]
        doubtful = np.flatnonzero(lost[:-1] & ~lost[1:] & (np.diff(signals['u']) != 0.0)) + 1
        recording = Recording(
            time=time - time[0],
            **signals,
            provenance=Provenance(
                paths=(str(path),),
                digests={str(path): hashlib.sha256(content).hexdigest()},
                topics={name: header[index] for name, (index, _, _) in columns.items()},
                time_source=f'column {clock}',
                storage='csv',
                comments=comments,
            ),
        )
        quality = replace(
            recording.quality,
            lost_commands=tuple(np.flatnonzero(lost).tolist()),
            doubtful_commands=tuple(doubtful.tolist()),
        )
        return replace(recording, quality=quality)
    except RecordingError as error:
        raise RecordingError(f'{path}: {error}') from None


def write_csv(recording: Recording, path: str | os.PathLike[str]) -> None:
    """Write columns t,u,p1,p2,x (those there are), exactly, aside first and then renamed."""
    path = Path(path)
    names = ('u', *recording.signals)
    columns = [recording.time, *(getattr(recording, name) for name in names)]
    aside = path.with_name(f'.{path.name}.part')
    with aside.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(('t', *names))
        for row in zip(*columns, strict=True):
            writer.writerow(['' if value != value else repr(float(value)) for value in row])
    os.replace(aside, path)


def _columns(
    path: Path, header: list[str], topics: Topics | None
) -> dict[str, tuple[int, float, float]]:
    """Return index, scale and offset of the column of each signal."""
    selections = chosen(topics)
    names = {
        name: selections[name].topic.lstrip('/') if name in selections else name
        for name in SIGNALS
    }
    missing = [names[s] for s in selections if names[s] not in header]
    missing += ['t'] if {*TIMES}.isdisjoint(header) else []
    missing += [names['u']] if names['u'] not in header else []
    if missing:
        raise RecordingError(
            f'{path}: no column {missing[0]!r}; it has {", ".join(header)}; expected t (or time), '
            'u and any of p1, p2, x (say which with --topic x=COLUMN)'
        )
    return {
        signal: (
            header.index(name),
            selections[signal].scale if signal in selections else 1.0,
            selections[signal].offset if signal in selections else 0.0,
        )
        for signal, name in names.items()
        if name in header
    }


def _table(path: Path, rows: list[tuple[int, str]], width: int) -> Array:
    """Return the numbers below the header, NaN for empty cells."""
    if len(rows) < 2:
        raise RecordingError(f'{path}: a header without samples; record again')
    table = np.empty((len(rows) - 1, width))
    for row, (number, line) in zip(table, rows[1:], strict=True):
        cells = line.split(',')
        if len(cells) != width:
            raise RecordingError(
                f'{path}, line {number}: {len(cells)} cells, the header has {width} columns'
            )
        try:
            row[:] = [float(cell) if cell.strip() else np.nan for cell in cells]
        except ValueError as error:
            raise RecordingError(f'{path}, line {number}: {error}; expected numbers') from None
    return table


def _with_lost_rows(time: Array) -> tuple[Array, np.ndarray]:
    """Return the times [s] with those of lost rows between them, and the row of each, -1: lost."""
    steps, row = np.diff(time), np.arange(time.size)
    if not steps.size or (steps <= 0.0).any():
        return time, row
    apart = steps / np.median(steps)
    if np.mean(np.abs(apart - np.rint(apart)) <= NEAR) < REGULAR:
        return time, row
    ticks = np.where(apart <= MAX_GAP_PERIODS + 0.5, np.maximum(np.rint(apart), 1), 1).astype(int)
    place = np.concatenate([[0], np.cumsum(ticks)])
    at = np.full(place[-1] + 1, -1)
    at[place] = row
    return np.interp(np.arange(at.size), place, time), at


def _empty(rows: list[tuple[int, str]], header: list[str], index: int) -> np.ndarray:
    """Tell which cells of a column are empty, as opposed to NaN."""
    return np.array([not line.split(',')[index].strip() for _, line in rows[1:]])
