# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From recordings to a fitted rival model, with the same result as for the base valve."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..model.parameters import SAMPLE_TIME
from ..model.pipeline import Array
from ..model.rivals import RIVALS
from ..model.rivals.declaration import Channel, Rival
from ..model.spec import ValveSpec
from ..recordings.recording import Recording
from .candidates import Candidates, descend, narrow, Run, SCANS
from .confidence import estimates_of
from .errors import IdentificationError
from .fitness import fitness
from .holdout import THIRDS
from .result import Identification
from .watch import Progress

FRONT = ('f_d1', 'T_g1', 'T_g2')
"""What a physical model takes over from the base valve: its first two stages."""
EFFORT = 2e7
"""Samples times candidates on the coarse grid, for He's model."""
FEWEST, MOST = 40, 120
"""Steps of f_s on the coarse grid of a data-driven model."""
SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
"""f_d over f_s on the coarse grid of a physical model."""
SLOW = 10.0
"""Work from which on a model gets fewer tries."""
RATIOS = (10.0, 2.0, 0.4)
"""Stem speeds a_1/a_2 tried besides the fitted and the declared one [1/s]."""


def identify_rival(
    name: str,
    recordings: Sequence[Recording],
    *,
    base: Identification | None = None,
    channel: Channel = 'u',
    hold_out: bool = True,
    progress: Progress | None = None,
) -> Identification:
    """Fit a rival model by maximising eta of x, eq. (11).

    Parameters
    ----------
    name : str
        Name of the rival.
    recordings : sequence of Recording
        The data; x must be measured. Each segment starts at its first x.
    base : Identification, optional
        The base valve fitted to the same data: physical models need its first two stages and
        start from its stem. Data-driven models need none.
    channel : {'u', 'p2'}
        What drives the model: the command, or the measured p2 as the paper's Fig. 7.
    hold_out : bool
        Also fit without the first and without the last third and report eta there.
    progress : callable, optional
        Called with the share done, 0 to 1, and what is being done.

    Returns
    -------
    Identification

    Raises
    ------
    IdentificationError
        If x (or p2 as the channel) is not measured, or nothing can be identified.
    """
    from .. import __version__

    model = RIVALS[name]
    if not model.data_driven and base is None:
        raise IdentificationError(f'{name}: expected the base fit, whose first stages it takes')
    candidates = _candidates(model, recordings, base, channel)
    report = progress or (lambda share, text: None)
    parts = 3 if hold_out else 1
    point = _search(candidates, base, lambda share: report(share / parts, f'fitting {name}'))
    held_out = {}
    for number, (third, (start, stop)) in enumerate(THIRDS.items() if hold_out else ()):
        report((number + 1) / parts, f'{name}, {third} held out')
        rest = replace(candidates, runs=_withheld(candidates.runs, start, stop))
        held_out[third] = _eta_inside_outside(candidates, rest, _again(rest, point))
    report(1.0, f'{name} done')
    outputs = _outputs(candidates, point)
    values = {key: float(value[0]) for key, value in candidates.values(point[None]).items()}
    return Identification(
        spec=ValveSpec(values, model=name),
        estimates=estimates_of(candidates, point, outputs, base),
        eta_by_signal={'x': _eta(candidates.runs, outputs)},
        eta_held_out=held_out,
        recordings=tuple(recordings),
        fitted=_by_recording(model, recordings, outputs),
        seed=0 if base is None else base.seed,
        version=__version__,
    )


