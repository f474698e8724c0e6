# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model beside a valve, free of ROS: prediction, residual per stage, fitness, rolling record."""

import math
from typing import NamedTuple

import numpy as np

from ..identification.fitness import fitness
from ..identification.stretches import noise_of
from ..model.effects import CATALOGUE
from ..model.pipeline import Array
from ..model.simulation import InitialState, Valve
from ..model.spec import BASE_MODEL, ValveSpec
from ..recordings.errors import RecordingError
from ..recordings.recording import OUTPUTS, Provenance, Recording

Values = tuple[float, float, float]
"""p1, p2, x [% of span]; NaN where unknown."""
BREAK = 10
"""Periods that stand for a gap in the rolling record: more than any recording bridges."""


class Row(NamedTuple):
    """One sample of the comparison; all signals in % of span."""

    time: float
    u: float
    measured: Values
    predicted: Values
    residual: Values


class Comparison:
    """Runs a valve model on the commands of a valve and compares stage by stage.

    Three copies run side by side, so that a residual names the stage it comes from: the first
    knows u alone and gives the prediction; the second is led along the measured p1 and judges p2,
    the third along the measured p2 and judges x. Where a signal is not measured, the copy before
    it leads.

    Attributes
    ----------
    sample_time : float
        Period of the valve [s].
    """

    def __init__(self, spec: ValveSpec, sample_time: float, window: float) -> None:
        """Prepare; the record holds the last `window` seconds."""
        self.sample_time = sample_time
        self._chain, self._second, self._third = (Valve(one) for one in _copies(spec))
        self._rows = np.full((max(2, round(window / sample_time)), 11), np.nan)
        self._count, self._time, self._held = 0, 0.0, (math.nan, math.nan)
        self._broken = True

    @property
    def spec(self) -> ValveSpec:
        """The model in force; a change begins the comparison, not the record, anew."""
        return self._chain.spec

    @spec.setter
    def spec(self, spec: ValveSpec) -> None:
        valves = self._chain, self._second, self._third
        for valve, one in zip(valves, _copies(spec), strict=True):
            valve.spec = one
        self._rows[:, 5:] = np.nan

    def interrupt(self) -> None:
        """Say that the next sample does not follow the last one."""
        self._broken = True

    def take(self, u: float, measured: Values) -> Row:
        """Take the valve's next sample: command in force and measured p1, p2, x [% of span]."""
        if self._broken:
            self._begin(u, measured)
        predicted = self._chain.step(u, self.sample_time)
        stages = self._stages(u, measured, predicted)
        p1, p2, x = (m - s for m, s in zip(measured, stages, strict=True))
        row = Row(self._time, u, measured, predicted, (p1, p2, x))
        self._rows[self._count % len(self._rows)] = (
            row.time,
            u,
            *measured,
            *predicted,
            *row.residual,
        )
        self._count += 1
        self._time += self.sample_time
        return row

    def _stages(self, u: float, measured: Values, predicted: Values) -> Values:
        """Return p1, p2 and x as each stage makes them of its measured input."""
        if self.spec.model != BASE_MODEL:
            return predicted
        p1_before, p2_before = self._held
        self._second.impose(p1=p1_before)
        p2 = self._second.step(u, self.sample_time)[1]
        p2_now = _known(measured[1], p2)
        self._third.impose(p1=self._leading(p2_before, p2_now), p2=p2_before)
        x = self._third.step(u, self.sample_time)[2]
        self._held = _known(measured[0], predicted[0]), p2_now
        return predicted[0], p2, x

    def eta(self) -> Values:
        """Return the fitness of the prediction over the record, eq. (11) [%]."""
        rows = self._ordered()
        rows = rows[np.isfinite(rows[:, 5])]
        p1, p2, x = (fitness(rows[:, 2 + k], rows[:, 5 + k]) for k in range(3))
        return p1, p2, x

    def noise(self) -> Values:
        """Return the noise of p1, p2, x [% of span] from second differences, robustly."""
        rows = self._ordered()
        p1, p2, x = (noise_of([rows[:, 2 + k]]) for k in range(3))
        return p1, p2, x

    def residual(self, seconds: float) -> Values:
        """Return the root mean square of each stage's residual over the last `seconds`."""
        rows = self._ordered()[-max(1, round(seconds / self.sample_time)) :, 8:]
        p1, p2, x = (math.sqrt(_mean(rows[:, k] ** 2)) for k in range(3))
        return p1, p2, x

    def recording(self) -> Recording:
        """Return the record as it is now; RecordingError if there is too little."""
        rows = self._ordered()
        if len(rows) < 2:
            raise RecordingError(
                'no samples heard so far: check that the topics u, p1, p2 and x carry messages'
            )
        signals = {
            name: rows[:, 2 + k]
            for k, name in enumerate(OUTPUTS)
            if np.isfinite(rows[:, 2 + k]).any()
        }
        provenance = Provenance(time_source='received')
        p1, p2, x = (signals.get(name) for name in OUTPUTS)
        return Recording(rows[:, 0] - rows[0, 0], rows[:, 1], p1, p2, x, provenance)

    def _begin(self, u: float, measured: Values) -> None:
        """Start the copies at rest where the valve is; what is not measured follows the rest."""
        x = next((value for value in reversed(measured) if math.isfinite(value)), u)
        p2 = measured[1] if math.isfinite(measured[1]) else x
        p1 = measured[0] if math.isfinite(measured[0]) else p2
        for valve in (self._chain, self._second, self._third):
            valve.reset(InitialState(p1, p2, x))
        self._broken, self._held = False, (p1, p2)
        if self._count:
            self._time += BREAK * self.sample_time

    def _leading(self, before: float, now: float) -> float:
        """Return the p1 with which the third copy's chamber goes from one p2 to another."""
        values = self.spec.values
        lag = values['T_g1'] if now > before else values['T_g2']
        return before - (now - before) / math.expm1(-self.sample_time / lag)

    def _ordered(self) -> Array:
        """Return the record's rows, oldest first: time, u, measured, predicted, residual."""
        size = len(self._rows)
        if self._count <= size:
            return self._rows[: self._count]
        return np.roll(self._rows, -(self._count % size), axis=0)


def _copies(spec: ValveSpec) -> tuple[ValveSpec, ValveSpec, ValveSpec]:
    """Return the model and, for the judges of p2 and x, what of it belongs to their stage."""
    if spec.model != BASE_MODEL:  # the others know no stages
        return spec, spec, spec
    stage = {name: CATALOGUE[name].stage for name in spec.effects}
    second = [name for name in stage if stage[name] == 'p1-p2']
    third = [name for name in stage if stage[name] in ('p2-x', 'sensor')]
    return (
        spec,
        spec.changed({'effects': second}),
        spec.changed({'effects': third, 'branch': 'zoh'}),
    )


def _known(measured: float, otherwise: float) -> float:
    return measured if math.isfinite(measured) else otherwise


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if known.size else 0.0
