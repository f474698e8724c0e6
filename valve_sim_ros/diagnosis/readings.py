# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a measured signal shows by itself, without a model beside it."""

from collections.abc import Callable, Iterable, Sequence
import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
import numpy.typing as npt
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar
from scipy.signal import find_peaks, periodogram

from ..model.pipeline import Array

FINEST, COARSEST, ON_STEPS, AS_WELL, BLURRED, MOST_STEPS = 0.1, 10.0, 0.6, 0.95, 0.5, 3
"""Steps of a coarse sensor [%], how well x keeps to them (1: as well as its noise lets it), others
that it keeps as well [share], the least that noise may leave of that, and how many are told."""
OFF, ALL, LEAST_STEP, LEAST_VALUES = 0.05, 0.99, 0.3, 4
"""How near to multiples of a coarse sensor's step [steps] nearly all x lie [share]; finer steps
[%] are a usual resolution, and fewer values may be chance."""
TINY = 1e-6
"""A finer resolution is that of the numbers [%]."""
BIN, LONG, WITHIN, AS_PLAIN = 0.01, 32, 0.5, 0.98
"""Bins in which x is counted [%], how much longer their spectrum is than the span; how near to its
peak a grid is sought [1 / range of x], and how nearly as well one through 0 must be kept."""
REST, FEW, CREEPS = 5, 8, 3.0
"""Samples over which two means agree while the stem rests, the fewest that show a pace, and how
far one drifts before it has surely moved if it moves when the record begins [noise]."""
NEAR, ALIKE = 15, 3.0
"""Samples on either side over which x is smoothed, those that differ by less than this [noise]."""
WIDTHS, MISFIT, RUN, BENT, BENDS = (3, 5, 9, 15, 31), 1.7, 3, 2.0, 5.0
"""Samples through which a line is laid, its largest mean square error [noise squared], of how many
samples in a row the mean error is looked at, how large it may be [its standard deviation], and
steps of the command beyond which x may bend [%]."""
LARGE, UNMOVED, ANSWERED = 16.0, 4.0, 0.5
"""A step of p1 that tells when it came; p1 has not moved yet; and part of it seen at once [noise,
noise, share]."""
FORESEEN, LEAST_SOON, LEAST_SHARE = 0.8, 3, 0.1
"""Part of a step of p1 that is seen before the command, if p1 foresees it; and so many such steps
at least, and as a share of all, are no chance."""
CREEP = 2.0
"""Between two lost commands one that creeps moves by no more than so many times its pace."""
TRAVEL, FURTHER, MOST_UNSETTLED = 8.0, 10, 0.1
"""A signal counts once it has travelled so far [%] and so many samples later, or after this share
of the record."""
HIGH, LEAST_LINES = 0.25, 32
"""From where on a spectrum tells noise [1 / sample], and frequencies that do."""
Mask = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.intp]


def between_lines(parts: Sequence[Array]) -> float:
    """Return the noise of a signal in pieces [% of span] from its spectrum between lines.

    A stem that is shaken swings at every sample. Infinite if there is too little of it.
    """
    bends = np.concatenate([np.diff(part, 2) for part in parts])
    frequency, power = periodogram(bends[np.isfinite(bends)], window='hann')
    high = frequency > HIGH
    if high.sum() < LEAST_LINES:
        return math.inf
    white = power[high] / (2.0 - 2.0 * np.cos(2.0 * np.pi * frequency[high])) ** 2
    return math.sqrt(float(np.median(white)) / (2.0 * math.log(2.0)))


def filled(values: Array) -> Array:
    """Return a signal with straight lines across what was lost."""
    known = np.flatnonzero(np.isfinite(values))
    if not known.size:
        return values
    return np.interp(np.arange(values.size), known, values[known])


def bridged(u: Array, lost: Rows) -> tuple[Array, Rows]:
    """Return commands of which some were `lost`, and the steps that may have come with one.

    Lost commands of one that creeps lie on a straight line.
    """
    sent, unsure = u.copy(), []
    for run in np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1) if lost.size else ():
        before, after = run[0] - 1, run[-1] + 1
        if before < 1 or after + 1 >= u.size or u[after] == u[before]:
            continue
        creep = max(abs(u[before] - u[before - 1]), abs(u[after + 1] - u[after]))
        if abs(u[after] - u[before]) <= CREEP * creep * (after - before):
            sent[run] = np.interp(run, [before, after], u[[before, after]])
        else:
            unsure.append(after)
    return sent, np.array(unsure, dtype=np.intp)


