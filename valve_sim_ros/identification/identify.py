# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From recordings to a fitted valve."""

from collections.abc import Callable, Mapping, Sequence
import os

import numpy as np

from ..model.parameters import BRANCH
from ..model.pipeline import Array
from ..recordings import read_recording
from ..recordings.recording import OUTPUTS, Recording
from .errors import IdentificationError
from .fitness import fitness
from .problem import Problem
from .result import Identification
from .search import polish, search
from .uncertainty import assess

THIRDS = {'first third': (0.0, 1.0 / 3.0), 'last third': (2.0 / 3.0, 1.0)}
FEWEST_SAMPLES = 10

Source = Recording | str | os.PathLike[str]


def identify(
    data: Source | Sequence[Source],
    *,
    topics: Mapping[str, str] | None = None,
    seed: int = 0,
    branch: str = BRANCH.default,
    hold_out: bool = True,
    progress: Callable[[float, str], None] | None = None,
) -> Identification:
    """Fit the base valve's seven parameters by maximising eta, eq. (11).

    Parameters
    ----------
    data : Recording, path, or sequence of them
        Bags, CSV files or recordings; several are fitted together, each segment with a starting
        state of its own.
    topics : mapping of str to str, optional
        Topic (or CSV column) by signal, for files that use other names.
    seed : int
        Seed of the global search; the same seed gives the same result.
    branch : {'zoh', 'printed'}
        Form of the condition of eq. (5).
    hold_out : bool
        Also fit without the first and without the last third, starting where the whole data
        led, and report eta there.
    progress : callable, optional
        Called with the share done, 0 to 1, and what is being done.

    Returns
    -------
    Identification

    Raises
    ------
    RecordingError
        If a file cannot be read.
    IdentificationError
        If nothing can be identified from the data, e.g. the command is constant.
    """
    from .. import __version__

    sources = [data] if isinstance(data, (Recording, str, os.PathLike)) else list(data)
    recordings = tuple(
        source if isinstance(source, Recording) else read_recording(source, topics)
        for source in sources
    )
    samples = sum(len(recording) for recording in recordings)
    if samples < FEWEST_SAMPLES:
        raise IdentificationError(
            f'the data has {samples} samples: expected at least {FEWEST_SAMPLES}; record longer'
        )
    report = progress or (lambda share, text: None)
    problem = Problem(recordings, branch)
    problem.simulate(np.full(problem.size, 0.5))  # loads the machine code before the search
    point, jacobian = search(problem, seed, lambda share, text: report(0.8 * share, text))
    held_out = {}
    for number, (name, (start, stop)) in enumerate(THIRDS.items() if hold_out else ()):
        report(0.8 + 0.1 * number, f'{name} held out')
        rest = problem.withheld(start, stop)
        without, _ = polish(rest, point)
        held_out[name] = _eta_inside_outside(rest, without)
    report(1.0, 'done')
    outputs = problem.simulate(point)
    return Identification(
        spec=problem.spec(point),
        estimates=assess(problem, point, jacobian),
        eta_by_signal=_eta(problem, outputs),
        eta_held_out=held_out,
        recordings=recordings,
        fitted=_by_recording(recordings, outputs),
        seed=seed,
        version=__version__,
    )


def _eta(
    problem: Problem, outputs: list[Array], counts: list[Array] | None = None
) -> dict[str, float]:
    """Return eta by signal over the samples that count."""
    etas = {}
    for name in problem.signals:
        measured = [stretch.measured[name].copy() for stretch in problem.stretches]
        for values, count in zip(measured, counts or (), strict=False):
            values[np.logical_not(count)] = np.nan
        fitted = [output[OUTPUTS.index(name)] for output in outputs]
        etas[name] = fitness(np.concatenate(measured), np.concatenate(fitted))
    return etas


def _eta_inside_outside(rest: Problem, point: Array) -> dict[str, dict[str, float]]:
    """Return eta on the data that was fitted and on that which was withheld."""
    outputs = rest.simulate(point)
    used = [np.any([w > 0 for w in weights.values()], axis=0) for weights in rest.weights]
    return {
        'fitted': _eta(rest, outputs, used),
        'held_out': _eta(rest, outputs, [np.logical_not(mask) for mask in used]),
    }


def _by_recording(
    recordings: Sequence[Recording], outputs: list[Array]
) -> tuple[dict[str, Array], ...]:
    """Join the stretches of each recording again."""
    remaining = iter(outputs)
    joined = []
    for recording in recordings:
        parts = np.concatenate([next(remaining) for _ in recording.segments], axis=1)
        joined.append(dict(zip(OUTPUTS, parts, strict=True)))
    return tuple(joined)
