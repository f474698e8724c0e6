# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the searches for the base valve start."""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from scipy.stats import qmc

from ..model.parameters import DELTA
from .unknowns import Unknown

Starts = list[dict[str, float]]

START: dict[str, float] = {
    'f_d1': 0.5,
    'T_g1': 5.0,
    'T_g2': 5.0,
    'f_s': 4.0,
    'f_d/f_s': 0.6,
    'a_1/a_2': 12.0,
    'damping': 1.8,
    'phase': 0.0,
    'blend': 0.0,
    'lead': 0.0,
    'delta': DELTA.default,
}
GRID: dict[str, tuple[float, ...]] = {
    'f_d1': (0.1, 0.5, 1.5, 4.0),
    'T_g1': (0.7, 2.5, 8.0, 25.0),
    'T_g2': (0.7, 2.5, 8.0, 25.0),
    'f_s': (0.5, 1.5, 3.5, 7.0, 12.0),
    'f_d/f_s': (0.3, 0.55, 0.8),
}
"""Where the search for the base valve starts, and more finely if only the stem is sought."""
STEM_GRID: dict[str, tuple[float, ...]] = {
    'f_s': (0.5, 1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 7.5, 9.0, 11.0, 13.0, 16.0),
    'f_d/f_s': (0.3, 0.45, 0.6, 0.75, 0.9),
}
STEMS = (
    {name: START[name] for name in ('a_1/a_2', 'damping')},
    {'a_1/a_2': 25.0, 'damping': 0.7},
)
"""A stem that creeps to its place, and one that overshoots."""
KINETIC = tuple({'f_d/f_s': share} for share in GRID['f_d/f_s'])
"""Shares of kinetic friction that are tried."""
SWEEP = tuple(
    {'a_1/a_2': rate, 'damping': damping}
    for rate in (10.0, 25.0, 60.0)
    for damping in (0.25, 0.5, 1.0, 3.0)
)
"""Stems of all kinds: from one that swings into one that creeps, no fit leads."""
NEARBY: dict[str, tuple[float, float]] = {
    'f_s': (0.85, 1.3),
    'f_d1': (0.7, 1.4),
    'T_g1': (0.92, 1.08),
    'T_g2': (0.92, 1.08),
}
ANY_STEM: dict[str, tuple[float, float]] = {
    'f_d/f_s': (0.2, 0.95),
    'a_1/a_2': (8.0, 80.0),
    'damping': (0.15, 2.0),
}
ANY_SIZE = 0.3, 3.0
"""Where a valve that slips lies from one that creeps and fits best: times its values, its stem,
and times the parameters of its effects. The valley between them is long, narrow and bent."""
SLIDING: dict[str, tuple[float, float]] = {
    'f_d/f_s': (0.35, 0.95),
    'a_1/a_2': (3.0, 80.0),
    'damping': (0.4, 4.0),
}
HELD = 0.95, 1.03
"""Where a valve lies whose friction falls with speed: its stem, and what holds it times what the
data show."""
AROUND = (0.9, 1.0)
"""Shares of the friction that the data show from which a search starts."""


def grid(unknowns: Sequence[Unknown]) -> Starts:
    """Return the starts of the base valve's unknowns."""
    names = [unknown.name for unknown in unknowns if unknown.name in GRID]
    values = STEM_GRID if set(names) == set(STEM_GRID) else GRID
    return [dict(zip(names, point, strict=True)) for point in product(*(values[n] for n in names))]


def nearby(values: Mapping[str, float], unknowns: Sequence[Unknown], fineness: int) -> Starts:
    """Return 2 to the `fineness` starts around a valve, scattered evenly.

    Their frictions, lags, stems and parameters of effects differ.
    """
    spans = {}
    for name in (unknown.name for unknown in unknowns):
        if name in ANY_STEM:
            spans[name] = ANY_STEM[name]
        elif (name in NEARBY or '.' in name) and values[name] > 0.0:
            low, high = NEARBY.get(name, ANY_SIZE)
            spans[name] = low * values[name], high * values[name]
    return _scattered(values, spans, fineness)


def sliding(
    starts: Sequence[Mapping[str, float]], names: Sequence[str], level: float, fineness: int
) -> Starts:
    """Return 2 to the `fineness` starts of a friction that falls with speed, scattered evenly.

    `names` are the parameters of its law, `level` is what seems to hold the stem [% of span].
    """
    spans = {'f_s': (HELD[0] * level, HELD[1] * level), **SLIDING}
    for name in names:
        each = [start[name] for start in starts]
        low, high = (1.0, 1.0) if min(each) < max(each) else ANY_SIZE
        spans[name] = low * min(each), high * max(each)
    return _scattered(starts[0], spans, fineness)


def _scattered(
    values: Mapping[str, float], spans: Mapping[str, tuple[float, float]], fineness: int
) -> Starts:
    """Return 2 to the `fineness` values, scattered evenly over the logarithms of these spans."""
    low, high = np.log(list(spans.values())).T
    points = qmc.Sobol(len(spans), scramble=False).random_base2(fineness)
    each = np.exp(low + points * (high - low)).tolist()
    return [{**values, **dict(zip(spans, point, strict=True))} for point in each]


def friction_grid(seen: float) -> Starts:
    """Return starts of the friction, which a valve without the effect may have far off.

    `seen` is what holds the stem as the data show it [% of span], NaN if they do not.
    """
    levels = [*GRID['f_s'], *(share * seen for share in AROUND if seen > 0.0)]
    return [
        {'f_s': f_s, 'f_d/f_s': share, **STEMS[0]} for f_s in levels for share in GRID['f_d/f_s']
    ]