def smooth(x: Array, noise: float) -> Array:
    """Return x without most of its noise, slips kept: the sigma filter of Lee (1983)."""
    middle = median_filter(x, 3, mode='nearest')
    near = sliding_window_view(np.pad(x, NEAR, mode='edge'), 2 * NEAR + 1)
    alike = np.abs(near - middle[:, None]) < ALIKE * noise
    return np.where(alike, near, 0.0).sum(axis=1) / np.maximum(alike.sum(axis=1), 1)


def straightened(x: Array, u: Array, noise: float) -> Array:
    """Return x on the longest lines through it that its noise allows, its slips kept.

    A step of the command u may bend x. Like the choice of windows by Goldenshluger and Nemirovski
    (1997), but a line must fit all samples in its window.
    """
    bends = np.flatnonzero(np.abs(np.diff(u)) > BENDS) + 2
    return np.concatenate([_on_lines(part, noise) for part in np.split(x, bends)])


def _on_lines(x: Array, noise: float) -> Array:
    """Return x on the longest lines that fit."""
    smoothed, variance = x.copy(), np.ones(x.size)
    for width in (w for w in WIDTHS if w <= x.size):
        at = np.arange(width) - (width - 1) / 2.0
        near = sliding_window_view(x, width)
        mean, slope = near.mean(axis=1), near @ at / (at @ at)
        off = (near - mean[:, None] - slope[:, None] * at) / noise
        fits = (np.abs(off).max(axis=1) < ALIKE) & (np.mean(off**2, axis=1) < MISFIT)
        if width > RUN:
            mean_off = sliding_window_view(off, RUN, axis=1).mean(axis=2)
            fits &= np.abs(mean_off).max(axis=1) < BENT / np.sqrt(RUN)
        for place in (0, width // 2, width - 1):
            rows = place + np.flatnonzero(fits)
            own = 1.0 / width + at[place] ** 2 / (at @ at)
            better = own < variance[rows]
            rows = rows[better]
            smoothed[rows] = (mean + slope * at[place])[fits][better]
            variance[rows] = own
    return smoothed


def still(x: Array, noise: float) -> Mask:
    """Return where x has rested for a while: its last two means agree."""
    total = np.concatenate([[0.0], np.cumsum(x)])
    mean = (total[REST:] - total[:-REST]) / REST
    still = np.zeros(x.size, dtype=bool)
    still[2 * REST - 1 :] = np.abs(mean[REST:] - mean[:-REST]) < 2.0 * noise * np.sqrt(2.0 / REST)
    return still


def pace(x: Array, departed: int, noise: float) -> float:
    """Return how fast a stem moves when its record begins [% per sample], 0 if it rests.

    By the sample `departed` it has surely moved. If that is soon it may have slipped: one that
    creeps is on a straight line.
    """
    first = x[: max(departed, FEW)]
    at = np.arange(first.size)
    slope, level = np.polyfit(at, first, 1)
    bent = departed < FEW and np.mean((first - level - slope * at) ** 2) > MISFIT * noise**2
    return 0.0 if bent or abs(slope) * departed <= CREEPS * noise else float(slope)


def travelled(values: Array, far: float) -> int:
    """Return the first sample by which a signal is `far` from where it began; 0 if none is."""
    known = np.flatnonzero(np.isfinite(values))
    moved = np.abs(values[known] - values[known[:1]]) > far
    return int(known[np.argmax(moved)]) if moved.any() else 0


def forgets(values: Array, far: float) -> Mask:
    """Tell at which samples a signal does not show any more what was before its record.

    Plays and friction forget that as it travels; `far` is by how much it has surely moved.
    """
    first = travelled(values, max(TRAVEL, far)) + FURTHER
    return np.arange(values.size) >= min(first, int(MOST_UNSETTLED * values.size))


def wild(values: Array, limit: float) -> Mask:
    """Return which single values lie further than `limit` from neighbours that agree."""
    wild = np.zeros(values.size, dtype=bool)
    before, value, after = values[:-2], values[1:-1], values[2:]
    apart = np.abs(value - np.median([before, value, after], axis=0))
    wild[1:-1] = apart > np.maximum(limit, np.abs(after - before))
    return wild


def answers_to_steps(u: Array, p1: Array, noise: float) -> tuple[int, int]:
    """Return how many single steps of the command p1 shows a sample late, and at once."""
    moves = np.diff(u) != 0.0
    steps = np.flatnonzero(moves[:-1] & ~moves[1:])
    before, at, after = (p1[steps + k] for k in range(3))
    first, both = np.abs(at - before), np.abs(after - before)
    large = both > LARGE * noise
    late = large & (first < UNMOVED * noise)
    return int(late.sum()), int((large & (first > ANSWERED * both)).sum())


def foreseen(u: Array, p1: Array, noise: float, unsure: Rows) -> bool:
    """Tell whether p1 answers some single steps of the command before the sample that shows them.

    So it is where outputs were sampled, or stamped, later than the commands beside them. The steps
    at the samples `unsure` do not tell: their commands were lost.
    """
    moves = np.diff(u) != 0.0
    steps = np.flatnonzero(moves[1:-1] & ~moves[:-2] & ~moves[2:]) + 1
    steps = steps[~np.isin(steps + 1, unsure)]
    before, at, after = (p1[steps + k] for k in (-1, 0, 1))
    whole = np.abs(after - before)
    large = whole > LARGE * noise
    soon = large & (np.abs(at - before) > FORESEEN * whole)
    return bool(soon.sum() >= max(LEAST_SOON, LEAST_SHARE * large.sum()))


def grids_kept(x: Array, noise: float) -> tuple[tuple[float, float], ...]:
    """Return step and offset of grids to which x keeps but for noise, the coarsest first [%]."""
    x = x[(x >= 0.0) & (x < 100.0)]
    counts = np.histogram(x, round(100.0 / BIN), (0.0, 100.0))[0]
    # 1 where all x are a multiple of one over the frequency apart, near 0 where they are anywhere
    length = LONG * counts.size
    frequency = np.fft.rfftfreq(length, BIN)
    kept = np.abs(np.fft.rfft(counts, length)) / max(x.size, 1)
    clear = np.maximum(np.exp(-2.0 * (np.pi * noise * frequency) ** 2), BLURRED)
    kept = np.minimum(kept / clear, 1.0)
    inside = (frequency > 1.0 / COARSEST) & (frequency < 1.0 / FINEST)
    peaks = find_peaks(np.where(inside, kept, 0.0), height=ON_STEPS)[0]
    # halves of a step are kept as well as the step
    alike = peaks[kept[peaks] >= AS_WELL * kept[peaks].max(initial=0.0)]
    return tuple(_fitted_grid(x, rough) for rough in 1.0 / frequency[alike[:MOST_STEPS]])


def _fitted_grid(x: Array, step: float) -> tuple[float, float]:
    """Return step and offset of a grid as x tells: a spectrum of bins is not as sharp.

    The offset is 0 where that is as good.
    """

    def kept(frequency: float) -> complex:
        return complex(np.exp(2j * np.pi * frequency * x).mean())

    def best(share: Callable[[complex], float]) -> float:
        near = WITHIN / max(float(np.ptp(x)), step)
        bounds = 1.0 / step - near, 1.0 / step + near
        return float(
            minimize_scalar(
                lambda f: -share(kept(f)), bounds=bounds, method='bounded', options={'xatol': 1e-9}
            ).x
        )

    plain, any_phase = best(lambda turns: turns.real), best(abs)
    turns = kept(any_phase)
    if kept(plain).real >= AS_PLAIN * abs(turns):
        return 1.0 / plain, 0.0
    step = 1.0 / any_phase
    return step, step * (float(np.angle(turns)) / (2.0 * math.pi) % 1.0)


def resolution_of(values: Array) -> float:
    """Return the step on whose multiples all values lie [% of span], 0 if none or a coarse one."""
    known = np.unique(values[np.isfinite(values)])
    gaps = np.diff(known)
    step = float(gaps.min(initial=np.inf))
    if not TINY < step < LEAST_STEP:
        return 0.0
    parts = gaps / step
    return step if np.abs(parts - np.rint(parts)).max() < OFF else 0.0


def coarse_grid(x: Array, grids: Iterable[tuple[float, float]]) -> tuple[float, float]:
    """Return step and offset of the coarsest grid on which x lies [%], 0 if it may be anywhere."""
    found = 0.0, 0.0
    for step, offset in grids:
        lines = np.round((x - offset) / step)
        on_them = np.abs(x - offset - step * lines) < OFF * step
        if on_them.mean() >= ALL and np.unique(lines).size >= LEAST_VALUES:
            found = max(found, (step, offset))
    return found if found[0] >= LEAST_STEP else (0.0, 0.0)
