# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a record shows beside the run of a base valve: friction, calibration, arrivals."""

from collections.abc import Sequence
import math

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import periodogram

from ..model.drift import drifted
from ..model.effects.dwell_friction import SHAPES
from ..model.pipeline import Array
from .bench import Bench
from .readings import answers_to_steps
from .starts import Starts
from .stretch import Stretch

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
DWELL, DWELLS, SCATTER = 'dwell_friction', tuple(np.geomspace(0.5, 200.0, 16).tolist()), 0.2
"""The effect, time constants that are tried [s], and how far what holds the stem scatters [%]."""
DRIFT, WANDER = 'friction_drift', 'sensor_drift'
SETTLINGS, TOLD_BETTER, AS_WELL = (0.0, *np.geomspace(2.0, 40.0, 8).tolist()), 0.5, 1.3
"""The effects, rates at which they settle that are tried [1/h], the part of what scatters that
one leaves at most that is told by rests alone, and up to how many times the least another rate
may leave."""
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
LEAST_LEFT, LEAVES = 6, 4.0
"""Rests that show friction which grows, and how far a stem is away that has left one [noise]."""


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


def dwell_seen(bench: Bench, results: Sequence[Array]) -> Starts:
    """Return starts of a friction that grows with the time at rest, one of each form of its law.

    From what holds the stem when it leaves each rest: static friction and growth are straight in
    it, the time constant is tried. `results` as for `friction_seen`; none if rests are few.
    """
    pairs = zip(bench.stretches, results, strict=True)
    each = [_rests(bench, s, result) for s, result in pairs]
    rest, force, _, way = np.concatenate([*each, np.empty((0, 4))]).T
    force = way * force
    if rest.size < LEAST_LEFT:
        return []
    found = []
    for shape in SHAPES:
        best, least = {}, math.inf
        for time_constant in DWELLS:
            part = rest / time_constant
            grown = 1.0 - ((1.0 + shape * part) ** (-1.0 / shape) if shape else np.exp(-part))

            def missing(level: Array, grown: Array = grown) -> Array:
                return level[0] + level[1] * grown - force

            fit = least_squares(missing, (np.median(force), 0.0), loss='cauchy', f_scale=SCATTER)
            f_s, more = fit.x
            if fit.cost < least and f_s > 0.0 and more > 0.0:
                least = fit.cost
                values = {'growth': more / f_s, 'time_constant': time_constant, 'shape': shape}
                best = {'f_s': f_s, **{f'{DWELL}.{name}': v for name, v in values.items()}}
        found += [best] if best else []
    return found


def drift_seen(
    bench: Bench, results: Sequence[Array], effect: str = DRIFT, scatters: float = 1.0
) -> Starts:
    """Return starts of a friction or a sensor that drifts, at least one for each form of the law.

    From what holds the stem when it leaves each rest: it is straight in the drift, how soon that
    settles is tried. Friction holds it against its way, a sensor shows more or less either way.
    `results` as for `friction_seen`; none if more than a part of what scatters is left.
    """
    # each stretch begins anew
    _, force, time, way = _rests(bench, bench.stretches[0], results[0]).T
    if force.size < LEAST_LEFT:
        return []
    turned = way if effect == DRIFT else -np.ones(force.size)

    def fitted(grown: Array) -> tuple[float, float, float]:
        """Return static friction, the change with what is grown, and what scatters."""

        def missing(level: Array) -> Array:
            return level[0] + way * level[1] + turned * level[2] * grown - force

        start = (np.median(force), 0.5 * np.ptp(force), 0.0)
        fit = least_squares(missing, start, loss='cauchy', f_scale=SCATTER)
        return float(fit.x[1]), float(fit.x[2]), float(fit.cost)

    constant = fitted(np.zeros(time.size))[2]
    found = []
    for some in (SETTLINGS[:1], SETTLINGS[1:]):
        laws = [(*fitted(np.array([drifted(t, k) for t in time])), k) for k in some]
        laws.sort(key=lambda law: law[2])
        least = laws[0][2]
        for f_s, more, left_over, settling in laws if least < scatters * constant else ():
            # few rests hardly tell how soon it settles
            if f_s > 0.0 and left_over <= AS_WELL * least:
                rate = more / f_s if effect == DRIFT else more
                values = {f'{effect}.rate': rate, f'{effect}.settling': settling}
                found.append({'f_s': f_s, **values})
    return found


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
    left = _left(bench, stretch)
    lefts, levels = np.array([each[1] for each in left]), np.array([each[2] for each in left])
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
    drifts = drift_seen(bench, results, scatters=TOLD_BETTER)
    return bool(stops_seen(bench, results) or drifts or shaken_seen(bench, held))


def _left(bench: Bench, stretch: Stretch) -> list[tuple[int, int, float]]:
    """Return each rest's first sample, 0 if unknown, the one that has left it, and its level."""
    x, near = stretch.measured['x'], LEAVES * bench.noise['x']
    known = np.isfinite(stretch.rests).astype(int)
    edges = np.flatnonzero(np.diff(known, prepend=0, append=0))
    found: dict[int, tuple[int, int, float]] = {}
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        level = float(np.median(stretch.rests[begin:end]))
        away = np.flatnonzero(np.abs(x - level) > near)  # where lost, x is not away
        before, after = away[away < begin], away[away >= end]
        if after.size:
            first = int(before[-1]) + 1 if before.size else 0
            found[first] = first, int(after[0]), level
    return list(found.values())


def _rests(bench: Bench, stretch: Stretch, result: Array) -> Array:
    """Return how long each rest lasted, what then held the stem, when, and its way, shape (n, 4).

    In s, % of span (positive if the stem is pushed open), s since the first sample, 1 if it opens
    and -1 if it closes.
    """
    near, time = LEAVES * bench.noise['x'], stretch.time
    found = []
    for first, left, level in _left(bench, stretch) if stretch.rests.size else []:
        last = float(result[1, left - 1 : left + 1].mean())
        # nobody knows how long the first rest lasts; and a stem may creep with p2
        if first and abs(last - result[1, first]) > 2.0 * near:
            way = np.sign(stretch.measured['x'][left] - level)
            found.append((time[left] - time[first], last - level, time[left] - time[0], way))
    return np.array(found).reshape(-1, 4)


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
