# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One recording of one valve: commands, measured outputs, and where they come from."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import RecordingError
from .quality import Array, assess, MAX_GAP_PERIODS, Quality

OUTPUTS = ('p1', 'p2', 'x')
SIGNALS = ('u', *OUTPUTS)
UNASSESSED = Quality()


@dataclass(frozen=True)
class Provenance:
    """Where a recording comes from.

    Attributes
    ----------
    paths : tuple of str
        The files read.
    digests : mapping of str to str
        SHA-256 of each data file, by path.
    topics : mapping of str to str
        Topic, field, scale and offset (or CSV column) of each signal.
    time_source : str
        What the time axis is: 'received', 'sent' or 'header' stamps, a CSV column, or ''.
    start : int or None
        Stamp of time 0 [ns since the epoch], if known.
    storage : str
        'mcap', 'sqlite3', 'csv' or ''.
    reader : str
        Library and version that read it.
    comments : tuple of str
        Comment lines of the file.
    """

    paths: tuple[str, ...] = ()
    digests: Mapping[str, str] = field(default_factory=dict)
    topics: Mapping[str, str] = field(default_factory=dict)
    time_source: str = ''
    start: int | None = None
    storage: str = ''
    reader: str = ''
    comments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recording:
    """Commands and measured outputs of a valve on one time axis.

    All signals share `time`. The command is a zero-order hold: ``u[k]`` is the last command the
    valve had received when sample k was taken, and it holds until the next sample. An output
    that was lost, or that comes at a lower rate than the others, is NaN at that sample: nothing is
    ever interpolated. Where more than a few periods are missing altogether, `time` jumps and a
    new segment starts: a valve's state has to start afresh there.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds from 0, strictly increasing.
    u : ndarray, shape (n,)
        Command [% of span], finite everywhere.
    p1, p2, x : ndarray, shape (n,), or None
        Inlet pressure, chamber pressure, stem position [% of span]; None if not measured.
    provenance : Provenance
        Where it comes from.
    quality : Quality
        How well it was recorded; assessed from the arrays if not given.
    max_gap : float or None
        Longest step inside a segment [s]; by default five times the sample time.

    Raises
    ------
    RecordingError
        If the arrays do not match, time does not increase, or u is not finite.

    Notes
    -----
    The arrays are read-only copies.
    """

    time: Array
    u: Array
    p1: Array | None = None
    p2: Array | None = None
    x: Array | None = None
    provenance: Provenance = Provenance()
    quality: Quality = UNASSESSED
    max_gap: float | None = None

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        for name in ('time', *SIGNALS):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, _frozen(values, name))
        self._check()
        if self.quality is UNASSESSED:
            object.__setattr__(
                self, 'quality', assess(self.time, self._present(), self._longest_step)
            )

    def __len__(self) -> int:
        """Return the number of samples, lost ones included."""
        return int(self.time.size)

    @property
    def signals(self) -> tuple[str, ...]:
        """The measured outputs present, in the order p1, p2, x."""
        return tuple(name for name in OUTPUTS if getattr(self, name) is not None)

    @property
    def sample_time(self) -> float:
        """Median step of the time axis [s]; NaN for fewer than two samples."""
        return float(np.median(np.diff(self.time))) if len(self) > 1 else float('nan')

    @property
    def segments(self) -> list[slice]:
        """The runs of samples without a gap, in order."""
        ends = np.flatnonzero(np.diff(self.time) > self._longest_step) + 1
        bounds = [0, *ends.tolist(), len(self)]
        return [slice(a, b) for a, b in pairwise(bounds) if b > a]

    def output(self, name: str) -> Array:
        """Return the output `name`; RecordingError if it was not measured."""
        values = getattr(self, name) if name in OUTPUTS else None
        if values is None:
            raise RecordingError(
                f'{name} is not in this recording, which has {", ".join(self.signals) or "none"} '
                'of p1, p2, x'
            )
        assert isinstance(values, np.ndarray)
        return values

    def slice(self, start: float, stop: float) -> 'Recording':
        """Return the samples with ``start <= time < stop`` [s] as a recording of its own.

        Its time starts at 0 again; `provenance.start`, where known, moves with it. Its quality
        is assessed anew from the arrays.
        """
        first, last = np.searchsorted(self.time, [start, stop])
        if last <= first:
            raise RecordingError(
                f'no sample from {start:g} s to {stop:g} s: the recording lasts from 0 to '
                f'{self.time[-1]:g} s'
            )
        origin = float(self.time[first])
        known = self.provenance.start
        moved = None if known is None else known + round(origin * 1e9)
        arrays: dict[str, Any] = {
            name: values[first:last] for name, values in self._present().items()
        }
        return Recording(
            time=self.time[first:last] - origin,
            **arrays,
            provenance=replace(self.provenance, start=moved),
            max_gap=self._longest_step,
        )

    @property
    def _longest_step(self) -> float:
        """Longest step that is no gap [s]."""
        if self.max_gap is not None or len(self) < 2:
            return self.max_gap or float('inf')
        return (MAX_GAP_PERIODS + 0.5) * self.sample_time

    def _present(self) -> dict[str, Array]:
        """Return u and the outputs present."""
        return {name: getattr(self, name) for name in ('u', *self.signals)}

    def _check(self) -> None:
        """Raise a RecordingError if the arrays do not make a recording."""
        n = self.time.size
        for name, values in self._present().items():
            if values.size != n:
                raise RecordingError(
                    f'{name} has {values.size} values, time has {n}: expected as many'
                )
        if not np.isfinite(self.time).all():
            raise RecordingError('time is not finite everywhere: expected seconds from 0')
        backward = np.flatnonzero(np.diff(self.time) <= 0)
        if backward.size:
            k = int(backward[0])
            raise RecordingError(
                f'time does not increase from sample {k} ({self.time[k]:.9g} s) to {k + 1} '
                f'({self.time[k + 1]:.9g} s): expected strictly increasing seconds'
            )
        if n and self.time[0] != 0.0:
            raise RecordingError(f'time starts at {self.time[0]:.9g} s: expected 0')
        refuse_not_finite('u', self.u, self.time)


def refuse_not_finite(name: str, values: Array, time: Array) -> None:
    """Raise a RecordingError if any of `values` is NaN or infinite, saying where first."""
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        k = int(bad[0])
        raise RecordingError(
            f'{name} holds {bad.size} values that are NaN or infinite of {values.size}, the first '
            f'({values[k]}) at {time[k]:.6g} s (value {k}): expected finite numbers; '
            + advice_not_finite(name)
        )


def advice_not_finite(name: str) -> str:
    """Return what to do about values that are not finite."""
    if name == 'u':
        return 'correct the file, or read it with nan="lost" to hold the last good command'
    return 'correct the file, or read it with nan="lost" to treat them as lost samples'


def _frozen(values: npt.ArrayLike, name: str) -> Array:
    """Return a read-only vector of doubles."""
    array = np.array(values, dtype=np.float64)
    if array.ndim != 1:
        raise RecordingError(f'{name} has {array.ndim} dimensions: expected one')
    array.flags.writeable = False
    return array
