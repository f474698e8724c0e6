# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From recordings to a fitted valve."""

from collections.abc import Mapping, Sequence
import os

import numpy as np

from ..model.parameters import BRANCH
from ..model.pipeline import Array
from ..model.rivals import rival
from ..model.spec import BASE_MODEL
from ..recordings import read_recording
from ..recordings.recording import OUTPUTS, Recording
from .covariance import Covariance, covariance
from .errors import IdentificationError
from .holdout import etas, HoldOut, parts_of, remarks
from .holdout import hold_out as fit_without
from .placing import placed
from .placing import remark as moved
from .problem import Problem
from .profiles import Profile, profile
from .result import Identification
from .search import polish, refit, search
from .stretches import Mask
from .uncertainty import assess, Assessment, WEAK
from .watch import Progress, Watch

FEWEST_SAMPLES = 10
SHARES = {'search': 0.7, 'ridge': 0.75, 'hold-out': 0.9, 'profiles': 1.0}
"""Share of the work that is done after each phase."""

MOST_SEARCHED = 50_000
"""Samples that are searched: a search keeps many sets of residuals, and takes its time."""
SAME = 0.1
"""Loss of log-likelihood, doubled, that an unseen parameter's usual value may cost."""

Source = Recording | str | os.PathLike[str]


