# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Un-stamped topics on one time axis: each message finds the sample of the valve it belongs to.

The valve publishes its outputs on a timer, so their receive stamps lie near a regular grid. The
grid is fitted robustly, each message goes to its tick, ticks without a message are lost (NaN) and
spans without any message are gaps. Nothing is interpolated. Where the recorder's clock was set
back and behind gaps, everything starts anew.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from .arrivals import Arrivals, Epoch, epochs
from .commands import Hold, hold
from .errors import RecordingError
from .grid import fit_grid, Grid, place, runs, typical_step
from .quality import Array, Gap, MAX_GAP_PERIODS, Quality, SignalQuality
from .recording import Provenance, Recording

__all__ = ['Arrivals', 'align']

SHORTEST_RUN = 5
"""Runs of fewer messages next to a longer one are strays."""


@dataclass(frozen=True)
class Stretch:
    """Samples between two gaps.

    Attributes
    ----------
    stamps : ndarray, shape (n,)
        Times of the samples on the recorder's clock [s].
    time : ndarray, shape (n,)
        The same on the nominal grid, from 0 [s].
    signals : dict of str to ndarray, shape (n,)
        Outputs; NaN where lost.
    epoch : int
        Which epoch it belongs to.
    """

    stamps: Array
    time: Array
    signals: dict[str, Array]
    epoch: int


def align(
    arrivals: Mapping[str, Arrivals],
    provenance: Provenance,
    notes: Sequence[str] = (),
    sample_time: float | None = None,
) -> Recording:
    """Put the messages of u and of the outputs on one time axis.

    Parameters
    ----------
    arrivals : mapping of str to Arrivals
        By signal, in stored order; u, and at least one output unless only u is wanted.
    provenance : Provenance
        Passed on, with the start added.
    notes : sequence of str
        Findings to pass on.
    sample_time : float, optional
        Period of the valve [s] if the outputs were recorded less often than it samples.

    Raises
    ------
    RecordingError
        If no sample has a command.
    """
    parts, found = epochs(arrivals)
    outputs = [name for name in arrivals if name != 'u']
    reference = max(outputs or ['u'], key=lambda name: found[name].messages)
    origin = int(parts[0].signals[reference].stamps[0])
    grids = _grids(parts, reference, origin, sample_time)
    main = max((grid for _, _, grid in grids), key=lambda grid: grid.ticks.size)
    period = sample_time or _nominal(main.period)
    stretches, strays = [], 0
    for number, stamps, grid in grids:
        if grid.ticks.size < SHORTEST_RUN < main.ticks.size:
            strays += grid.ticks.size
            continue
        stretches += _stretches(stamps, grid, period, main.regular, number)
    placed = _place_outputs(stretches, parts, outputs, main, origin)
    commands = _commands(stretches, parts, main, origin)
    return _joined(
        stretches,
        commands,
        Quality(
            period=period,
            fitted_period=main.period,
            regular=main.regular,
            jitter=main.jitter,
            signals={name: _figures(name, found[name], placed, commands) for name in arrivals},
            notes=(*notes, *_remarks(strays, found, reference, period, sample_time)),
        ),
        [epoch.set_back for epoch in parts],
        replace(provenance, start=origin),
    )


def _grids(
    parts: Sequence[Epoch], reference: str, origin: int, sample_time: float | None
) -> list[tuple[int, Array, Grid]]:
    """Return epoch, stamps [s] and grid of every run of the reference signal."""
    seconds = [_seconds(epoch.signals[reference], origin) for epoch in parts]
    longest = max(seconds, key=lambda each: each.size)
    step = typical_step(longest)
    found = []
    for number, stamps in enumerate(seconds):
        for part in runs(stamps, step) if stamps.size else ():
            grid = fit_grid(stamps[part], sample_time or step, fixed=sample_time is not None)
            found.append((number, stamps[part], grid))
    return found


