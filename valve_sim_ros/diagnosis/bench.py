# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording on the test bench: any valve run beside it, and what is left of each signal."""

from collections.abc import Mapping, Sequence
from functools import cached_property
import math

import numpy as np

from ..identification.stretches import noise_of
from ..model.composition import compose
from ..model.effects.sensor_calibration import EFFECT as CALIBRATION
from ..model.effects.sensor_calibration import place
from ..model.kernels import scored
from ..model.parameters import BASE
from ..model.pipeline import Array
from ..model.scoring import BESIDE
from ..recordings.recording import OUTPUTS, Recording
from .adequacy import LOWEST
from .errors import DiagnosisError
from .pushing import AHEAD, leading, PARTS
from .readings import (
    between_lines,
    bridged,
    coarse_grid,
    FEW,
    filled,
    foreseen,
    forgets,
    grids_kept,
    pace,
    resolution_of,
    REST,
    smooth,
    still,
    straightened,
    travelled,
    wild,
)
from .seats import seated, seats_of
from .stretch import CAUGHT, FINELY, Grid, HELD, MODELLED, ON_TIME, RESTS, SOON, Stretch

LEAST_PART = 20
"""A part of no more samples between two gaps tells nothing."""
OUTLIER = 6.0
"""A single value further than this from both its neighbours is an outlier [noise]."""
JITTER = 0.1
"""Uncertainty of when a sample was taken, as a share of the period."""
MIXED_JITTER = 0.7
"""Uncertainty of the time of a sample then."""
LEAST_AT_REST = 0.3
"""Share of the samples of p1 that counts even so."""
SLACK, SLACK_SHARE, EASE = 0.03, 0.01, 10.0
"""By so much p2 may be off where the stem begins to slip [% of span], but by no more than this
part of the friction: a stem that is nearly free always begins to slip; and how many times as much
where the stem is put to rest: the moment of each slip says little there."""
STEP = 4.0
"""Where p1 moves by more within a sample it steps [noise]."""
UNSURE = 3.0
"""By so much a stem that moves when its record begins may be put back [noise]."""
APART = {SOON: 3.0, CAUGHT: 6.0, ON_TIME: 6.0}
"""By drive: a stem is caught where it is further than this from where it should rest [noise]."""
SWINGS = 0.7
"""What a signal does from sample to sample is a swing if there is less between the lines of its
spectrum than this part of it."""


