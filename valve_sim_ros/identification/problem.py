# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fit as a function: a vector of unknowns in, weighted residuals out."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from ..model import pipeline
from ..model.kernels import make
from ..model.parameters import BASE
from ..model.pipeline import Array
from ..model.simulation import InitialState, NO_EFFECTS
from ..model.spec import ValveSpec
from ..recordings.recording import OUTPUTS, Recording
from .errors import IdentificationError

DECLARED = {parameter.name: parameter for parameter in BASE}
A_1_HELD = DECLARED['a_1'].default
RATIO_BOUNDS = (0.05, 0.5 * math.sqrt(A_1_HELD))
"""a_1/a_2 [1/s], from a very slow stem to the critically damped one at the held a_1."""
UNKNOWNS = ('f_d1', 'T_g1', 'T_g2', 'f_s', 'f_d', 'a_1/a_2')
STAGE = {'p1': ('f_d1',), 'p2': ('T_g1', 'T_g2'), 'x': ('f_s', 'f_d')}
"""Which unknowns each stage adds on the way to a signal; a_1/a_2 is left to the polish."""
MOST_STARTS = 3
"""Up to so many segments, unknown starting pressures are fitted too."""


@dataclass(frozen=True)
class Stretch:
    """A run of samples without a gap, ready for the compiled model."""

    u: Array
    dt: Array
    measured: dict[str, Array]


