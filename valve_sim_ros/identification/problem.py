# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fit as a function: a point of the unit cube in, weighted residuals out."""

from collections.abc import Mapping, Sequence
import copy
from dataclasses import replace

import numpy as np

from ..model.parameters import BRANCH
from ..model.pipeline import Array
from ..model.simulation import drive, InitialState, machine
from ..model.spec import ValveSpec
from ..recordings.recording import OUTPUTS, Recording
from .errors import IdentificationError
from .stretches import Mask, noise_of, refuse_flat, Stretch, stretches_of
from .unknowns import A_1_HELD, valve_unknowns

MOST_STARTS = 20
"""So many stretches, the longest, have their starting states fitted; it costs memory for each."""
FEWEST = 100
"""Samples of a stretch that are worth a start of their own."""
STEP = 1e-4
"""Step of numerical derivatives, as a share of an unknown's range."""


class Problem:
    """Weighted residuals of a valve over all stretches of all recordings.

    A point of the unit cube holds the unknowns of `unknowns.valve_unknowns` and then, for each
    stretch that has one, its starting p1, p2 and x: 0.5 is the first measured value or, where a
    signal is not measured, the rest without friction; the range is that of noise and friction.

    Attributes
    ----------
    stretches : list of Stretch
        The data.
    signals : tuple of str
        Outputs that are fitted: measured in any recording.
    unknowns : Unknowns
        What is searched, in the order of the point.
    size : int
        Length of a point.
    noise : dict of str to float
        Standard deviation by which each signal's residuals are divided [% of span].
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        branch: str = BRANCH.default,
        *,
        signals: Sequence[str] | None = None,
    ) -> None:
        """Collect the stretches and weigh each signal by its noise.

        Parameters
        ----------
        recordings : sequence of Recording
            The data, fitted together.
        branch : {'zoh', 'printed'}
            Form of the condition of eq. (5).
        signals : sequence of str, optional
            Outputs to fit; all that are measured by default.

        Raises
        ------
        IdentificationError
            If an output is not measured, or u or an output is constant.
        """
        self.branch = branch
        self.signals = _chosen(recordings, signals)
        self.stretches = stretches_of(recordings, self.signals)
        refuse_flat(self.stretches, self.signals)
        self.noise = {
            name: noise_of([s.measured[name] for s in self.stretches]) for name in self.signals
        }
        steps = [s.dt[1:] for s in self.stretches]
        self.sample_time = float(np.median(np.concatenate(steps)))
        self.duration = float(sum(s.dt.sum() for s in self.stretches))
        self.unknowns = valve_unknowns(self.sample_time, self.duration)
        self._started = _longest(self.stretches, MOST_STARTS)
        self._kinds = tuple(
            OUTPUTS.index(name)
            for name in OUTPUTS
            if any(OUTPUTS.index(later) >= OUTPUTS.index(name) for later in self.signals)
        )
        self.size = len(self.unknowns) + len(self._started) * len(self._kinds)
        self.counts = [
            {name: np.isfinite(stretch.measured[name]) for name in self.signals}
            for stretch in self.stretches
        ]
        self._flatten()

    def middle(self) -> Array:
        """Return the point in the middle of all ranges, shape (size,)."""
        return np.full(self.size, 0.5)

    def point(self, values: Mapping[str, float]) -> Array:
        """Return the point of parameter values, with starting states as measured."""
        point = self.middle()
        point[: len(self.unknowns)] = self.unknowns.point(values)
        return point

    def values(self, point: Array) -> dict[str, float]:
        """Return the parameters at `point`, shape (size,)."""
        return self.unknowns.values(point)

    def spec(self, point: Array) -> ValveSpec:
        """Return the valve at `point`."""
        return ValveSpec(self.values(point), self.branch)

    def simulate(self, point: Array) -> list[Array]:
        """Return p1, p2, x, shape (3, n), for each stretch."""
        spec = self.spec(point)
        run = machine(spec).run
        starts = point[len(self.unknowns) :].reshape(-1, len(self._kinds))
        shares = dict(zip(self._started, 2.0 * starts - 1.0, strict=True))
        outputs = []
        for index, stretch in enumerate(self.stretches):
            state = InitialState(*self._start(stretch, spec, shares.get(index))).array(spec)
            result = np.empty((3, stretch.u.size))
            run(stretch.u, stretch.dt, state, *drive(spec), result)
            outputs.append(result)
        return outputs

    def residuals(self, point: Array) -> Array:
        """Return measured minus simulated over the noise, shape (m,): lost samples give 0.

        The order is that of `blocks`.
        """
        outputs = self.simulate(point)
        whole = np.concatenate(
            [result[OUTPUTS.index(name)] for result in outputs for name in self.signals]
        )
        np.subtract(self._measured, whole, out=whole)
        whole *= self._scale
        return whole

    def jacobian(
        self, point: Array, base: Array | None = None, step: float | Array = STEP
    ) -> Array:
        """Return the derivatives of the residuals by the shares, shape (m, size).

        Parameters
        ----------
        point : ndarray, shape (size,)
            Where.
        base : ndarray, shape (m,), optional
            Residuals there, if they are known: one simulation less.
        step : float or ndarray, shape (size,)
            Step of the difference; it turns round where it would leave the cube.
        """
        base = self.residuals(point) if base is None else base
        result = np.zeros((base.size, self.size), order='F')
        steps = np.broadcast_to(step, point.shape)
        inside = (point + steps >= 0.0) & (point + steps <= 1.0)
        steps = np.where(inside, steps, -steps)
        for column in range(len(self.unknowns)):
            moved = point.copy()
            moved[column] += steps[column]
            np.subtract(self.residuals(moved), base, out=result[:, column])
            result[:, column] /= steps[column]
        for kind in range(len(self._kinds)):
            self._start_columns(point, base, kind, steps, result)
        return result

    def with_free_a_1(self) -> 'Problem':
        """Return a copy in which a_1 is searched too, the last of the unknowns."""
        other = copy.copy(self)
        other.unknowns = valve_unknowns(self.sample_time, self.duration, free_a_1=True)
        other.size = self.size + 1
        return other

    def with_a_1(self, point: Array) -> Array:
        """Return a point of this problem as one of `with_free_a_1`."""
        share = self.with_free_a_1().unknowns.each[-1].share(A_1_HELD)
        return np.insert(point, len(self.unknowns), share)

    def shortened(self, most: int) -> 'Problem':
        """Return this problem, or one of about the first `most` samples of its stretches."""
        left, kept, total = most, [], 0
        for stretch in self.stretches:
            kept.append(stretch.head(left))
            total += stretch.u.size
            left -= kept[-1].u.size
            if left < FEWEST:
                break
        if total <= most and len(kept) == len(self.stretches):
            return self
        other = copy.copy(self)
        other.stretches = kept
        other._started = _longest(kept, MOST_STARTS)
        other.size = len(other.unknowns) + len(other._started) * len(other._kinds)
        other.counts = [
            {name: mask[: stretch.u.size] for name, mask in counts.items()}
            for stretch, counts in zip(kept, self.counts, strict=False)
        ]
        other._flatten()
        return other

    def with_command(self, index: int, u: Array) -> 'Problem':
        """Return a copy in which one stretch has other commands, shape (n,)."""
        other = copy.copy(self)
        other.stretches = list(self.stretches)
        other.stretches[index] = replace(self.stretches[index], u=u)
        return other

    def withheld(self, counts: Sequence[Mask]) -> 'Problem':
        """Return a copy in which only some samples count: masks of shape (n,) by stretch."""
        other = copy.copy(self)
        other.counts = [
            {name: known & mask for name, known in stretch.items()}
            for stretch, mask in zip(self.counts, counts, strict=True)
        ]
        other._flatten()
        return other

    def with_starts(self, point: Array, other: Array, masks: Sequence[Mask]) -> Array:
        """Return `point` with the starting states of `other` where a stretch starts masked."""
        result = point.copy()
        width = len(self._kinds)
        for place, index in enumerate(self._started):
            if masks[index][0]:
                first = len(self.unknowns) + place * width
                result[first : first + width] = other[first : first + width]
        return result

    def _flatten(self) -> None:
        """Lay measurements and weights out in the order of the residuals."""
        self.blocks: list[tuple[str, slice]] = []
        measured, scale, first = [], [], 0
        for stretch, counts in zip(self.stretches, self.counts, strict=True):
            for name in self.signals:
                measured.append(np.where(counts[name], stretch.measured[name], 0.0))
                scale.append(counts[name] / self.noise[name])
                self.blocks.append((name, slice(first, first + stretch.u.size)))
                first += stretch.u.size
        self._measured, self._scale = np.concatenate(measured), np.concatenate(scale)

    def _start(
        self, stretch: Stretch, spec: ValveSpec, shares: Array | None
    ) -> tuple[float, float, float]:
        """Return p1, p2, x before a stretch."""
        given = np.zeros(3)
        if shares is not None:
            given[list(self._kinds)] = shares
        first, drift = stretch.first, stretch.drift

        def reach(name: str, otherwise: float = 0.0) -> float:
            if name not in first:
                return otherwise
            return 8.0 * self.noise[name] + drift.get(name, 0.0)

        p1 = first.get('p1', stretch.u[0]) + given[0] * reach('p1', spec.values['f_d1'])
        x = first.get('x', first.get('p2', p1)) + given[2] * reach('x')
        p2 = first.get('p2', x) + given[1] * reach('p2', spec.values['f_s'])
        return float(p1), float(p2), float(x)

    def _start_columns(
        self, point: Array, base: Array, kind: int, steps: Array, result: Array
    ) -> None:
        """Fill in the derivatives by one kind of start, of all stretches in one simulation."""
        columns = len(self.unknowns) + kind + len(self._kinds) * np.arange(len(self._started))
        moved = point.copy()
        moved[columns] += steps[columns]
        change = self.residuals(moved) - base
        width = len(self.signals)
        for index, column, by in zip(self._started, columns, steps[columns], strict=True):
            mine = self.blocks[index * width : (index + 1) * width]
            rows = slice(mine[0][1].start, mine[-1][1].stop)
            result[rows, column] = change[rows] / by


def _chosen(recordings: Sequence[Recording], wanted: Sequence[str] | None) -> tuple[str, ...]:
    """Return the outputs to fit, in the order of the flow."""
    measured = tuple(
        name for name in OUTPUTS if any(name in recording.signals for recording in recordings)
    )
    for name in wanted or ():
        if name not in measured:
            raise IdentificationError(
                f'{name} is not measured in this data: expected some of '
                f'{", ".join(measured) or "p1, p2, x, of which it has none"}'
            )
    chosen = measured if wanted is None else tuple(n for n in measured if n in wanted)
    if not chosen:
        raise IdentificationError(
            'no output is measured: expected p1, p2 or x beside u; name the topics'
        )
    return chosen


def _longest(stretches: Sequence[Stretch], most: int) -> list[int]:
    """Return the places of the longest stretches, in order."""
    order = sorted(range(len(stretches)), key=lambda index: -stretches[index].u.size)
    return sorted(order[:most])
