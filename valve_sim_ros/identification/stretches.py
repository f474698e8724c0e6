# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as runs of samples without a gap, ready for the compiled model."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..model.pipeline import Array
from ..recordings.quality import roughness
from ..recordings.recording import Recording
from .errors import IdentificationError

LEAST_NOISE = 0.02
"""Noise that is assumed at least [% of span], so that clean simulated data can be fitted too."""

Mask = npt.NDArray[np.bool_]

DRIFT_SEEN = 6
"""So many samples show how fast an output moved while those before were lost."""
SAME_STEP = 1e-6
"""Relative difference up to which two steps of time are the same one."""


@dataclass(frozen=True)
class Stretch:
    """A run of samples without a gap.

    Attributes
    ----------
    u, dt : ndarray, shape (n,)
        Command [% of span] and time since the sample before [s], 0 for the first.
    measured : dict of str to ndarray, shape (n,)
        Outputs [% of span]; NaN where a sample was lost.
    recording : int
        Which recording it comes from.
    doubtful : tuple of int
        Samples with which commands begin that may as well begin one sample earlier or later.
    """

    u: Array
    dt: Array
    measured: dict[str, Array]
    recording: int
    doubtful: tuple[int, ...] = ()

    def head(self, most: int) -> 'Stretch':
        """Return the first `most` samples."""
        if self.u.size <= most:
            return self
        measured = {name: values[:most] for name, values in self.measured.items()}
        doubtful = tuple(row for row in self.doubtful if row < most)
        return Stretch(self.u[:most], self.dt[:most], measured, self.recording, doubtful)

    @cached_property
    def first(self) -> dict[str, float]:
        """The first measured value of each output that has one [% of span]."""
        found = {}
        for name, values in self.measured.items():
            known = np.flatnonzero(np.isfinite(values))
            if known.size:
                found[name] = float(values[known[0]])
        return found

    @cached_property
    def drift(self) -> dict[str, float]:
        """How far each output may have moved while its first samples were lost [% of span]."""
        found = {}
        for name, values in self.measured.items():
            known = np.flatnonzero(np.isfinite(values))[:DRIFT_SEEN]
            if known.size > 1 and known[0] > 0:
                speed = np.abs(np.diff(values[known])) / np.diff(known)
                jump = abs(values[known[0]] - self.u[0]) if name == 'p1' else 0.0
                found[name] = float(max(2.0 * known[0] * speed.max(), jump))
        return found


def stretches_of(recordings: Sequence[Recording], signals: Sequence[str]) -> list[Stretch]:
    """Cut recordings at their gaps."""
    return [
        Stretch(
            recording.u[part],
            _steps(recording.time[part]),
            {name: _measured(recording, name)[part] for name in signals},
            number,
            _inside(recording.quality.doubtful_commands, part),
        )
        for number, recording in enumerate(recordings)
        for part in recording.segments
    ]


def _inside(rows: Sequence[int], part: slice) -> tuple[int, ...]:
    """Return those of the rows that lie in a part, counted from its first but one."""
    return tuple(row - part.start for row in rows if part.start < row < part.stop)


def _measured(recording: Recording, name: str) -> Array:
    """Return an output, all lost where a recording does not have it."""
    if name in recording.signals:
        return recording.output(name)
    return np.full(len(recording), np.nan)


def _steps(time: Array) -> Array:
    """Return the steps [s], 0 first; those that differ by rounding alone become equal.

    What the model derives from a step is kept while the step stays the same.
    """
    steps = np.diff(time, prepend=time[:1])
    if steps.size > 1:
        usual = float(np.median(steps[1:]))
        steps[np.abs(steps - usual) < SAME_STEP * usual] = usual
    return steps


def noise_of(parts: Sequence[Array]) -> float:
    """Return the noise of a signal in pieces [% of span], no less than anyone can tell."""
    return max(roughness(parts), LEAST_NOISE)


def refuse_flat(stretches: Sequence[Stretch], signals: Sequence[str]) -> None:
    """Raise an IdentificationError for data from which nothing can be learnt."""
    u = np.concatenate([stretch.u for stretch in stretches])
    if np.ptp(u) < 1e-9:
        raise IdentificationError(
            f'u is constant at {u[0]:g} %: nothing can be identified; record the valve while '
            'the command steps up and down'
        )
    for name in signals:
        values = np.concatenate([stretch.measured[name] for stretch in stretches])
        if not np.isfinite(values).any() or not np.nanmax(values) - np.nanmin(values) > 1e-9:
            raise IdentificationError(
                f'{name} is constant: the valve did not move or the sensor is dead; check '
                f'the topic of {name} or leave it out'
            )