def _stretches(
    stamps: Array, grid: Grid, period: float, regular: bool, epoch: int
) -> list[Stretch]:
    """Return the samples of one run; all ticks are samples, those in holes excepted."""
    if not regular:
        stamps = np.unique(stamps)
        return [Stretch(stamps, stamps - stamps[0], {}, epoch)]
    rows = np.arange(grid.ticks[-1] + 1)
    for k in np.flatnonzero(np.diff(grid.ticks) > max(MAX_GAP_PERIODS, _stride(grid))):
        rows = rows[(rows <= grid.ticks[k]) | (rows >= grid.ticks[k + 1])]
    bounds = [0, *(np.flatnonzero(np.diff(rows) > 1) + 1).tolist(), rows.size]
    return [
        Stretch(grid.start + grid.period * rows[a:b], (rows[a:b] - rows[a]) * period, {}, epoch)
        for a, b in pairwise(bounds)
    ]


def _stride(grid: Grid) -> float:
    """Return how many ticks lie between two messages, with room for a few lost ones."""
    steps = np.diff(grid.ticks)
    return MAX_GAP_PERIODS * float(np.median(steps)) if steps.size else MAX_GAP_PERIODS


def _place_outputs(
    stretches: Sequence[Stretch],
    parts: Sequence[Epoch],
    outputs: Sequence[str],
    main: Grid,
    origin: int,
) -> dict[str, tuple[int, int, float]]:
    """Fill the stretches; return, by signal, lost and surplus messages and the offset [s]."""
    result = {}
    for name in outputs:
        used, lost, offsets = 0, 0, []
        for stretch in stretches:
            each = parts[stretch.epoch].signals[name]
            seconds = _seconds(each, origin)
            low, high = np.searchsorted(
                seconds, [stretch.stamps[0] - main.period / 2, stretch.stamps[-1] + main.period]
            )
            rows, offset = _rows(seconds[low:high], stretch.stamps, main)
            column = np.full(stretch.stamps.size, np.nan)
            inside = (rows >= 0) & (rows < column.size)
            column[rows[inside]] = each.values[low:high][inside]
            stretch.signals[name] = column
            there = np.flatnonzero(np.isfinite(column))
            used += there.size
            stride = max(float(np.median(np.diff(there))), 1.0) if there.size > 1 else 1.0
            lost += round((column.size - 1) / stride) + 1 - there.size
            if there.size:
                offsets.append(offset)
        total = sum(epoch.signals[name].stamps.size for epoch in parts)
        late = float(np.median(offsets)) if offsets else float('nan')
        result[name] = (max(lost, 0), total - used, late)
    return result


def _rows(stamps: Array, ticks: Array, main: Grid) -> tuple[np.ndarray, float]:
    """Return the sample of each message, and how late its topic is stamped [s]."""
    if not stamps.size:
        return np.empty(0, dtype=np.int64), float('nan')
    if not main.regular:
        right = np.clip(np.searchsorted(ticks, stamps), 1, max(ticks.size - 1, 1))
        right = np.minimum(right, ticks.size - 1)
        left = np.maximum(right - 1, 0)
        nearest = np.where(stamps - ticks[left] <= ticks[right] - stamps, left, right)
        return nearest, float(np.median(stamps - ticks[nearest]))
    start, offset = float(ticks[0]), 0.0
    for _ in range(2):
        rows = place(stamps, start + offset, main.period)
        offset += float(np.median(stamps - start - offset - main.period * rows))
    return rows, offset


def _commands(
    stretches: Sequence[Stretch], parts: Sequence[Epoch], main: Grid, origin: int
) -> Hold:
    """Return the command in force at each sample of all stretches, one after the other."""
    # epochs are laid one behind the other, so that all commands speak on the offset
    shift, shifts = 0.0, []
    for epoch in parts:
        stamps = [each.stamps for each in epoch.signals.values() if each.stamps.size]
        first = min(int(each[0]) for each in stamps)
        last = max(int(each[-1]) for each in stamps)
        shifts.append(shift - (first - origin) * 1e-9)
        shift += (last - first) * 1e-9 + 1000.0 * main.period
    return hold(
        np.concatenate(
            [_seconds(e.signals['u'], origin) + s for e, s in zip(parts, shifts, strict=True)]
        ),
        np.concatenate([epoch.signals['u'].values for epoch in parts]),
        np.concatenate([each.stamps + shifts[each.epoch] for each in stretches]),
        {
            name: np.concatenate([each.signals[name] for each in stretches])
            for name in stretches[0].signals
        },
        main.period,
        main.jitter,
    )