class Bench:
    """All stretches of all recordings, the noise of each signal, and which samples count."""

    def __init__(self, recordings: Sequence[Recording]) -> None:
        """Cut the recordings into stretches and look at the noise; DiagnosisError if empty."""
        self.jitter = JITTER
        self.before: tuple[str, ...] = ()
        self.signals = tuple(
            name for name in OUTPUTS if all(name in recording.signals for recording in recordings)
        )
        if not self.signals:
            raise DiagnosisError(
                'no output is measured in all recordings: expected p1, p2 or x beside u'
            )
        self.stretches = [
            self._stretch(recording, part)
            for recording in recordings
            for part in recording.segments
            if part.stop - part.start > LEAST_PART
        ]
        self.noise = {
            name: self._noise_of([s.measured[name] for s in self.stretches])
            for name in self.signals
        }
        for stretch in self.stretches:
            for name, values in stretch.measured.items():
                values[wild(values, OUTLIER * self.noise[name])] = np.nan
            stretch.noise = {n: self._uncertainty(n, v) for n, v in stretch.measured.items()}
            samples = np.arange(stretch.u.size)
            far = {name: OUTLIER * self.noise[name] for name in self.signals}
            last = self.signals[-1]
            settled = forgets(stretch.measured[last], far[last])
            stretch.recount({n: np.where(settled, v, np.nan) for n, v in stretch.measured.items()})
            if 'p1' in self.signals:
                whole, noise = filled(stretch.measured['p1']), self.noise['p1']
                # beside a step nobody knows on which side of the sample it was
                moves = np.abs(np.diff(whole, prepend=whole[:1], append=whole[-1:])) > STEP * noise
                known = np.where(moves[:-1] | moves[1:], np.nan, smooth(whole, noise))
                # no longer: its noise turns p2, and a stem that only creeps stops there
                shown = settled | forgets(stretch.measured['p1'], far['p1'])
                stretch.begins['p1'] = np.where(shown, np.nan, known)
            if 'x' in self.signals:
                whole, noise = filled(stretch.measured['x']), self.noise['x']
                rests, smoothed = still(whole, noise), smooth(whole, noise)
                stretch.held = straightened(whole, stretch.u, noise)
                stretch.rests = np.where(rests, smoothed, np.nan)
                departed = travelled(stretch.held, far['x']) or samples.size
                period = float(np.median(np.diff(stretch.time)))
                stretch.speed = pace(whole, departed, noise) / period
                if not stretch.speed:  # one that creeps seems to rest
                    if departed < FEW:  # it begins within a slip and rests only then, or creeps
                        rest = departed + FEW
                        further = travelled(stretch.held[rest:], far['x']) or samples.size
                        creeps = pace(whole[rest:], further, noise)
                        departed = 0 if creeps else rest + further
                    # a first slip that was seen on its way must not be put to rest there
                    seen = samples < departed - REST
                    stretch.begins['x'] = np.where(seen, stretch.rests, np.nan)
        self.size = sum(stretch.u.size for stretch in self.stretches)
        steps = [np.diff(stretch.time) for stretch in self.stretches]
        self.period = float(np.median(np.concatenate(steps))) if steps else 0.0

    def _stretch(self, recording: Recording, part: slice) -> Stretch:
        """Return a part of a recording without a gap."""
        lost = np.array(recording.quality.lost_commands, dtype=np.intp) - part.start
        u = np.array(recording.u[part])
        sent, unsure = bridged(u, lost[(lost >= 0) & (lost < part.stop - part.start)])
        guessed = np.union1d(unsure - 1, np.flatnonzero(sent != u))
        time = recording.time[part] - recording.time[part][0]
        measured = {name: np.array(recording.output(name)[part]) for name in self.signals}
        if 'p1' in measured and foreseen(sent, measured['p1'], noise_of([measured['p1']]), unsure):
            sent, unsure = np.append(sent[1:], sent[-1]), np.maximum(unsure - 1, 1)
            guessed = np.maximum(guessed - 1, 0)
        stretch = Stretch(time, sent, measured, unsure=unsure)
        stretch.hide(guessed)
        return stretch

    def run(
        self,
        values: Mapping[str, float],
        effects: Sequence[str] = (),
        drive: Sequence[str] = (),
    ) -> list[Array]:
        """Return p1, p2, x of a valve, and the x to hold beside the measured one: (4, n) each.

        Parameters
        ----------
        values : mapping of str to float
            Parameters of the valve and its effects, `phase`, and starting values
            ``p1_0``, ``p2_0``, ``x_0`` per stretch (``p1_0.1`` for the second).
        effects : sequence of str
            The effects in force.
        drive : sequence of str
            Signals that later stages receive as measured; with x, or `CAUGHT` or `HELD`, the stem
            is put where it was measured, so that a slip missed by the model does not spoil the
            next one.
        """
        results = []
        for index in range(len(self.stretches)):
            outputs, grid, _ = self._run(index, values, effects, drive, 'x', math.inf)
            results.append(outputs.take(grid.rows, axis=1))
        return results

    def score(
        self,
        values: Mapping[str, float],
        effects: Sequence[str],
        signal: str,
        drive: Sequence[str] = (),
        bound: float = math.inf,
    ) -> float:
        """Return the robust sum of squares of a signal over its noise, or more than `bound`."""
        score = 0.0
        for index in range(len(self.stretches)):
            if score <= bound:
                left = bound - score
                score += self._run(index, values, effects, drive, signal, left)[2]
        return score

    def _run(
        self,
        index: int,
        values: Mapping[str, float],
        effects: Sequence[str],
        drive: Sequence[str],
        signal: str,
        bound: float,
    ) -> tuple[Array, Grid, float]:
        """Run one stretch; return outputs on its grid, the grid, and the score of a signal."""
        grid = self._grid(index, values, drive)
        values, effects = seated(values, effects, self.seats)
        if MODELLED in drive:
            effects = [effect for effect in effects if effect not in self.before]
        composition = compose(effects, values)
        theta = np.array([*(values[name] for name in THETA), 0.0])
        if HELD in drive:
            theta[STUCK] = IMMENSE
        outputs = np.empty((BESIDE + 1, grid.u.size))
        slack = min(SLACK, SLACK_SHARE * values['f_s'])
        if {RESTS, SOON, CAUGHT} & {*drive}:
            slack *= EASE
        score = scored(bool(effects))(
            grid.u,
            grid.dt,
            self.start(index, values, effects),
            theta,
            composition.finest,
            composition.effects,
            composition.memory,
            grid.forced,
            outputs,
            OUTPUTS.index(signal),
            grid.targets.get(signal, grid.nothing),
            grid.scales.get(signal, grid.nothing),
            slack,
            max((APART[how] * self.noise['x'] for how in drive if how in APART), default=0.0),
            bound,
        )
        return outputs, grid, score

    def _grid(self, index: int, values: Mapping[str, float], drive: Sequence[str]) -> Grid:
        """Return the grid on which a valve runs beside a stretch."""
        stretch, drive = self.stretches[index], tuple(drive)
        moved = [values.get(name, 0.0) for name in ('phase', 'blend', 'lead')]
        grid = stretch.grid(moved[0], drive, *moved[1:])
        if MODELLED not in drive:
            return grid
        own = [values[name] for name in values if name.split('.')[0] in (*AHEAD, *self.before)]
        key = (drive, *moved, *own)
        return stretch.behind(grid, key, lambda: self._inlet(index, values, drive))

    def _inlet(self, index: int, values: Mapping[str, float], drive: Sequence[str]) -> Array:
        """Return the p1 that leads p2 from row to row where the effects before the stem lead it.

        What acts back sees the stem as measured.
        """
        there = (*(each for each in drive if each in OUTPUTS[:2]), HELD, FINELY)
        outputs, grid, _ = self._run(index, values, self.before, there, 'x', math.inf)
        p2, dt = outputs[OUTPUTS.index('p2'), ::PARTS], PARTS * grid.dt[::PARTS]
        return leading(p2, dt, values['T_g1'], values['T_g2'])

    def start(self, index: int, values: Mapping[str, float], effects: Sequence[str] = ()) -> Array:
        """Return the state before a stretch: as fitted, else as first measured."""
        suffix, first = f'.{index}' if index else '', self.stretches[index].first
        p1, p2, x = (values.get(f'{name}_0{suffix}', first[name]) for name in OUTPUTS)
        v = self.stretches[index].speed
        if CALIBRATION.id in effects:
            x = place(x, *(values[f'{CALIBRATION.id}.{name}'] for name in ('zero', 'span')))
        way = float(np.sign(v))
        # further on than kinetic friction lets one that moves, it would stop for its noise alone
        glides = p2 - way * values['f_d'] - v / values['a_1/a_2']
        if 0.0 < way * (x - glides) < UNSURE * self.noise.get('x', 0.0):
            x = glides
        return np.array([p1, p2, x, v, way, abs(way), p1, p1, 0.0])

    def residual(self, results: Sequence[Array], name: str) -> Array:
        """Return measured minus model of a signal over its noise, NaN where not counted.

        Where the moment of a slip is in doubt, x may be anywhere between before and after.
        """
        row = BESIDE if name == 'x' else OUTPUTS.index(name)
        pairs = zip(self.stretches, results, strict=True)
        return np.concatenate([(s.counts[name] - r[row]) / s.noise[name] for s, r in pairs])

    def _noise_of(self, parts: Sequence[Array]) -> float:
        """Return the noise of a signal, steps of its resolution included."""
        step = resolution_of(np.concatenate(parts))
        seen, between = noise_of(parts), between_lines(parts)
        seen = between if between < SWINGS * seen else seen
        # as in `forgive_steps`: hardly any noise may be seen from sample to sample
        return max(seen, step / math.sqrt(12.0 * LOWEST))

    def _uncertainty(self, name: str, values: Array) -> Array:
        """Return the noise of each sample, more where the signal moves: sample times jitter."""
        steps = np.abs(np.diff(values, prepend=values[:1], append=values[-1:]))
        slope = np.fmax(steps[:-1], steps[1:])
        if name == 'p1':
            # a step is over within a sample, and what still follows it tells a lag
            slope = np.where(np.isnan(steps[1:]), slope, steps[1:])
        slope = np.nan_to_num(slope)
        noise = self.noise[name]
        slope = np.maximum(slope - 2.0 * noise, 0.0)
        return np.sqrt(noise**2 + (self.jitter * slope) ** 2)

    def weigh_down(self, jitter: float, results: Sequence[Array]) -> None:
        """Let sample times be uncertain by this share of a period.

        The samples of p1 at which the `results` of the base valve change do not count any more,
        if enough others are left.
        """
        self.jitter = jitter
        steps = np.concatenate([self._steps(result) for result in results])
        limit = max(self.noise['p1'], float(np.quantile(steps, LEAST_AT_REST)))
        for stretch, result in zip(self.stretches, results, strict=True):
            stretch.noise = {n: self._uncertainty(n, v) for n, v in stretch.measured.items()}
            p1 = np.where(self._steps(result) > limit, np.nan, stretch.counts['p1'])
            stretch.recount({**stretch.counts, 'p1': p1})

    def forgive_steps(self) -> None:
        """Count the steps of x as noise, the quiet windows between two of them as well."""
        steps = self.grid_of_x[0] / math.sqrt(12.0 * LOWEST)
        self.noise['x'] = max(self.noise['x'], steps)
        for stretch in self.stretches:
            stretch.noise['x'] = self._uncertainty('x', stretch.measured['x'])
            stretch.recount(stretch.counts)

    @cached_property
    def grid_of_x(self) -> tuple[float, float]:
        """Step and offset of a grid on which all x lie [% of span]; mostly 0."""
        return coarse_grid(self._all_x(), self.grids_of_x)

    @cached_property
    def grids_of_x(self) -> tuple[tuple[float, float], ...]:
        """Steps and offsets of grids to which x keeps, the coarsest first [%]; mostly none."""
        return grids_kept(self._all_x(), self.noise.get('x', 0.0))

    @cached_property
    def seats(self) -> dict[str, float]:
        """The stops at the ends of the stroke against which x was pressed, none if it was not."""
        return seats_of(self._all_x(), self.noise.get('x', 0.0))

    def _all_x(self) -> Array:
        """Return all measured x, none if x is not measured."""
        x = [s.measured['x'] for s in self.stretches if 'x' in self.signals]
        values = np.concatenate([*x, np.empty(0)])
        return values[np.isfinite(values)]

    @property
    def mixed(self) -> bool:
        """Whether it is unknown, sample by sample, which command p1 answers."""
        return self.jitter > JITTER

    def _steps(self, result: Array) -> Array:
        """Return how far p1 moves up to each sample of a result [%], shape (n,)."""
        return np.abs(np.diff(result[0], prepend=result[0, :1]))


THETA = tuple(parameter.name for parameter in BASE)

STUCK, IMMENSE = [THETA.index('f_s'), THETA.index('f_d')], 1e9
"""Friction of a stem that moves only where it is put [% of span]."""
