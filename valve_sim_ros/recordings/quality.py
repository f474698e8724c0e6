# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known about how well a recording was made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MAX_GAP_PERIODS = 5.0
"""More than this many periods without any output is a gap: a new segment starts behind it."""


@dataclass(frozen=True)
class SignalQuality:
    """How one signal arrived.

    Attributes
    ----------
    messages : int
        Values used.
    rate : float
        Median rate [1/s]; NaN if it cannot be told.
    lost : int
        Ticks at which a value was due and none came.
    duplicates, out_of_order, surplus, zero_stamps : int
        Exact repeats dropped; messages stored after a later one and sorted back; messages
        without a tick of their own, dropped; messages without a stamp, dropped.
    bursts : bool
        Whether it arrived in bursts; each message then got the time at which it was due.
    jitter : float
        Robust standard deviation of the stamps about the regular grid [s].
    offset : float
        Median stamp relative to the grid of the samples [s].
    resolution : float
        Smallest step between two different values [% of span]; NaN for a constant.
    """

    messages: int = 0
    rate: float = float('nan')
    lost: int = 0
    duplicates: int = 0
    out_of_order: int = 0
    surplus: int = 0
    zero_stamps: int = 0
    bursts: bool = False
    jitter: float = float('nan')
    offset: float = float('nan')
    resolution: float = float('nan')

    def text(self) -> str:
        """Return the figures in words, without those that do not apply."""
        parts = [f'{self.messages} values']
        if np.isfinite(self.rate):
            parts.append(f'{self.rate:.4g} per second')
        if np.isfinite(self.jitter):
            parts.append(f'jitter {milliseconds(self.jitter)}')
        if np.isfinite(self.offset):
            parts.append(f'offset {milliseconds(self.offset)}')
        if self.lost:
            share = 100 * self.lost / (self.lost + self.messages)
            parts.append(f'{self.lost} lost ({share:.2g} %)')
        for count, words in (
            (self.duplicates, 'exact duplicates dropped'),
            (self.out_of_order, 'out of order, sorted'),
            (self.surplus, 'without a tick of their own, dropped'),
            (self.zero_stamps, 'without a stamp, dropped'),
        ):
            if count:
                parts.append(f'{count} {words}')
        if self.bursts:
            parts.append('arrived in bursts, put at the times at which they were due')
        if np.isfinite(self.resolution):
            parts.append(f'resolution {self.resolution:.2g} %')
        return ', '.join(parts)


@dataclass(frozen=True)
class Gap:
    """A span without outputs: `start` and `stop` [s] on the recording's time axis."""

    start: float
    stop: float
    clock_jump: float = 0.0
    """Step of the recorder's clock here [s]; its true length is then unknown."""

    def text(self) -> str:
        """Return the gap in words."""
        if self.clock_jump:
            return (
                f'the clock jumped by {self.clock_jump:+.6g} s at {self.start:.6g} s; how much '
                'time passed there is unknown, the parts are kept apart'
            )
        return (
            f'nothing from {self.start:.6g} s to {self.stop:.6g} s; a command sent meanwhile is '
            'not known'
        )


