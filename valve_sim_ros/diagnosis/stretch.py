# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run of samples without a gap, and the grids on which the compiled model runs beside it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..model.pipeline import Array
from ..recordings.recording import OUTPUTS
from .interleaving import interleaved, Rows, spread
from .pushing import finer
from .readings import filled

KEPT_GRIDS = 60
RESTS, SOON, CAUGHT, ON_TIME = 'x', 'x caught soon', 'x caught', 'x caught on time'
HELD = 'x held'
"""Drives by which a stem is put where it was measured: whenever that rests; only where it is half
a slip or so from there; only where it is far from there, which leaves a right valve alone; the
same, while slips must come at the right moment; and at every moment."""
PUT_TO_REST = {RESTS, SOON, CAUGHT, ON_TIME}
MODELLED, FINELY = 'p2 modelled', 'finely'
"""Drives by which the chamber receives what leads p2 where the effects found before it lead it:
they need not run again with every stem; and by which a held stem moves between samples as well."""
STEM = OUTPUTS.index('x')
EARLIEST, LATEST = -0.9999, 0.999
"""By how much a command came sooner than the sample that shows it, at least and most [periods]."""
MOVES = 4.0
"""What begins by more than this within two samples moves [noise]."""


class Grid(NamedTuple):
    """A stretch as the compiled model receives it: m samples and changes of the command.

    u, dt, nothing have shape (m,), forced (3, m), rows (n,); targets and scales hold (m,) per
    signal.
    """

    u: Array
    dt: Array
    rows: Rows
    forced: Array
    targets: dict[str, Array]
    scales: dict[str, Array]
    nothing: Array


