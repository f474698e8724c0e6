# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much of the gap the augmented model closes on what followed the record, never seen."""

from pathlib import Path
from typing import Any

import numpy as np

from .recorder import START

SHIFTS = np.linspace(-1.0, 1.0, 9)
"""Shifts of the stamps that a recorder may have made [share of the period]."""
NOTHING = 0.01
"""Below this mean square, in units of the noise's, the base has no gap worth closing."""


def read_next(path: Path) -> dict[str, np.ndarray]:
    """Return the columns of the continuation."""
    with path.open(encoding='utf-8') as file:
        names = file.readline().strip().split(',')
        return dict(zip(names, np.loadtxt(file, delimiter=',', ndmin=2).T, strict=True))


def misfit(
    parameters: Path,
    record: Any,
    following: dict[str, np.ndarray],
    noise: dict[str, float],
    period: float,
) -> float:
    """Return the mean square error of a model on the continuation [squared noise].

    The model runs through the record first, from its first sample on, to know its state.
    """
    from valve_sim_ros import InitialState, read_parameters, simulate

    signals = [name for name in following if name not in ('t', 'u')]
    initial = {}
    for name in ('p1', 'p2', 'x'):
        values = getattr(record, name)
        known = values[np.isfinite(values)] if values is not None else record.u
        initial[name] = float(np.median(known[:5]))
    # the continuation's clock is the commands', the record's begins with its first sample
    start = record.provenance.start
    offset = 0.0 if start is None else (start - START) * 1e-9
    time = np.concatenate((record.time + offset, following['t']))
    u = np.concatenate((record.u, following['u']))
    later = np.concatenate(([True], np.diff(np.maximum.accumulate(time)) > 0))
    found = simulate(
        u[later],
        parameters=read_parameters(parameters),
        time=time[later],
        initial=InitialState(**initial),
    )
    return min(
        sum(
            float(
                np.mean(
                    (
                        np.interp(following['t'] + shift * period, found.t, getattr(found, name))
                        - following[name]
                    )
                    ** 2
                )
            )
            / noise[name] ** 2
            for name in signals
        )
        for shift in SHIFTS
    )


def gap_closed(folder: Path, verdict: Path, record: str, key: dict[str, Any]) -> float | None:
    """Return the share of the base's gap that the augmented model closes, None if it has none.

    The continuation in the key is free of noise, so all of its misfit is gap.
    """
    from valve_sim_ros import read_recording

    paths = [path for path in (folder / 'records').iterdir() if path.stem == record]
    measured = read_recording(paths[0])
    following = read_next(folder / 'keys' / f'{record}.next.csv')
    noise, period = key['recorder']['noise'], key['recorder']['period']
    before, after = (
        misfit(verdict / name, measured, following, noise, period)
        for name in ('base.yaml', 'augmented.yaml')
    )
    return None if before < NOTHING else 1.0 - after / before