@dataclass(frozen=True)
class Quality:
    """How well a recording was made.

    Attributes
    ----------
    samples : int
        Length of the time axis, lost samples included.
    period : float
        Sample time used [s].
    fitted_period : float
        The same as fitted to the stamps [s], before rounding to a nominal value.
    regular : bool
        Whether the stamps lie on a regular grid; if not, they are used as they are.
    jitter : float
        Robust standard deviation of the stamps about the grid [s].
    gaps : tuple of Gap
        Spans without outputs, each the end of a segment.
    signals : mapping of str to SignalQuality
        By signal, u included.
    head_trimmed : int
        Samples dropped because no command was known yet.
    doubtful_commands : tuple of int
        Samples with which commands begin that were sent so close to a tick that they may as well
        begin one sample earlier or later.
    lost_commands : tuple of int
        Samples without a command where nearly all have one: the one before is taken to hold.
    decided_commands : int
        Such commands whose sample the outputs themselves decided.
    command_offset : float
        How much later the outputs are stamped than u [s], always less than a sample.
    command_offset_range : tuple of float
        All offsets that explain the outputs as well [s]; NaN if the data cannot tell.
    dead_samples : int
        Whole samples by which the outputs answer later still: a dead time of the valve, which
        stays in the data.
    notes : tuple of str
        Anything else worth a sentence.
    """

    samples: int = 0
    period: float = float('nan')
    fitted_period: float = float('nan')
    regular: bool = True
    jitter: float = 0.0
    gaps: tuple[Gap, ...] = ()
    signals: Mapping[str, SignalQuality] = field(default_factory=dict)
    head_trimmed: int = 0
    doubtful_commands: tuple[int, ...] = ()
    lost_commands: tuple[int, ...] = ()
    decided_commands: int = 0
    command_offset: float = float('nan')
    command_offset_range: tuple[float, float] = (float('nan'), float('nan'))
    dead_samples: int = 0
    notes: tuple[str, ...] = ()

    @property
    def loss(self) -> float:
        """Share of the output values that are lost [%]."""
        outputs = [each for name, each in self.signals.items() if name != 'u']
        due = sum(each.lost + each.messages for each in outputs)
        return 100.0 * sum(each.lost for each in outputs) / due if due else 0.0

    def lines(self) -> list[str]:
        """Return the quality in words, one finding per line."""
        lines = [f'{self.samples} samples, one every {self.period:.6g} s']
        if not self.regular:
            lines.append('no regular grid fits the stamps: they are used as they are')
        elif abs(self.fitted_period - self.period) > 1e-7 * self.period:
            lines[0] += f' (the stamps say {self.fitted_period:.9g} s)'
        if self.jitter > 1e-4 * self.period:
            share = 100 * self.jitter / self.period
            lines[0] += f', jitter {milliseconds(self.jitter)} ({share:.2g} %)'
        if self.lost_commands:
            lines.append(
                f'u: {len(self.lost_commands)} samples without a command, the one before holds'
            )
        if self.loss:
            lines[0] += f', {self.loss:.2g} % lost'
        lines += [f'{name}: {each.text()}' for name, each in self.signals.items()]
        lines += [f'gap: {gap.text()}' for gap in self.gaps]
        if self.head_trimmed:
            lines.append(f'{self.head_trimmed} samples before the first command left out')
        lines += self._timing()
        if self.doubtful_commands:
            lines.append(
                f'{len(self.doubtful_commands)} commands lie so close to a sample that they may '
                'belong to its neighbour'
            )
        return lines + list(self.notes)

    def _timing(self) -> list[str]:
        """Return what is known about the time between u and the outputs, in words."""
        if not np.isfinite(self.command_offset):
            return []
        low, high = self.command_offset_range
        if np.isfinite(low):
            lines = [
                f'offset of the outputs against u: {milliseconds(self.command_offset)} (from '
                f'{milliseconds(low)} to {milliseconds(high)} fits as well)'
            ]
        else:
            lines = [
                f'offset of the outputs against u: {milliseconds(self.command_offset)} assumed, '
                'the data cannot tell'
            ]
        if self.dead_samples:
            lines.append(
                f'the outputs answer {self.dead_samples} samples later than stamps explain: a '
                'dead time of the valve'
            )
        if self.decided_commands:
            lines.append(
                f'{self.decided_commands} commands near a tick were put to the sample at which '
                'the outputs answer'
            )
        return lines


def milliseconds(seconds: float) -> str:
    """Return a short time in words."""
    if abs(seconds) >= 1.0:
        return f'{seconds:.4g} s'
    return f'{round(1e3 * seconds, 3) + 0.0:.3g} ms'


def roughness(parts: Sequence[Array]) -> float:
    """Return the noise of a signal in pieces [% of span] from its second differences, robustly.

    Lost samples (NaN) do not count; without any three in a row it is 0.
    """
    bends = np.concatenate([np.diff(part, 2) for part in parts])
    bends = np.abs(bends[np.isfinite(bends)])
    return float(np.median(bends)) / (0.6745 * np.sqrt(6.0)) if bends.size else 0.0


def resolution(values: Array) -> float:
    """Return the smallest step between two different values, NaN for a constant.

    Steps below 1e-9 of the range are rounding, not resolution.
    """
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    if steps.size == 0:
        return float('nan')
    real = steps[steps > 1e-9 * steps.sum()]
    return float(real.min()) if real.size else float('nan')


def gaps_of(time: Array, max_gap: float) -> tuple[Gap, ...]:
    """Return the spans longer than `max_gap` [s] between neighbouring times, shape (n,)."""
    return tuple(
        Gap(float(time[k]), float(time[k + 1])) for k in np.flatnonzero(np.diff(time) > max_gap)
    )


def assess(
    time: Array, signals: Mapping[str, Array], max_gap: float, notes: Sequence[str] = ()
) -> Quality:
    """Return the quality of data that share one time axis, as a CSV file does.

    Parameters
    ----------
    time : ndarray, shape (n,)
        [s]
    signals : mapping of str to ndarray, shape (n,)
        By name, u included; NaN where lost.
    max_gap : float
        Longest step that is no gap [s].
    notes : sequence of str
        Passed on.
    """
    steps = np.diff(time)
    period = float(np.median(steps)) if steps.size else float('nan')
    spread = 1.4826 * float(np.median(np.abs(steps - period))) if steps.size else 0.0
    return Quality(
        samples=time.size,
        period=period,
        fitted_period=period,
        jitter=spread if spread > 1e-9 * period else 0.0,
        gaps=gaps_of(time, max_gap),
        signals={
            name: SignalQuality(
                messages=int(np.isfinite(values).sum()),
                lost=int(np.isnan(values).sum()),
                resolution=resolution(values),
            )
            for name, values in signals.items()
        },
        notes=tuple(notes),
    )
