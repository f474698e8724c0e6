# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where model and measurement disagree: when, and under which conditions."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..model.pipeline import Array
from .bench import Bench
from .stretch import Stretch

Mask = npt.NDArray[np.bool_]
RECENT = 3.0
"""What counts as shortly after a reversal or a step of the command [s]."""
SPAN_WINDOW = 2.0
"""Width of the moving mean that finds spans [s]."""
MOST_SPANS = 12
LEAST_SHARE, LEAST_LIFT = 0.25, 1.25
"""A condition is told if it holds this share of the gap, and this much more than of the time."""


@dataclass(frozen=True)
class Place:
    """A condition under which a signal is off, with the times at which it is off most."""

    stage: str
    signal: str
    condition: str
    spans: tuple[tuple[float, float], ...]
    share_of_gap: float
    share_of_time: float


def places(
    bench: Bench, stage: str, signal: str, residual: Array, results: list[Array], most: int = 3
) -> list[Place]:
    """Return the conditions that hold most of the gap in least of the time, best first.

    Parameters
    ----------
    bench : Bench
        The recordings.
    stage, signal : str
        Where the residual belongs.
    residual : ndarray, shape (n,)
        Over its noise, all stretches; 0 or NaN where not counted.
    results : list of ndarray
        p1, p2, x of the model per stretch, shape (3, m).
    most : int
        At most so many.
    """
    power = np.maximum(np.nan_to_num(residual) ** 2 - 1.0, 0.0)
    total = float(power.sum())
    if total <= 0.0:
        return []
    masks = [conditions(s, r) for s, r in zip(bench.stretches, results, strict=True)]
    counted = np.nan_to_num(residual) != 0.0
    found = []
    for name in masks[0]:
        mask = np.concatenate([each[name] for each in masks]) & counted
        share = float(power[mask].sum()) / total
        time = float(mask.sum()) / max(float(counted.sum()), 1.0)
        if share >= LEAST_SHARE and share >= LEAST_LIFT * time:
            score = share * np.log(share / max(time, 1e-3))
            found.append((score, name, share, time))
    found.sort(reverse=True)
    chosen = found[:most] or [(0.0, 'everywhere', 1.0, 1.0)]
    spans = _spans(bench, power)
    return [
        Place(stage, signal, name, spans, round(share, 3), round(time, 3))
        for _, name, share, time in chosen
    ]


def conditions(stretch: Stretch, result: Array) -> Mapping[str, Mask]:
    """Return which samples of a stretch are under which condition, shape (n,) each."""
    p1, p2, x = result[:3]
    period = float(np.median(np.diff(stretch.time)))
    u = stretch.u
    recent = max(int(RECENT / period), 1)
    speed = np.gradient(x, stretch.time)
    moving = np.abs(speed) > 0.1
    share = np.arange(u.size) / u.size
    changed = np.abs(np.diff(u, prepend=u[0])) > 0.5
    return {
        'while p2 fills': p1 > p2 + 0.5,
        'while p2 empties': p1 < p2 - 0.5,
        'while p1 and p2 rest': np.abs(p1 - p2) <= 0.5,
        'after a reversal of the command': _after(_reversals(u), recent),
        'after a step of the command': _after(changed, recent),
        'while the stem rests': ~moving,
        'while the stem opens': moving & (speed > 0.0),
        'while the stem closes': moving & (speed < 0.0),
        'at low opening': x < np.quantile(x, 0.25),
        'at high opening': x > np.quantile(x, 0.75),
        'at high command': u > np.quantile(u, 0.75),
        'at low command': u < np.quantile(u, 0.25),
        'early in the record': share < 1 / 3,
        'late in the record': share > 2 / 3,
    }


def _reversals(u: Array) -> Mask:
    """Return where the command turns round."""
    steps = np.diff(u, prepend=u[0])
    signs = np.sign(steps)
    last, turned = 0.0, np.zeros(u.size, dtype=bool)
    for k in np.flatnonzero(signs):
        turned[k] = last * signs[k] < 0.0
        last = signs[k]
    return turned


def _after(events: Mask, count: int) -> Mask:
    """Return the samples from each event on."""
    held = np.convolve(events.astype(float), np.ones(count))[: events.size]
    return np.asarray(held > 0.5)


def _spans(bench: Bench, power: Array) -> tuple[tuple[float, float], ...]:
    """Return the spans of time that hold most of the gap [s since the start of the data]."""
    spans: list[tuple[float, float, float]] = []
    first, origin = 0, 0.0
    for stretch in bench.stretches:
        n = stretch.time.size
        here = power[first : first + n]
        width = max(int(SPAN_WINDOW / float(np.median(np.diff(stretch.time)))), 1)
        level = np.convolve(here, np.ones(width) / width, mode='same')
        high = level > max(2.0, 2.0 * float(here.mean()))
        edges = np.flatnonzero(np.diff(np.concatenate([[0], high.astype(int), [0]])))
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            begin, end = stretch.time[a], stretch.time[b - 1]
            spans.append((float(here[a:b].sum()), origin + begin, origin + end))
        first, origin = first + n, origin + float(stretch.time[-1])
    top = sorted(spans, reverse=True)[:MOST_SPANS]
    return tuple(sorted((round(a, 2), round(b, 2)) for _, a, b in top))
