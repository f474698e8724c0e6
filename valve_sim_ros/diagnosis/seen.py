# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a record shows beside the run of a base valve: friction, calibration, arrivals."""

from collections.abc import Sequence
import math

import numpy as np
from scipy.signal import periodogram

from ..model.pipeline import Array
from .bench import Bench
from .leaving import drift_seen, LEAST_LEFT, left, TOLD_BETTER
from .readings import answers_to_steps
from .starts import Starts

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
STOPS, OUTERMOST, BEYOND, LEAST_PRESSED = 'travel_stops', 0.01, 1.0, 5
"""The effect, the share of rests that may lie beyond a stop, by how much more is left unmoved
there than holds the stem elsewhere [% of span], and samples that show how far one yields."""
YIELDS, MOST_GIVEN = 2.5, 0.3
"""How far it may yield [% of span], and its compliance."""
SHAKES, AMPLITUDES = 'vibration', (0.4, 1.0, 2.5)
"""The effect, and amplitudes from which a search starts [% of span]."""
EARLY, CARRIED = (-0.6, 0.0), (0.2, 0.8)
"""How far slips come before a crest [rad], and by which shares of the amplitude more holds the
stem than is seen to: starts, too."""
SLOWEST, QUICKEST, FINENESS, LINE = 0.02, 0.45, 0.1, 3.0
"""Frequencies of a force that shakes the stem: from [Hz] to [1 / period of the samples], in such
parts of what the record tells apart; and how far a line must stand out (5 in 100 do by chance)."""


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


def shaken_seen(bench: Bench, held: float) -> Starts:
    """Return starts of a periodic force on the stem, from the moments at which the stem slips.

    A force that shakes a resting stem lets it go up near its crests and down near its troughs:
    moments and directions have a line in their spectrum. None if there is no such line.

    Parameters
    ----------
    bench : Bench
        The record.
    held : float
        What holds the stem as the data show it [% of span].
    """
    stretch = bench.stretches[0]  # the phase counts from the first sample of each
    if not stretch.rests.size or math.isnan(held):
        return []
    rests = left(bench, stretch)
    lefts, levels = np.array([each[1] for each in rests]), np.array([each[2] for each in rests])
    time, x = stretch.time, stretch.measured['x']
    length, period = float(time[-1] - time[0]), float(np.median(np.diff(time)))
    frequencies = np.arange(SLOWEST, QUICKEST / period, FINENESS / length)
    if lefts.size < LEAST_LEFT or not frequencies.size:
        return []
    moments, ways = 0.5 * (time[lefts] + time[lefts - 1]), np.sign(x[lefts] - levels)
    angles = 2.0 * math.pi * frequencies[:, None] * (moments - time[0])
    line = np.exp(-1j * angles) @ ways
    top = int(np.argmax(np.abs(line)))
    # by chance the power of each frequency is exponential; they are some for each that differs
    if np.abs(line[top]) ** 2 / moments.size < LINE + math.log(FINENESS * frequencies.size):
        return []
    crest = float(np.angle(line[top])) + 0.5 * math.pi
    return [
        {
            f'{SHAKES}.amplitude': amplitude,
            f'{SHAKES}.frequency': float(frequencies[top]),
            f'{SHAKES}.phase': math.remainder(crest + early, 2.0 * math.pi),
            'f_s': held + share * amplitude,
        }
        for amplitude in AMPLITUDES
        for early in EARLY
        for share in CARRIED
    ]


def swings_seen(bench: Bench, residual: Array) -> tuple[float, ...]:
    """Return the frequencies at which a residual swings most, and their neighbours [Hz].

    `residual` of a signal over its noise, shape (n,).
    """
    period = float(np.median(np.diff(bench.stretches[0].time)))
    frequency, power = periodogram(np.clip(residual, -10.0, 10.0), 1.0 / period)
    inside = (frequency > 0.02) & (frequency < 0.45 / period)
    tops = frequency[inside][np.argsort(-power[inside])[:3]]
    return tuple(f + part * frequency[1] for f in tops for part in (-0.4, 0.0, 0.4))


def stops_seen(bench: Bench, results: Sequence[Array]) -> Starts:
    """Return starts of stops, hard and yielding: where the stem rests outermost, whatever p2 does.

    `results` as for `friction_seen`; none if p2 moves the stem there as it does elsewhere.
    """
    pairs = zip(bench.stretches, results, strict=True)
    each = [(s.rests, result[1] - s.rests) for s, result in pairs if s.rests.size]
    rests, force = np.concatenate([*each, np.empty((2, 0))], axis=1)
    known = np.isfinite(rests) & np.isfinite(force)
    rests, force = rests[known], force[known]
    if rests.size < LEAST_RESTS:
        return []
    outermost: dict[str, float] = {}
    hard: dict[str, float] = {}
    soft: dict[str, float] = {}
    there = np.zeros(rests.size, dtype=bool)
    for name, way, share in (('lower', -1.0, OUTERMOST), ('upper', 1.0, 1.0 - OUTERMOST)):
        level = float(np.quantile(rests, share, method='nearest'))
        near = np.abs(rests - level) < YIELDS
        if near.all():
            return []
        outermost[f'{STOPS}.{name}'] = level
        most = way * float(np.quantile((way * force)[~near], 0.995))
        pressed = near & (way * (force - most) > 0.0)
        if pressed.sum() < LEAST_PRESSED or (way * (force - most))[near].max() <= BEYOND:
            continue
        given, place = np.polyfit(force[pressed] - most, rests[pressed], 1)
        hard[f'{STOPS}.{name}'] = float(np.median(rests[pressed]))
        soft[f'{STOPS}.{name}'] = float(place)
        soft[f'{STOPS}.compliance'] = float(np.clip(given, 0.0, MOST_GIVEN))
        there |= near
    if not hard or there.all():
        return []
    low, high = np.quantile(force[~there], (0.005, 0.995))
    one_each = [{name: value} for name, value in hard.items()]
    # one that is never pressed hard enough to show may be where the stem rests outermost
    starts = [*one_each, outermost | hard, soft, outermost | soft]
    return [{**start, 'f_s': float(high - low) / 2.0} for start in starts]


def rests_show(bench: Bench, results: Sequence[Array]) -> bool:
    """Tell whether rests themselves show an effect: no chance makes slips depart from a law.

    `results` as for `friction_seen`.
    """
    held = friction_seen(bench, results)[0]
    drifts = drift_seen(bench, results).left < TOLD_BETTER
    return bool(stops_seen(bench, results) or drifts or shaken_seen(bench, held))


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
