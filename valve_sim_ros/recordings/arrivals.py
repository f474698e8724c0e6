# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of each topic as they were stored, and what is put right before anything else.

Messages without a stamp go, exact repeats go, disorder is sorted. Where the recorder's clock was
set back, the recording is taken apart into epochs: sorting would weave two times into one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .grid import due
from .quality import Array, resolution, SignalQuality

Stamps = npt.NDArray[np.int64]
DETACHED = 10.0
"""A first stamp of 0 that lies so many median steps before the next one is no stamp."""
LATEST = 2**62
"""No stamp [ns since 1970] of this century is later."""
FEWEST_FOR_BURSTS = 20
SMALLEST_JUMP = 2.5
"""The clock can be seen to be set back by so many periods or more."""


@dataclass(frozen=True)
class Arrivals:
    """Receive stamps [ns] and values [% of span] of one topic in stored order, each shape (n,)."""

    stamps: Stamps
    values: Array

    def part(self, index: npt.NDArray[np.int64] | npt.NDArray[np.bool_] | slice) -> 'Arrivals':
        """Return some of the messages."""
        return Arrivals(self.stamps[index], self.values[index])


@dataclass(frozen=True)
class Epoch:
    """A span in which the recorder's clock ran forward.

    Attributes
    ----------
    signals : mapping of str to Arrivals
        Sorted by stamp.
    set_back : float
        How far the clock was set back before it [s]; 0 for the first epoch.
    """

    signals: Mapping[str, Arrivals]
    set_back: float = 0.0


def epochs(arrivals: Mapping[str, Arrivals]) -> tuple[list[Epoch], dict[str, SignalQuality]]:
    """Put the messages in order.

    Parameters
    ----------
    arrivals : mapping of str to Arrivals
        By signal, in stored order.

    Returns
    -------
    epochs : list of Epoch
        In stored order.
    counts : dict of str to SignalQuality
        What was found and done, by signal.
    """
    stamped, counts = {}, {}
    for name, each in arrivals.items():
        stamped[name], zeros = _without_zeros(each)
        counts[name] = SignalQuality(zero_stamps=zeros, resolution=resolution(each.values))
    found, set_back = [], 0.0
    outputs = [name for name in stamped if name != 'u'] or ['u']
    reference = max(outputs, key=lambda name: stamped[name].stamps.size)
    rest = stamped
    while True:
        jump = _set_back(rest[reference].stamps)
        if jump is None:
            break
        before, after = _split(rest, reference, jump)
        found.append(Epoch(before, set_back))
        stamps = rest[reference].stamps
        set_back, rest = float(stamps[:jump].max() - stamps[jump]) * 1e-9, after
    found.append(Epoch(rest, set_back))
    ordered = []
    for epoch in found:
        signals = {}
        for name, each in epoch.signals.items():
            signals[name], counts[name] = _in_order(each, counts[name])
            if name != 'u':
                signals[name], counts[name] = _without_bursts(signals[name], counts[name])
        ordered.append(replace(epoch, signals=signals))
    return ordered, {
        name: replace(count, rate=_rate([e.signals[name].stamps for e in ordered]))
        for name, count in counts.items()
    }


def _without_zeros(each: Arrivals) -> tuple[Arrivals, int]:
    """Drop nonsense, and stamps of 0 far from all others: the clock was not known yet."""
    zero = (each.stamps <= 0) | (each.stamps > LATEST)
    count = int(zero.sum())
    if not count or zero.all():
        return each, 0
    stamps = np.sort(each.stamps[~zero])
    step = float(np.median(np.diff(stamps))) if stamps.size > 1 else 0.0
    if count == 1 and stamps[0] <= DETACHED * step:
        return each, 0
    return each.part(~zero), count


def _set_back(stamps: Stamps) -> int | None:
    """Return the first index behind which the clock was set back, None if it never was.

    Where messages were merely stored late, the stamps before and behind the fall share one pass
    of time; where the clock was set back, that span was recorded twice.
    """
    steps = np.diff(stamps)
    forward = steps[steps > 0]
    if not forward.size:
        return None
    period = max(float(np.median(forward)), float(forward.mean()) / 3.0)
    for fall in np.flatnonzero(steps < -SMALLEST_JUMP * period):
        before, after = stamps[: fall + 1], stamps[fall + 1 :]
        first = max(before.min(), after[0])
        last = min(before.max(), after.max())
        if last < first and after.size > 1:
            return int(fall) + 1
        there = np.count_nonzero((before >= first) & (before <= last))
        again = np.count_nonzero((after >= first) & (after <= last))
        if there + again > 1.5 * (last - first) / period + 1:
            return int(fall) + 1
    return None


def _split(
    signals: Mapping[str, Arrivals], reference: str, jump: int
) -> tuple[dict[str, Arrivals], dict[str, Arrivals]]:
    """Split all signals where the reference signal's stamps fall at index `jump`."""
    top = signals[reference].stamps[:jump].max()
    bottom = signals[reference].stamps[jump]
    before, after = {}, {}
    for name, each in signals.items():
        falls = np.flatnonzero(np.diff(each.stamps) < -0.5 * (top - bottom)) + 1
        if name == reference:
            index = jump
        elif falls.size:
            index = int(falls[0])
        else:
            index = int(np.count_nonzero(each.stamps <= (top + bottom) // 2))
        before[name], after[name] = each.part(slice(index)), each.part(slice(index, None))
    return before, after


def _in_order(each: Arrivals, count: SignalQuality) -> tuple[Arrivals, SignalQuality]:
    """Sort by stamp, drop exact repeats, and count what was done."""
    late = int((np.diff(each.stamps) < 0).sum())
    if late:
        each = each.part(np.argsort(each.stamps, kind='stable'))
    together = np.diff(each.stamps) == 0
    same = together & (np.diff(each.values) == 0)
    # where most messages of one stamp differ, they are samples that were stamped in batches
    repeats = int(same.sum()) if 2 * same.sum() > together.sum() else 0
    if repeats:
        each = each.part(np.concatenate(([True], ~same)))
    return each, replace(
        count,
        messages=count.messages + each.stamps.size,
        duplicates=count.duplicates + repeats,
        out_of_order=count.out_of_order + late,
    )


def _without_bursts(each: Arrivals, count: SignalQuality) -> tuple[Arrivals, SignalQuality]:
    """Give messages that arrived in bursts the stamps at which they were due."""
    if each.stamps.size < FEWEST_FOR_BURSTS:
        return each, count
    seconds = np.asarray(1e-9 * (each.stamps - each.stamps[0]), dtype=np.float64)
    moved = due(seconds)
    if moved is seconds:
        return each, count
    shift = np.round(1e9 * (moved - seconds)).astype(np.int64)
    return replace(each, stamps=each.stamps + shift), replace(count, bursts=True)


def _rate(stamps: list[Stamps]) -> float:
    """Return the median rate [1/s], NaN if it cannot be told."""
    steps = np.concatenate([np.diff(each) for each in stamps])
    middle = float(np.median(steps)) if steps.size else 0.0
    return 1e9 / middle if middle > 0 else float('nan')