@dataclass
class Stretch:
    """A run of samples without a gap, shape (n,) each; outputs are NaN where lost.

    `counts` are the measured outputs where they count, `noise` their uncertainty, `rests` x
    where it rests. `begins` is x until the stem first moves, and p1 until it counts: nobody knows
    what was before the record, plays and friction remember it, and so the valve receives those as
    measured. `speed` is that of a stem that moves at the beginning [%/s], `held` is x smoothed
    between its slips. `shown` are the commands of the recording, where `u` are those that the
    valve is taken to have received; nobody knows whether the steps at the samples `unsure` came
    with a command that was lost just before. `sooner` is by how much sooner than the others the
    command of a sample came [periods]. `alone` are signals that no stage tells, without gaps,
    and their slopes [%/s].
    """

    time: Array
    u: Array
    measured: dict[str, Array]
    counts: dict[str, Array] = field(default_factory=dict)
    noise: dict[str, Array] = field(default_factory=dict)
    rests: Array = field(default_factory=lambda: np.empty(0))
    begins: dict[str, Array] = field(default_factory=dict)
    speed: float = 0.0
    held: Array = field(default_factory=lambda: np.empty(0))
    unsure: Rows = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    sooner: Array = field(default_factory=lambda: np.empty(0))
    alone: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    _grids: dict[Any, Grid] = field(default_factory=dict)
    _samples: dict[tuple[str, ...], Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Keep the commands as the recording shows them."""
        self.shown, self.sooner = self.u, np.zeros(self.u.size)

    @cached_property
    def first(self) -> dict[str, float]:
        """Each output at the beginning, that of the signal before it where not measured."""
        found, fallback = {}, float(self.u[0])
        for name in OUTPUTS:
            if name in self.measured:
                known = self.measured[name][np.isfinite(self.measured[name])]
                fallback = (
                    _beginning(known, float(self.noise[name].min())) if known.size else fallback
                )
            found[name] = fallback
        return found

    def grid(
        self, phase: float, drive: tuple[str, ...], blend: float = 0.0, lead: float = 0.0
    ) -> Grid:
        """Return the stretch with the commands moved by a share of a period.

        With `phase` > 0 a change of u that the recording shows at a sample came that share of a
        period earlier, with `phase` < 0 later. A command that goes on and on may be late by the
        share `blend` of a period: what the valve then receives lies between two samples. Its
        changes come by the share `lead` sooner than steps: it goes on between samples, too.
        """
        key = round(phase, 4), drive, round(blend, 4), round(lead, 4)
        return self._kept(key, lambda: self._moved(*key))

    def behind(self, grid: Grid, key: tuple[Any, ...], inlet: Callable[[], Array]) -> Grid:
        """Return a grid on which the chamber receives another inlet pressure, shape (m,).

        `key` tells what that and the grid depend on.
        """

        def driven() -> Grid:
            forced = grid.forced.copy()
            forced[OUTPUTS.index('p1')] = inlet()
            return grid._replace(forced=forced)

        return self._kept(key, driven)

    def _kept(self, key: tuple[Any, ...], make: Callable[[], Grid]) -> Grid:
        """Return a grid, made if it is not kept."""
        found = self._grids.get(key)  # other threads may clear them meanwhile
        if found is None:
            if len(self._grids) > KEPT_GRIDS:
                self._grids.clear()
            found = self._grids[key] = make()
        return found

    def recount(self, counts: Mapping[str, Array]) -> None:
        """Replace what counts."""
        self.counts = dict(counts)
        self._samples.clear()
        self._grids.clear()

    def send(self, u: Array) -> None:
        """Let the valve receive other commands than the recording shows."""
        self.u = u
        self._grids.clear()

    def scatter(self, steps: Rows, sooner: Array) -> None:
        """Let steps of the command come sooner or later than the others [periods]."""
        self.sooner = np.zeros(self.u.size)
        self.sooner[steps] = sooner
        self._grids.clear()

    def put(self, steps: Rows, sooner: bool) -> None:
        """Let steps of the command come a sample earlier or later, unseen in p1 there."""
        self.hide(steps - sooner)
        self.send(shifted(self.u, steps, sooner))

    def hide(self, rows: Rows) -> None:
        """Let p1 say nothing where it answers the commands of some samples, at once or next."""
        self._samples.clear()
        self._grids.clear()
        rows = np.concatenate([rows, rows + 1])
        for each in (self.measured, self.counts):
            if 'p1' in each:
                each['p1'] = each['p1'].copy()
                each['p1'][rows[rows < self.time.size]] = np.nan

    def stand_alone(self, name: str) -> None:
        """Let only what was measured of a signal drive what follows, between samples as well.

        The stage before it would tell lost samples wrongly.
        """
        whole = filled(self.measured[name])
        slopes = np.diff(whole) / np.diff(self.time)
        before, after = np.append(0.0, slopes), np.append(slopes, 0.0)
        least = np.sign(after) * np.minimum(np.abs(before), np.abs(after))
        self.alone[name] = whole, np.where(before * after > 0.0, least, 0.0)
        self._grids.clear()

    def _alone(self, name: str, now: Array, u: Array, rows: Rows) -> Array:
        """Return a signal that no stage tells, halfway from each row to the next.

        It has answered a command that came since the sample before, and goes on as it did.
        """
        before = np.searchsorted(rows, np.arange(u.size), side='right') - 1
        told_by = np.minimum(before + (u != u[rows[before]]), self.time.size - 1)
        halfway = now + 0.5 * np.diff(now, append=now[-1:])
        whole, slope = self.alone[name]
        return whole[told_by] + slope[told_by] * (halfway - self.time[told_by])

    def _moved(self, phase: float, drive: tuple[str, ...], blend: float, lead: float) -> Grid:
        sent = blended(self.u, blend) if blend else self.u
        ahead = lead * goes_on(sent) if lead else 0.0
        sooner = np.clip(phase + self.sooner + ahead, EARLIEST, LATEST)
        now, dt, u, rows = interleaved(self.time, sent, sooner)
        if FINELY in drive:
            now, dt, u, rows = finer(now, dt, u, rows)
        at_rows = spread(self._at_samples(drive), rows, u.size)
        for name in {*self.alone} & {*drive}:
            at_rows[OUTPUTS.index(name)] = self._alone(name, now, u, rows)
        if HELD in drive:
            # what a loop sees at the end of a step
            at_rows[STEM] = np.interp(np.append(now[1:], np.inf), self.time, self.held)
        forced, targets, scales = np.split(
            at_rows, [len(OUTPUTS), len(OUTPUTS) + len(self.counts)]
        )
        return Grid(
            u,
            dt,
            rows,
            forced,
            dict(zip(self.counts, targets, strict=True)),
            dict(zip(self.counts, scales, strict=True)),
            np.full(u.size, np.nan),
        )

    def _at_samples(self, drive: tuple[str, ...]) -> Array:
        """Return what stages receive as measured, what counts, and one over its noise."""
        found = self._samples.get(drive)
        if found is None:
            forced = np.full((len(OUTPUTS), self.time.size), np.nan)
            for name, values in self.begins.items():
                forced[OUTPUTS.index(name)] = values
            for name in drive:
                if name in PUT_TO_REST:
                    forced[STEM] = self.rests
                elif name in OUTPUTS:
                    forced[OUTPUTS.index(name)] = self.measured[name]
            scales = [1.0 / self.noise[name] for name in self.counts]
            found = self._samples[drive] = np.vstack([forced, *self.counts.values(), *scales])
        return found


def blended(u: Array, share: float) -> Array:
    """Return commands that go on and on late by a share of a period, sooner if it is negative."""
    other = np.concatenate([u[:1], u[:-1]] if share > 0.0 else [u[1:], u[-1:]])
    return np.where(goes_on(u), (1.0 - abs(share)) * u + abs(share) * other, u)


def goes_on(u: Array) -> npt.NDArray[np.bool_]:
    """Tell at which samples a command changes that changes at the sample before or after, too."""
    moves = np.diff(u, prepend=u[:1]) != 0.0
    beside = np.concatenate([[False], moves, [False]])
    return moves & (beside[:-2] | beside[2:])


def shifted(u: Array, steps: Rows, sooner: bool) -> Array:
    """Return commands with some steps a sample earlier or later."""
    sent = u.copy()
    sent[steps - sooner] = u[steps - 1 + sooner]
    return sent


def _beginning(values: Array, noise: float) -> float:
    """Return the first of some values: a mean over as many as stand still.

    A stem that starts a fraction of a per cent off slips at another moment.
    """
    size = 4
    while 2 * size <= values.size:
        drift = abs(values[:size].mean() - values[size : 2 * size].mean())
        if drift > 2.5 * noise * np.sqrt(2.0 / size):
            break
        size *= 2
    if size > 4 or values.size < 3:
        return float(values[:size].mean())
    first, second, third = values[:3]
    if abs(third - first) > MOVES * noise:  # the first, unless it is an outlier
        third = 2.0 * second - third
    return float(np.median([first, second, third]))
