# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Un-stamped topics on one time axis: each message finds the tick of the valve it belongs to.

The valve publishes its outputs on a timer, so their receive stamps lie near a regular grid. The
grid is fitted robustly, each message goes to its tick, ticks without a message are lost (NaN) and
spans without any message are gaps. Nothing is interpolated. A sample's command is the last one
received no later than the sample's own stamp.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .quality import Array, Gap, gaps_of, MAX_GAP_PERIODS, Quality, resolution, SignalQuality
from .recording import Provenance, Recording

Stamps = npt.NDArray[np.int64]
LARGEST_JITTER = 0.25
"""Above this share of the period no grid is claimed: stamps are used as they are."""
AMBIGUOUS = 1e-3
"""Commands stamped so close to a sample [s] may have been used one sample earlier or later."""


@dataclass(frozen=True)
class Arrivals:
    """Receive stamps [ns] and values [% of span] of one topic, each shape (n,)."""

    stamps: Stamps
    values: Array


def align(arrivals: Mapping[str, Arrivals], provenance: Provenance) -> Recording:
    """Put the messages of u and of the outputs on one time axis.

    Parameters
    ----------
    arrivals : mapping of str to Arrivals
        By signal; u and at least one output.
    provenance : Provenance
        Passed on, with the start added.
    """
    ordered, counts = {}, {}
    for name, each in arrivals.items():
        ordered[name], counts[name] = _in_order(each)
    outputs = [name for name in ordered if name != 'u']
    reference = max(outputs or ['u'], key=lambda name: ordered[name].stamps.size)
    origin = int(ordered[reference].stamps[0])
    seconds: dict[str, Array] = {
        name: np.asarray((each.stamps - origin) * 1e-9, dtype=np.float64)
        for name, each in ordered.items()
    }
    ticks, fitted, jitter = _grid(seconds[reference])
    regular = jitter <= LARGEST_JITTER * fitted
    period = _nominal(fitted)
    if not regular:
        ticks = np.arange(seconds[reference].size)
    rows = _rows(ticks)
    stamps = np.interp(rows, ticks, seconds[reference])
    time = (rows - rows[0]) * period if regular else stamps
    signals, found = {}, {}
    for name in outputs:
        column, surplus, offset = _place(seconds[name], ordered[name].values, stamps, fitted)
        signals[name] = column
        found[name] = replace(
            counts[name], surplus=surplus, offset=offset, lost=int(np.isnan(column).sum())
        )
    command, shift, ambiguous = _hold(seconds['u'], ordered['u'].values, stamps)
    found['u'] = replace(counts['u'], offset=shift)
    head = int(np.argmax(np.isfinite(command)))
    kept = slice(head, None)
    max_gap = (MAX_GAP_PERIODS + 0.5) * period
    time = time[kept] - time[head]
    gaps: tuple[Gap, ...] = gaps_of(time, max_gap)
    return Recording(
        time=time,
        u=command[kept],
        **{name: values[kept] for name, values in signals.items()},
        provenance=replace(provenance, start=origin + round(float(stamps[head]) * 1e9)),
        quality=Quality(
            samples=time.size,
            period=period,
            fitted_period=fitted,
            regular=bool(regular),
            jitter=jitter,
            gaps=gaps,
            signals=found,
            head_trimmed=head,
            ambiguous_commands=ambiguous,
        ),
        max_gap=max_gap,
    )


def _in_order(each: Arrivals) -> tuple[Arrivals, SignalQuality]:
    """Sort by stamp, drop exact duplicates, and count what was done."""
    late = int((np.diff(each.stamps) < 0).sum())
    order = np.argsort(each.stamps, kind='stable')
    stamps, values = each.stamps[order], each.values[order]
    same = np.zeros(stamps.size, dtype=bool)
    same[1:] = (np.diff(stamps) == 0) & (np.diff(values) == 0)
    stamps, values = stamps[~same], values[~same]
    steps = np.diff(stamps)
    rate = 1e9 / float(np.median(steps)) if steps.size and np.median(steps) > 0 else float('nan')
    return Arrivals(stamps, values), SignalQuality(
        messages=stamps.size,
        rate=rate,
        duplicates=int(same.sum()),
        out_of_order=late,
        resolution=resolution(values),
    )


