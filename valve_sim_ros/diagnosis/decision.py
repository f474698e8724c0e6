# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What would decide between effects that the data do not tell apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model.effects import CATALOGUE
from ..model.pipeline import Array
from ..recordings.recording import Recording
from .rung import Rung

STROKES = (0.0, 100.0, 0.0, 50.0)
"""To both stops: a sensor's error moves them, a spring's does not."""
STAIRS = (10.0, 30.0, 50.0, 70.0, 90.0, 75.0, 55.0, 35.0, 15.0)
RESTS = (5.0, 15.0, 60.0, 180.0)
"""Times at rest before a small step: friction that grows with dwell shows [s]."""
TURNS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Small reversals about mid stroke [%]: plays and presliding show."""
HOLD, SPEED = 40.0, 1.0
"""Hold after a step [s], and speed of the ramps [%/s]."""


def decisions(rung: Rung, signals: Sequence[str]) -> list[str]:
    """Return the tests and topics that would decide, in words."""
    effect = CATALOGUE[rung.effect]
    missing = [name for name in ('p1', 'p2', 'x') if name not in signals]
    said = [
        f'{twin}: {reason}'
        for twin in rung.twins
        for reason in [effect.twins.get(twin) or CATALOGUE[twin].twins.get(rung.effect)]
        if reason
    ]
    unsaid = [twin for twin in rung.twins if not any(s.startswith(f'{twin}:') for s in said)]
    if unsaid and missing:
        said.append(f'{", ".join(unsaid)}: record {" and ".join(missing)} too')
    elif unsaid:
        said.append(f'{", ".join(unsaid)}: play decide_by.csv and diagnose that recording too')
    return [*said, f'to confirm: {effect.confirm}']


@dataclass(frozen=True)
class TestSignal:
    """Commands that tell the catalogue's effects apart, shape (n,) each.

    Strokes to both stops, stairs, slow ramps, rests of growing length, and small reversals.
    """

    __test__ = False  # not one of pytest's

    time: Array
    u: Array

    @classmethod
    def of(cls, recording: Recording) -> 'TestSignal':
        """Return the signal at the sample time of a recording."""
        period = max(recording.sample_time, 0.01)
        pieces: list[Array] = []

        def hold(level: float, seconds: float) -> None:
            pieces.append(np.full(max(round(seconds / period), 1), level, dtype=np.float64))

        def ramp(start: float, stop: float) -> None:
            steps = round(abs(stop - start) / SPEED / period)
            pieces.append(np.linspace(start, stop, steps, dtype=np.float64))

        for level in (*STROKES, *STAIRS):
            hold(level, HOLD)
        ramp(STAIRS[-1], 90.0)
        ramp(90.0, 10.0)
        for rest in RESTS:
            hold(40.0, rest)
            hold(48.0, 10.0)
        for turn in TURNS:
            hold(50.0 + turn, 15.0)
            hold(50.0 - turn, 15.0)
        u = np.concatenate(pieces)
        return cls(period * np.arange(u.size, dtype=np.float64), u)

    def csv(self) -> str:
        """Return it as CSV with columns t and u."""
        rows = [f'{t:.6g},{u:.6g}' for t, u in zip(self.time, self.u, strict=True)]
        return '\n'.join(['t,u', *rows]) + '\n'
