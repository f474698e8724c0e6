# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The score of a diagnosis on a set of blind records."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest

from .outcomes import ADEQUATE, FAILED, MISSING, Outcome, UNKNOWN

BINS = 10
"""Bins of the stated probability."""


class Rate(NamedTuple):
    """How often something happened, of how many, with the Wilson 95 % interval."""

    name: str
    count: int
    total: int

    @property
    def interval(self) -> tuple[float, float]:
        """Return the Wilson interval [share]."""
        if not self.total:
            return 0.0, 1.0
        found = binomtest(self.count, self.total).proportion_ci(0.95, method='wilson')
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        """Return per cent, interval and counts."""
        share = 100.0 * self.count / self.total if self.total else float('nan')
        low, high = (100.0 * bound for bound in self.interval)
        return f'{share:.1f} % [{low:.1f}, {high:.1f}] ({self.count} of {self.total})'


def rate(name: str, outcomes: Iterable[Outcome], test: Callable[[Outcome], bool]) -> Rate:
    """Count the outcomes that pass a test."""
    passed = [test(each) for each in outcomes]
    return Rate(name, sum(passed), len(passed))


def said(verdict: str) -> Callable[[Outcome], bool]:
    """Return the test for a verdict."""
    return lambda outcome: outcome.verdict == verdict


def rates(kind: str, outcomes: Sequence[Outcome]) -> list[Rate]:
    """Return the rates that count for a kind of set."""
    if kind == 'clean':
        found = [
            rate('false alarms', outcomes, lambda each: each.verdict in (MISSING, UNKNOWN)),
            rate('of them unknown effect', outcomes, said(UNKNOWN)),
        ]
    elif kind in ('unknown', 'left_out'):
        found = [
            rate('called unknown', outcomes, said(UNKNOWN)),
            rate('misnamed', outcomes, said(MISSING)),
            rate('misnamed, truth a stated twin', outcomes, lambda each: each.within_twins),
            rate('called adequate', outcomes, said(ADEQUATE)),
        ]
    else:
        found = [
            rate('exactly', outcomes, lambda each: each.exact),
            rate('within stated twins', outcomes, lambda each: each.within_twins),
            rate('called adequate', outcomes, said(ADEQUATE)),
            rate('called unknown', outcomes, said(UNKNOWN)),
        ]
    if kind == 'pairs':
        found[2:2] = [
            rate('both, perhaps with others', outcomes, lambda each: each.all_named),
            rate('at least one', outcomes, lambda each: each.one_named),
        ]
    return [*found, rate('failed', outcomes, said(FAILED))]


class Row(NamedTuple):
    """One hidden effect in the confusion matrix, or one kind of pair, or none."""

    truth: str
    exact: Rate
    within: Rate
    said: dict[str, int]


def confusion(outcomes: Sequence[Outcome]) -> list[Row]:
    """Return the confusion matrix, row by row, without its zeros."""
    rows = []
    for truth in sorted({each.truth for each in outcomes}):
        those = [each for each in outcomes if each.truth == truth]
        rows.append(
            Row(
                ' + '.join(sorted(truth)) or 'none',
                rate('exactly', those, lambda each: each.exact),
                rate('within stated twins', those, lambda each: each.within_twins),
                dict(Counter(each.said for each in those).most_common()),
            )
        )
    return rows


class Calibration(NamedTuple):
    """Expected calibration error of the probability stated with each effect."""

    error: float
    effects: int
    mean_stated: float
    share_right: float


def calibration(outcomes: Iterable[Outcome]) -> Calibration:
    """Compare each probability with how often the effect was there."""
    stated = [
        (probability, name in each.truth)
        for each in outcomes
        if each.verdict == MISSING
        for name, probability in zip(each.named, each.probabilities, strict=True)
    ]
    if not stated:
        return Calibration(float('nan'), 0, float('nan'), float('nan'))
    p, right = np.array(stated, dtype=float).T
    places = np.minimum((p * BINS).astype(int), BINS - 1)
    error = sum(
        abs(p[places == k].sum() - right[places == k].sum()) for k in np.unique(places)
    ) / len(p)
    return Calibration(float(error), len(p), float(p.mean()), float(right.mean()))


def closed(outcomes: Iterable[Outcome]) -> np.ndarray:
    """Return the shares of the gap closed, one per record that has a gap."""
    return np.array([each.closed for each in outcomes if each.closed is not None])


def twins_stated(outcomes: Iterable[Outcome]) -> float:
    """Return the mean number of twins stated with an effect."""
    counts = [len(twins) for each in outcomes for twins in each.twins]
    return float(np.mean(counts)) if counts else 0.0