def identify(
    data: Source | Sequence[Source],
    *,
    topics: Mapping[str, str] | None = None,
    seed: int = 0,
    branch: str = BRANCH.default,
    model: str = BASE_MODEL,
    signals: Sequence[str] | None = None,
    hold_out: bool | str = True,
    profiles: bool = False,
    progress: Progress | None = None,
    interruptible: bool = False,
) -> Identification:
    """Fit the base valve's seven parameters to all measured signals, weighted by their noise.

    Or fit a rival model to x.

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
    model : str
        'base' or the name of a rival, which is fitted to x alone, see `identify_rival`.
    signals : sequence of str, optional
        Outputs to fit; all that are measured by default.
    hold_out : bool or {'auto', 'time', 'bags', 'none'}
        Also fit without part of the data, starting where the whole data led, and report eta
        there: without the first and the last third of the time, or without each recording.
    profiles : bool
        Also work out the profile likelihood of every parameter.
    progress : callable, optional
        Called with the share done, 0 to 1, and what is being done. If it raises `watch.Stop`,
        the best so far is the result, marked partial.
    interruptible : bool
        Let Ctrl-C (KeyboardInterrupt) do the same.

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

    way = hold_out if isinstance(hold_out, str) else 'auto' if hold_out else 'none'
    recordings = _read(data, topics)
    if model != BASE_MODEL:
        return _identify_rival(model, recordings, seed, branch, way != 'none', progress)
    problem = Problem(recordings, branch, signals=signals)
    parts = parts_of(problem, way)
    problem.residuals(problem.middle())  # loads the machine code before the search
    watch = Watch(progress, interruptible)
    fitted, assessment, partial = _fit(problem, seed, watch)
    hold_outs: list[HoldOut] = []
    found: list[Profile] = []
    try:
        for number, (name, masks) in enumerate(parts.items() if not partial else ()):
            width = SHARES['hold-out'] - SHARES['ridge']
            watch.phase(SHARES['ridge'] + width * (number + 1) / len(parts), f'without {name}')
            point = fitted.point
            hold_outs.append(fit_without(fitted.problem, point, name, masks, watch))
        for number, name in enumerate(assessment.names if profiles and not partial else ()):
            width = SHARES['profiles'] - SHARES['hold-out']
            share = SHARES['hold-out'] + width * (number + 1) / len(assessment.names)
            watch.phase(share, f'profile of {name}')
            found.append(profile(fitted, name, assessment.estimates[name], watch))
    except watch.stops:
        partial = True
    outputs = fitted.problem.simulate(fitted.point)
    watch.done(partial)
    return Identification(
        spec=fitted.problem.spec(fitted.point),
        estimates=assessment.estimates,
        eta_by_signal=etas(fitted.problem, outputs),
        eta_held_out={each.name: each.eta for each in hold_outs},
        recordings=recordings,
        fitted=_by_recording(recordings, outputs),
        seed=seed,
        version=__version__,
        assessment=assessment,
        remarks=(
            *remarks(hold_outs, assessment.estimates, _misfit(fitted)),
            *moved(problem, fitted.problem),
        ),
        profiles=tuple(found),
        noise=dict(problem.noise),
        bounds={u.name: (u.lower, u.upper) for u in fitted.problem.unknowns.each},
        partial=partial,
    )


def _identify_rival(
    model: str,
    recordings: tuple[Recording, ...],
    seed: int,
    branch: str,
    hold_out: bool,
    progress: Progress | None,
) -> Identification:
    """Fit a rival, after the base valve if it needs that."""
    from .rivals import identify_rival

    report = progress or (lambda share, text: None)
    base, share = None, 0.0
    if not rival(model).data_driven:
        share = 0.5
        base = identify(
            recordings,
            seed=seed,
            branch=branch,
            hold_out=False,
            progress=lambda done, text: report(share * done, text),
        )
    return identify_rival(
        model,
        recordings,
        base=base,
        hold_out=hold_out,
        progress=lambda done, text: report(share + (1.0 - share) * done, text),
    )


def _read(
    data: Source | Sequence[Source], topics: Mapping[str, str] | None
) -> tuple[Recording, ...]:
    """Read what is not read yet; refuse what is too short."""
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
    return recordings


def _fit(problem: Problem, seed: int, watch: Watch) -> tuple[Covariance, Assessment, bool]:
    """Search with a_1 held, then see whether the data can tell a_1 from a_2.

    Returns the scatter around the optimum of the problem in which a_1 is free, its assessment,
    and whether the search was stopped.
    """
    point, partial = None, False
    try:
        watch.phase(SHARES['search'], 'searching')
        point = _searched(problem, seed, watch)
        problem, stamped = placed(problem, point), problem
        if problem is not stamped:
            point = refit(problem, point, watch).point
        watch.phase(SHARES['ridge'], 'telling a_1 from a_2')
        free = problem.with_free_a_1()
        released = polish(free, problem.with_a_1(point), watch).point
        scatter = covariance(free, released)
        assessment = assess(scatter, a_1_held=False)
        a_1 = assessment.estimates['a_1']
        if a_1.half_width <= WEAK * a_1.value:
            return scatter, assessment, partial
        point = _settled(problem, point, scatter.unseen)
    except watch.stops:
        partial = True
        if point is None:
            if watch.best is None:
                raise IdentificationError(
                    'stopped before anything was found; let it run a little longer'
                ) from None
            point = watch.best.point
            if problem.shortened(MOST_SEARCHED) is not problem:  # its starts are those of a part
                point = problem.point(problem.values(point))
    scatter = covariance(problem.with_free_a_1(), problem.with_a_1(point))
    return scatter, assess(scatter, a_1_held=True), partial


def _searched(problem: Problem, seed: int, watch: Watch) -> Array:
    """Return the optimum; of long data only the first part is searched, then all is fitted."""
    part = problem.shortened(MOST_SEARCHED)
    point = search(part, seed, watch).point
    if part is problem:
        return point
    return refit(problem, problem.point(part.values(point)), watch).point


def _misfit(fitted: Covariance) -> float:
    """Return the root mean square of the residuals over the noise."""
    residuals = fitted.problem.residuals(fitted.point)
    return float(np.sqrt(residuals @ residuals / max(int(np.count_nonzero(residuals)), 1)))


def _settled(problem: Problem, point: Array, unseen: Mask) -> Array:
    """Put unknowns that the data do not see back to their usual values."""
    usual = problem.point({})
    residuals = problem.residuals(point)
    cost = float(residuals @ residuals)
    limit = cost * (1.0 + SAME / max(int(np.count_nonzero(residuals)), 1))
    for index in np.flatnonzero(unseen[: len(problem.unknowns)]):
        moved = point.copy()
        moved[index] = usual[index]
        residuals = problem.residuals(moved)
        if float(residuals @ residuals) <= limit:
            point = moved
    return point


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