def _candidates(
    model: Rival, recordings: Sequence[Recording], base: Identification | None, channel: Channel
) -> Candidates:
    """Collect the runs of the data and the values that are not searched."""
    runs, fixed = [], model.defaults
    for number, recording in enumerate(recordings):
        for needed in {'x', channel} - {'u'}:
            if needed not in recording.signals:
                raise IdentificationError(
                    f'{needed} is not measured in recording {number + 1}: {model.name} is fitted '
                    f'to x, driven by {channel}; record it, or name its topic'
                )
        start = None if base is None or model.data_driven else base.fitted[number]
        runs += [
            _run(recording, part, channel, start)
            for part in recording.segments
            if np.isfinite(recording.output('x')[part]).any()
        ]
    if np.ptp(np.concatenate([run.inputs for run in runs])) < 1e-9:
        raise IdentificationError(
            f'{channel} is constant: nothing can be identified; record the valve while the '
            'command steps up and down'
        )
    if np.ptp(np.concatenate([run.x[run.counts] for run in runs])) < 1e-9:
        raise IdentificationError(
            'x is constant: the valve did not move or the sensor is dead; check the topic of x'
        )
    if base is not None and not model.data_driven:
        fixed |= {name: base.spec.values[name] for name in FRONT}
    return Candidates(model, channel, fixed, runs)


def _run(
    recording: Recording, part: slice, channel: Channel, start: Mapping[str, Array] | None
) -> Run:
    """Return one segment, started as the base fit starts it or at the first input."""
    x = recording.output('x')[part]
    counts = np.isfinite(x)
    inputs = recording.u[part] if channel == 'u' else _held(recording.output('p2')[part])
    p1, p2 = inputs[0], inputs[0]
    if start is not None and channel == 'u':
        p1, p2 = start['p1'][part][0], start['p2'][part][0]
    return Run(
        np.ascontiguousarray(inputs),
        np.diff(recording.time[part], prepend=recording.time[part][:1]),
        np.where(counts, x, 0.0),
        counts,
        np.array([p1, p2, x[counts][0]]),
    )


def _held(values: Array) -> Array:
    """Return the signal with lost samples held at the value before (the first: after)."""
    known = np.flatnonzero(np.isfinite(values))
    if not known.size:
        raise IdentificationError('p2 is lost throughout a segment: drive the model with u')
    place = np.searchsorted(known, np.arange(values.size), side='right') - 1
    return values[known[np.maximum(place, 0)]]


def _search(
    candidates: Candidates,
    base: Identification | None,
    progress: Callable[[float], object] = lambda share: None,
) -> Array:
    """Return the best point."""
    if candidates.model.data_driven:
        starts, step = _friction_grid(candidates)
        return narrow(candidates, starts, np.full(2, step), 6, _fine(candidates, 6), progress)
    assert base is not None
    starts = _stem_starts(candidates, base)
    slow = candidates.model.work > SLOW
    return descend(candidates, starts, 1 if slow else 5, 60 if slow else 160, progress)


def _fine(candidates: Candidates, lines: int) -> int:
    """Return how many points a scan gets if as many `lines` are scanned at once."""
    samples = sum(run.x.size for run in candidates.runs)
    return int(np.clip(EFFORT / (len(SCANS) * lines * samples), 100, 2000))


def _again(rest: Candidates, point: Array) -> Array:
    """Return the best point on part of the data, starting where the whole data led."""
    if rest.model.data_driven:
        return narrow(rest, point[None], np.full(2, 1.0), 2, _fine(rest, 6), lambda share: None)
    return descend(rest, point[None], 1, 40, lambda share: None)


def _friction_grid(candidates: Candidates) -> tuple[Array, float]:
    """Return the coarse grid of (f_s, f_d) over the legal range and its step [%]."""
    inputs = np.concatenate([run.inputs for run in candidates.runs])
    reach, samples = float(np.ptp(inputs)), inputs.size
    # a valve that starts far from its command needs more than the command's range
    reach = max(
        reach, *(float(np.abs(run.inputs - run.origin[2]).max()) for run in candidates.runs)
    )
    count = int(np.clip(np.sqrt(1.25 * EFFORT / samples), FEWEST, MOST))
    step = min(1.1 * reach, 60.0) / count
    f_s = step * np.arange(count + 1)
    if candidates.model.from_friction(8.0, 4.0) == candidates.model.from_friction(8.0, 2.0):
        return np.stack([f_s, f_s], axis=1), step
    f_d = step * np.arange(-int(0.3 * reach / step), count + 1)
    grid = np.stack(np.meshgrid(f_s, f_d, indexing='ij'), axis=-1).reshape(-1, 2)
    grid = grid[np.abs(grid[:, 1]) <= grid[:, 0] + 1e-9]
    return np.random.default_rng(0).permutation(grid), step