def _joined(
    stretches: Sequence[Stretch],
    commands: Hold,
    quality: Quality,
    set_back: Sequence[float],
    provenance: Provenance,
) -> Recording:
    """Lay the stretches one behind the other, without the samples before the first command."""
    period = quality.period
    max_gap = (MAX_GAP_PERIODS + 0.5) * period
    if not quality.regular:
        max_gap = max(max_gap, *(float(np.diff(s.time).max(initial=0.0)) for s in stretches))
    times, gaps, end = [stretches[0].time], [], float(stretches[0].time[-1])
    for before, after in pairwise(stretches):
        jumped = after.epoch != before.epoch
        pause = float(after.stamps[0] - before.stamps[-1])
        if jumped or pause <= max_gap:
            pause = 2.0 * max_gap
        elif quality.regular and abs(pause / period - round(pause / period)) < 0.25:
            pause = round(pause / period) * period
        step = -set_back[after.epoch] if jumped else 0.0
        gaps.append(Gap(end, end + pause, step))
        times.append(end + pause + after.time)
        end = float(times[-1][-1])
    time = np.concatenate(times)
    known = np.isfinite(commands.command)
    if not known.any():
        raise RecordingError(
            'every command comes behind the last sample: record u and the outputs together'
        )
    head = int(np.argmax(known))
    start = provenance.start or 0
    rows = commands.doubtful[commands.doubtful < time.size] - head
    first = float(np.concatenate([each.stamps for each in stretches])[head])
    return Recording(
        time=time[head:] - time[head],
        u=commands.command[head:],
        **{
            name: np.concatenate([each.signals[name] for each in stretches])[head:]
            for name in stretches[0].signals
        },
        provenance=replace(provenance, start=start + round(first * 1e9)),
        quality=replace(
            quality,
            samples=time.size - head,
            gaps=tuple(
                replace(gap, start=gap.start - time[head], stop=gap.stop - time[head])
                for gap in gaps
                if gap.start >= time[head]
            ),
            head_trimmed=head,
            doubtful_commands=tuple((rows[rows > 0]).tolist()),
            lost_commands=tuple((commands.lost[commands.lost >= head] - head).tolist()),
            decided_commands=commands.decided,
            command_offset=commands.offset,
            command_offset_range=commands.offset_range,
            dead_samples=commands.dead_samples,
        ),
        max_gap=max_gap,
    )


def _figures(
    name: str, found: SignalQuality, placed: Mapping[str, tuple[int, int, float]], commands: Hold
) -> SignalQuality:
    """Complete the figures of one signal."""
    if name == 'u':
        return replace(found, offset=-commands.offset)
    lost, surplus, offset = placed[name]
    return replace(found, lost=lost, surplus=surplus, offset=offset)


def _remarks(
    strays: int,
    found: Mapping[str, SignalQuality],
    reference: str,
    period: float,
    sample_time: float | None,
) -> list[str]:
    """Return what else is worth a sentence."""
    remarks = []
    if strays:
        remarks.append(f'{strays} messages with stamps far from all others left out')
    if sample_time is None and reference != 'u' and found['u'].rate * period > 1.5:
        remarks.append(
            f'u comes {found["u"].rate * period:.2g} times as often as the outputs: if the valve '
            'samples faster than it was recorded, give its sample time'
        )
    return remarks


def _seconds(each: Arrivals, origin: int) -> Array:
    """Return stamps in seconds from `origin` [ns]."""
    return np.asarray((each.stamps - origin) * 1e-9, dtype=np.float64)


def _nominal(period: float) -> float:
    """Return the round number behind a fitted period, if it is within 0.2 %."""
    for digits in (1, 2, 3):
        nominal = float(f'{period:.{digits}g}')
        if abs(nominal - period) <= 2e-3 * period:
            return nominal
    return period
