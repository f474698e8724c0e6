# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a record shows beside the run of a base valve: friction, calibration, arrivals."""

from collections.abc import Sequence
import math

import numpy as np

from ..model.pipeline import Array
from .bench import Bench
from .readings import answers_to_steps

ENOUGH_STEPS, LEAST_EACH = 6, 2
"""From so many single steps of the command on, so many late and on time tell of mixed arrivals."""
TOLD, ALIKE, LEAST_PAIRS = 1.5, 0.2, 40
"""Else pairs of moves of p1 from sample to sample tell, larger than this [noise] and alike."""
WITHIN, SLACK = 0.9, 3.0
"""Least part of such moves of which all or a part may be missing, but no more [noise]."""
BY_CHANCE, SURE = 0.05, 3.0
"""The share of their square that scatters (5 in 100 late come to it), and by how many standard
errors of what the noise scatters it must be more."""
SPANS = tuple(np.geomspace(0.7, 1.4, 50).tolist())
"""Spans of the sensor that are tried."""
LEAST_RESTS = 20
"""Samples at rest that show what holds the stem."""


def friction_seen(
    bench: Bench, results: Sequence[Array], span: float = 1.0
) -> tuple[float, float]:
    """Return what holds the stem: half the range of p2 - x / span at rest, and its middle.

    `results` are p1, p2, x of a valve by stretch, shape (4, n); NaN if x does not rest
    [% of span].
    """
    pairs = zip(bench.stretches, results, strict=True)
    each = [result[1] - s.rests / span for s, result in pairs if s.rests.size]
    held = np.concatenate([*each, np.empty(0)])
    held = held[np.isfinite(held)]
    if held.size < LEAST_RESTS:
        return math.nan, math.nan
    low, high = np.quantile(held, (0.005, 0.995))
    return float(high - low) / 2.0, float(high + low) / 2.0


def calibration_seen(bench: Bench, results: Sequence[Array]) -> dict[str, tuple[float, ...]]:
    """Return the zero and span of the sensor with which the same holds the stem everywhere.

    `results` as for `friction_seen`; zeros [% of span] and spans, a right sensor's first, none
    if x does not rest.
    """
    _, middle, span = min((*friction_seen(bench, results, span), span) for span in SPANS)
    if math.isnan(middle):
        return {}
    return {'zeros': (0.0, -span * middle), 'spans': (1.0, span)}


def mixed_arrivals(bench: Bench, results: Sequence[Array]) -> bool:
    """Tell whether some samples of p1 show a command and others not yet, as if by chance.

    That is so where samples are taken just when commands arrive, and jitter; then see
    `Bench.weigh_down`.

    Parameters
    ----------
    bench : Bench
        The record.
    results : sequence of ndarray
        p1, p2, x of the base valve by stretch, shape (3, n), commands acting at once: needed
        where single steps of the command are few.
    """
    noise = bench.noise['p1']
    each = [answers_to_steps(s.u, s.measured['p1'], noise) for s in bench.stretches]
    late, on_time = map(sum, zip(*each, strict=True))
    if late + on_time >= ENOUGH_STEPS:
        return min(late, on_time) >= LEAST_EACH
    scatter = moves = 0.0
    pairs = within = 0
    for stretch, result in zip(bench.stretches, results, strict=True):
        # a lag or a wrong level changes little from one step to a like one, chance does
        step = np.diff(result[0])
        missing = result[0, 1:] - stretch.counts['p1'][1:]
        change, square = np.diff(missing) ** 2, step[1:] ** 2 + step[:-1] ** 2
        alike = (step[1:] - step[:-1]) ** 2 < ALIKE * square
        told = alike & (np.minimum(*np.abs((step[1:], step[:-1]))) > TOLD * noise)
        told &= np.isfinite(change)
        scatter += float(np.sum(change[told] - 2.0 * noise**2))
        moves += float(np.sum(square[told]))
        pairs += int(told.sum())
        part = missing * np.sign(step)
        inside = np.maximum(-part, part - np.abs(step)) <= SLACK * noise
        within += int(np.sum(told & inside[1:]))
    enough = pairs >= LEAST_PAIRS and within > WITHIN * pairs
    by_noise = SURE * noise**2 * math.sqrt(8.0 * pairs)
    return enough and scatter > BY_CHANCE * moves + by_noise
