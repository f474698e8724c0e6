# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""First guesses from the physics of each stage, without a simulation of what is measured.

f_d1 is |u - p1| while p1 moves; T_g1 and T_g2 are the slopes of the rate of p2 (or of the moving
stem) against p1 - p2 while the chamber fills and empties; f_d is |p2 - x| while the stem moves and
f_s the largest |p2 - x| at which it still rests.
"""

from collections.abc import Iterator

import numpy as np

from ..model.pipeline import Array
from .problem import Problem

BACKLASHES = (0.0, 0.5, 1.0, 2.0, 3.5, 5.5, 8.0, 12.0)
"""Backlashes tried where p1 is not measured [% of span]."""
SPANS = (1, 4, 16, 64)
"""Samples over which rates are taken: few for fast valves, many against noise."""
CLEAR = 6.0
"""A change counts as motion if it exceeds so many standard deviations of the noise."""
USUAL_RATIO = 10.0
LAGS = {'T_g1': 1.0, 'T_g2': -1.0}
"""The sign of p1 - p2 for which each time constant holds."""


def staged_starts(problem: Problem) -> Iterator[Array]:
    """Yield points that the physics suggests, shape (size,): one for each backlash tried."""
    backlashes = [_backlash(problem)] if 'p1' in problem.signals else BACKLASHES
    for f_d1 in backlashes:
        values = {'f_d1': f_d1, 'f_s': 4.0, 'f_d': 2.0, 'a_1/a_2': USUAL_RATIO}
        values |= dict.fromkeys(LAGS, 5.0)
        if 'p2' in problem.signals or 'x' in problem.signals:
            inlets = [outputs[0] for outputs in problem.simulate(problem.point(values))]
            values |= _lags(problem, inlets)
        if 'x' in problem.signals:
            values |= _frictions(problem, problem.simulate(problem.point(values)))
        yield problem.point(values)


def _backlash(problem: Problem) -> float:
    """Return the median |u - p1| while p1 moves."""
    found = []
    for stretch in problem.stretches:
        p1 = stretch.measured['p1']
        moves = np.abs(np.diff(p1)) > CLEAR * problem.noise['p1']
        found.append(np.abs(stretch.u - p1)[1:][moves])
    offsets = np.concatenate(found)
    return float(np.median(offsets)) if offsets.size else 1.0


def _lags(problem: Problem, inlets: list[Array]) -> dict[str, float]:
    """Return T_g1 and T_g2 from the rates of p2, or of x while it moves."""
    name = 'p2' if 'p2' in problem.signals else 'x'
    found = {}
    for lag, sign in LAGS.items():
        fits = []
        for span in SPANS:
            pulls, changes = _rates(problem, name, inlets, span, sign)
            fits.append(_time_constant(pulls, changes, span * problem.sample_time, name == 'x'))
        error, time_constant = min(fits)
        if np.isfinite(error):
            found[lag] = time_constant
    return found


def _rates(
    problem: Problem, name: str, inlets: list[Array], span: int, sign: float
) -> tuple[Array, Array]:
    """Return p1 minus a signal, and its change over the next samples, while p1 rests."""
    pulls, changes = [np.empty(0)], [np.empty(0)]
    for stretch, p1 in zip(problem.stretches, inlets, strict=True):
        values = stretch.measured[name]
        if values.size <= span:
            continue
        pull, change = p1[:-span] - values[:-span], values[span:] - values[:-span]
        size = change if name == 'x' else pull
        clear = sign * size > CLEAR * problem.noise[name]
        chosen = clear & np.isfinite(change) & (p1[:-span] == np.roll(p1, 1 - span)[:-span])
        pulls.append(pull[chosen])
        changes.append(change[chosen])
    return np.concatenate(pulls), np.concatenate(changes)


def _time_constant(
    pulls: Array, changes: Array, time: float, with_offset: bool
) -> tuple[float, float]:
    """Return the relative error and the time constant of changes = share (pulls - offset)."""
    if pulls.size < 5:
        return np.inf, np.nan
    centre = (pulls.mean(), changes.mean()) if with_offset else (0.0, 0.0)
    x, y = pulls - centre[0], changes - centre[1]
    spread = float(x @ x)
    if spread <= 0.0:
        return np.inf, np.nan
    share = min(max(float(x @ y) / spread, 1e-4), 0.99)
    error = float(np.std(y - share * x)) / np.sqrt(spread)
    rate = -np.log1p(-share)
    return error / ((1.0 - share) * rate), time / rate


def _frictions(problem: Problem, outputs: list[Array]) -> dict[str, float]:
    """Return f_s and f_d from p2 - x, measured where it is, at rest and in motion."""
    resting, moving = [np.empty(0)], [np.empty(0)]
    for stretch, result in zip(problem.stretches, outputs, strict=True):
        x = stretch.measured['x']
        force = stretch.measured.get('p2', result[1]) - x
        for span in SPANS:
            if x.size > 2 * span:
                change = x[2 * span :] - x[: -2 * span]
                middle = force[span:-span]
                motion = np.abs(change) > CLEAR * problem.noise['x']
                moving.append((np.sign(change) * middle)[motion & np.isfinite(middle)])
                if span == SPANS[0]:
                    resting.append(np.abs(middle[~motion & np.isfinite(middle)]))
    rests, moves = np.concatenate(resting), np.concatenate(moving)
    f_d = max(float(np.median(moves)), 0.05) if moves.size else 1.0
    f_s = float(np.quantile(rests, 0.99)) if rests.size else 2.0 * f_d
    return {'f_s': max(f_s, 1.05 * f_d), 'f_d': f_d}