def _grid(stamps: Array) -> tuple[npt.NDArray[np.int64], float, float]:
    """Return the tick of each stamp, the fitted period [s] and the robust jitter [s]."""
    period = float(np.median(np.diff(stamps)))
    if period <= 0.0:
        period = float(stamps[-1] - stamps[0]) / max(stamps.size - 1, 1) or 1.0
    ticks = np.arange(stamps.size)
    for _ in range(5):
        # steps are rounded one by one, so that an error of the period does not add up
        steps = np.maximum(np.rint(np.diff(stamps) / period), 0).astype(np.int64)
        ticks = np.concatenate(([0], np.cumsum(steps)))
        slope, start = np.polyfit(ticks, stamps, 1) if ticks[-1] else (period, 0.0)
        ticks = np.rint((stamps - start) / slope).astype(np.int64)
        if abs(slope - period) <= 1e-9 * period:
            break
        period = float(slope)
    ticks = np.maximum.accumulate(ticks - np.arange(ticks.size)) + np.arange(ticks.size)
    slope, start = np.polyfit(ticks, stamps, 1)
    errors = stamps - start - slope * ticks
    jitter = 1.4826 * float(np.median(np.abs(errors - np.median(errors))))
    return ticks - ticks[0], float(slope), jitter


def _nominal(period: float) -> float:
    """Return the round number behind a fitted period, if it is within 0.2 %."""
    for digits in (1, 2, 3):
        nominal = float(f'{period:.{digits}g}')
        if abs(nominal - period) <= 2e-3 * period:
            return nominal
    return period


def _rows(ticks: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return all ticks from first to last, without those inside gaps."""
    rows = np.arange(ticks[0], ticks[-1] + 1)
    steps = np.diff(ticks)
    for k in np.flatnonzero(steps > MAX_GAP_PERIODS):
        rows = rows[(rows <= ticks[k]) | (rows >= ticks[k + 1])]
    return rows


def _place(stamps: Array, values: Array, ticks: Array, period: float) -> tuple[Array, int, float]:
    """Give each value the nearest tick; return the column, the surplus and the offset [s]."""
    nearest = _nearest(ticks, stamps)
    offset = float(np.median(stamps - ticks[nearest]))
    nearest = _nearest(ticks, stamps - offset)
    column = np.full(ticks.size, np.nan)
    near = np.abs(stamps - offset - ticks[nearest]) < period
    used = np.unique(nearest[near])
    column[nearest[near][::-1]] = values[near][::-1]
    return column, int(stamps.size - used.size), offset


def _nearest(ticks: Array, stamps: Array) -> npt.NDArray[np.int64]:
    """Return the index of the tick nearest to each stamp."""
    right = np.clip(np.searchsorted(ticks, stamps), 1, ticks.size - 1)
    left_is_nearer = stamps - ticks[right - 1] <= ticks[right] - stamps
    return (right - left_is_nearer).astype(np.int64)


def _hold(stamps: Array, values: Array, ticks: Array) -> tuple[Array, float, int]:
    """Return the command in force at each tick, its usual lead [s] and the doubtful ones."""
    index = np.searchsorted(stamps, ticks, side='right') - 1
    command = np.where(index >= 0, values[np.maximum(index, 0)], np.nan)
    following = np.searchsorted(ticks, stamps)
    used = following < ticks.size
    lead = ticks[following[used]] - stamps[used]
    distance = np.abs(stamps - ticks[_nearest(ticks, stamps)])
    changed = np.diff(values, prepend=np.nan) != 0
    ambiguous = int(((distance < AMBIGUOUS) & (distance > 0) & changed).sum())
    return command, float(np.median(lead)) if lead.size else float('nan'), ambiguous