class Problem:
    """Weighted residuals of the base valve over all segments of all recordings.

    The unknowns are walked in the unit cube: logarithmic where the declaration says so, f_d as a
    share of f_s, a_1 and a_2 through their ratio, and per segment the starting p1 as a share of
    the backlash and the starting p2 - x as a share of f_s, unless measured.
    """

    def __init__(self, recordings: Sequence[Recording], branch: str) -> None:
        """Collect the stretches and weigh each signal by its noise."""
        self.branch = branch
        self.signals = tuple(
            name for name in OUTPUTS if all(name in recording.signals for recording in recordings)
        )
        if not self.signals:
            raise IdentificationError(
                'no output is measured in all recordings: expected p1, p2 or x beside u'
            )
        self.stretches = [
            Stretch(
                recording.u[part],
                np.diff(recording.time[part], prepend=recording.time[part][:1]),
                {name: recording.output(name)[part] for name in self.signals},
            )
            for recording in recordings
            for part in recording.segments
        ]
        self._refuse_flat()
        self.noise = {name: self._noise(name) for name in self.signals}
        starts = len(self.stretches) if len(self.stretches) <= MOST_STARTS else 0
        self.nuisances = [
            (index, name)
            for index in range(starts)
            for name in ('p1', 'p2')
            if name not in self.signals and any(later in self.signals for later in ('p2', 'x'))
        ]
        self.size = len(UNKNOWNS) + len(self.nuisances)
        self.weights = [
            {name: np.isfinite(stretch.measured[name]).astype(float) for name in self.signals}
            for stretch in self.stretches
        ]

    def stages(self) -> list[tuple[str, list[int]]]:
        """Return, per measured signal in the order of the flow, the unknowns it first sees."""
        groups: list[tuple[str, list[int]]] = []
        pending: list[int] = []
        for name in OUTPUTS:
            pending += [UNKNOWNS.index(unknown) for unknown in STAGE[name]]
            if name in self.signals:
                groups.append((name, pending))
                pending = []
        for offset, (_, name) in enumerate(self.nuisances):
            late = name == 'p2' or 'p2' not in self.signals
            groups[-1 if late else 0][1].append(len(UNKNOWNS) + offset)
        return groups

    def values(self, point: Array) -> dict[str, float]:
        """Return the parameters at `point`, shape (size,), of the unit cube."""
        values = {'a_1': A_1_HELD}
        for name, share in zip(UNKNOWNS[:4], point, strict=False):
            declared = DECLARED[name]
            if declared.scale == 'log':
                values[name] = declared.lower * (declared.upper / declared.lower) ** share
            else:
                values[name] = declared.lower + share * (declared.upper - declared.lower)
        values['f_d'] = values['f_s'] * point[4]
        low, high = RATIO_BOUNDS
        values['a_2'] = A_1_HELD / (low * (high / low) ** point[5])
        return {name: float(value) for name, value in values.items()}

    def spec(self, point: Array) -> ValveSpec:
        """Return the valve at `point`."""
        return ValveSpec(self.values(point), self.branch)

    def simulate(self, point: Array) -> list[Array]:
        """Return p1, p2, x, shape (3, n), for each stretch."""
        values = self.values(point)
        spec = ValveSpec(values, self.branch)
        theta = spec.theta
        shares = dict(zip(self.nuisances, 2.0 * point[len(UNKNOWNS) :] - 1.0, strict=True))
        outputs = []
        for index, stretch in enumerate(self.stretches):
            state = self._start(index, stretch, values, shares).array(spec)
            result = np.empty((3, stretch.u.size))
            make().run(
                stretch.u,
                stretch.dt,
                state,
                theta,
                pipeline.BASE_STEP,
                NO_EFFECTS,
                NO_EFFECTS,
                result,
            )
            outputs.append(result)
        return outputs

    def residuals(self, point: Array, signals: Sequence[str] | None = None) -> Array:
        """Return all residuals over the noise of their signal, shape (m,)."""
        parts = []
        for stretch, weights, result in zip(
            self.stretches, self.weights, self.simulate(point), strict=True
        ):
            for name in signals or self.signals:
                error = np.nan_to_num(stretch.measured[name]) - result[OUTPUTS.index(name)]
                parts.append(error * weights[name] / self.noise[name])
        return np.concatenate(parts)

    def withheld(self, start: float, stop: float) -> 'Problem':
        """Return a copy whose samples from share `start` to `stop` of the data do not count."""
        copy = Problem.__new__(Problem)
        copy.__dict__.update(self.__dict__)
        total = sum(stretch.u.size for stretch in self.stretches)
        copy.weights, first = [], 0
        for stretch, weights in zip(self.stretches, self.weights, strict=True):
            place = (first + np.arange(stretch.u.size)) / total
            counts = (place < start) | (place >= stop)
            copy.weights.append({name: weight * counts for name, weight in weights.items()})
            first += stretch.u.size
        return copy

    def _start(
        self,
        index: int,
        stretch: Stretch,
        values: dict[str, float],
        shares: dict[tuple[int, str], float],
    ) -> InitialState:
        """Return the state before a stretch, measured where it can be."""
        first = {name: _first(stretch.measured[name]) for name in self.signals}
        p1 = first.get('p1', stretch.u[0] + shares.get((index, 'p1'), 0.0) * values['f_d1'])
        near = first.get('x', p1)
        p2 = first.get('p2', near + shares.get((index, 'p2'), 0.0) * values['f_s'])
        return InitialState(float(p1), float(p2), float(first.get('x', p2)))

    def _noise(self, name: str) -> float:
        """Return the noise of a signal [% of span] from its second differences, robustly."""
        bends = np.concatenate([np.diff(s.measured[name], 2) for s in self.stretches])
        bends = np.abs(bends[np.isfinite(bends)])
        spread = float(np.median(bends)) / (0.6745 * math.sqrt(6.0)) if bends.size else 0.0
        return max(spread, 0.02)

    def _refuse_flat(self) -> None:
        """Refuse data from which nothing can be learnt."""
        u = np.concatenate([stretch.u for stretch in self.stretches])
        if np.ptp(u) < 1e-9:
            raise IdentificationError(
                f'u is constant at {u[0]:g} %: nothing can be identified; record the valve while '
                'the command steps up and down'
            )
        for name in self.signals:
            values = np.concatenate([stretch.measured[name] for stretch in self.stretches])
            if not np.nanmax(values) - np.nanmin(values) > 1e-9:
                raise IdentificationError(
                    f'{name} is constant: the valve did not move or the sensor is dead; check '
                    f'the topic of {name} or leave it out'
                )


def _first(values: Array) -> float:
    """Return the first value that is not lost."""
    return float(values[np.flatnonzero(np.isfinite(values))[0]])