def _stem_starts(candidates: Candidates, base: Identification) -> Array:
    """Return (f_s, f_d, ln a_2) to start a physical model from: the base fit and a coarse grid."""
    values, a_1 = base.spec.values, candidates.fixed['a_1']
    ratios = (values['a_1'] / values['a_2'], *RATIOS, a_1 / candidates.fixed['a_2'])
    points = [(values['f_s'], values['f_d'], np.log(a_1 / ratio)) for ratio in ratios]
    samples = sum(run.x.size for run in candidates.runs)
    room = EFFORT / (samples * candidates.model.work * len(SHARES))
    tried = ratios if room > 5 * len(ratios) else ratios[:1]
    levels = np.linspace(2.0, 40.0, int(np.clip(room / len(tried), 4, 24)))
    points += [(f, part * f, np.log(a_1 / r)) for r in tried for f in levels for part in SHARES]
    return np.array(points)


def _withheld(runs: Sequence[Run], start: float, stop: float) -> list[Run]:
    """Return the runs whose samples from share `start` to `stop` of the data do not count."""
    total, first, rest = sum(run.x.size for run in runs), 0, []
    for run in runs:
        place = (first + np.arange(run.x.size)) / total
        rest.append(
            replace(run, counts=np.logical_and(run.counts, (place < start) | (place >= stop)))
        )
        first += run.x.size
    return rest


def _outputs(candidates: Candidates, point: Array) -> list[Array]:
    """Return p1, p2, x, shape (3, n), for each run."""
    model = candidates.model
    values = {key: float(value[0]) for key, value in candidates.values(point[None]).items()}
    theta, outputs = model.theta(values), []
    for run in candidates.runs:
        result = np.empty((3, run.x.size))
        state = model.start(
            float(run.origin[0]), float(run.origin[1]), float(run.origin[2]), theta
        )
        dt = run.dt if run.dt.size > 1 else np.array([SAMPLE_TIME.default])
        model.make(candidates.channel).run(run.inputs, dt, state, theta, np.inf, (), (), result)
        outputs.append(result)
    return outputs


def _eta(runs: Sequence[Run], outputs: list[Array]) -> float:
    """Return eta of x over the samples that count."""
    measured = np.concatenate([np.where(run.counts, run.x, np.nan) for run in runs])
    return fitness(measured, np.concatenate([output[2] for output in outputs]))


def _eta_inside_outside(
    candidates: Candidates, rest: Candidates, point: Array
) -> dict[str, dict[str, float]]:
    """Return eta on the data that was fitted and on that which was withheld."""
    outputs = _outputs(rest, point)
    withheld = [
        replace(run, counts=np.logical_and(run.counts, np.logical_not(used.counts)))
        for run, used in zip(candidates.runs, rest.runs, strict=True)
    ]
    return {
        'fitted': {'x': _eta(rest.runs, outputs)},
        'held_out': {'x': _eta(withheld, outputs)},
    }


def _by_recording(
    model: Rival, recordings: Sequence[Recording], outputs: list[Array]
) -> tuple[dict[str, Array], ...]:
    """Join the runs of each recording again; data-driven models know no pressures."""
    remaining, joined = iter(outputs), []
    for recording in recordings:
        parts = [
            next(remaining)
            if np.isfinite(recording.output('x')[part]).any()
            else np.full((3, recording.u[part].size), np.nan)
            for part in recording.segments
        ]
        p1, p2, x = np.concatenate(parts, axis=1)
        joined.append({'x': x} if model.data_driven else {'p1': p1, 'p2': p2, 'x': x})
    return tuple(joined)
