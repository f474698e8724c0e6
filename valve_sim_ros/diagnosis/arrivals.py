# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When each command came, where p1 does not show it."""

from collections.abc import Sequence
import math

import numpy as np

from ..model.pipeline import Array
from ..recordings.recording import OUTPUTS
from . import odds
from .adequacy import leftover
from .fitting import Fitter, Problem, Valve
from .interleaving import Rows
from .seen import ENOUGH_STEPS, LEAST_EACH
from .stages import Group
from .stretch import shifted, Stretch

WHOLE, MOST = 0.3, 0.7
"""So near to a whole period, and so many of the steps."""
RARE = 1 / 3
"""Those on time are late where they are so few beside the early ones."""
SURE, WORTH = 0.25, 10.0
"""The error with which a step must be told [periods], and what it must save if each of them comes
at a time of its own."""
LEAST_PUSH, MOST_CELLS = 1.0, 5e6
"""What a sample more of a step must do to p2 [noise]; the largest are looked at, no more cells of
samples times steps than so many."""
SPREAD = math.sqrt(1.0 / 12.0)
"""Standard deviation of commands that come at any time [periods]."""
NONE = np.empty(0, dtype=np.intp), np.empty(0)


def put_in_its_period(fitter: Fitter, group: Group, valve: Valve, problem: Problem) -> Valve:
    """Put steps of the command a sample elsewhere that came a whole period beside most others.

    Where samples are taken just when commands arrive, nobody sees on which side of a sample a step
    was; p2 shows it. It also shows which steps came with a command that was lost just before.
    Returns the valve, refitted if any step was put elsewhere.
    """
    if group.has_stem or 'p1-p2' not in group.stages or 'p1' in problem[2]:
        return valve
    stretches = fitter.bench.stretches
    if any(stretch.sooner.any() for stretch in stretches):
        return valve  # told before
    sent = [stretch.u for stretch in stretches]
    each = shifts_of_steps(fitter, valve, problem)
    found_early = [
        steps[np.isin(steps, stretch.unsure) & (shifts - valve.values['phase'] > 0.5)]
        for stretch, (steps, shifts, _) in zip(stretches, each, strict=True)
    ]
    told = np.concatenate(
        [
            shifts[(errors < SURE) & ~np.isin(steps, stretch.unsure)]
            for stretch, (steps, shifts, errors) in zip(stretches, each, strict=True)
        ]
    )
    early, on_time = (int(np.sum(np.abs(told - whole) < WHOLE)) for whole in (1.0, 0.0))
    if (
        told.size < ENOUGH_STEPS
        or min(early, on_time) < LEAST_EACH
        or early + on_time < MOST * told.size
    ):
        if any(steps.size for steps in found_early):
            for stretch, steps in zip(stretches, found_early, strict=True):
                stretch.put(steps, True)
            return fitter.refined(valve, problem)
        _send(stretches, sent)
        if _spotless(fitter, valve, problem):
            return valve
        there = _when_they_came(fitter, valve, problem, each)
        if _spotless(fitter, there, problem):
            return there
        _together(stretches)
        return valve
    sooner = on_time > RARE * early
    for stretch, (steps, shifts, errors) in zip(stretches, each, strict=True):
        # those that are hardly told stay with the most
        likelier_early = (shifts - 0.5) / errors**2 + math.log(early / on_time) > 0.0
        stretch.put(steps[likelier_early == sooner], sooner)
    there = fitter.refined(valve, problem)
    if _spotless(fitter, there, problem):
        return there
    # some may come in between
    put = [stretch.u for stretch in stretches]
    _send(stretches, sent)
    between = _when_they_came(fitter, valve, problem, each)
    if between.cost < there.cost - WORTH * told.size:
        return between
    _together(stretches)
    _send(stretches, put)
    return there


def _spotless(fitter: Fitter, valve: Valve, problem: Problem) -> bool:
    """Tell whether nothing but noise is left."""
    _, signal, drive = problem
    return leftover(fitter.residuals(valve, signal, drive)).excess <= odds.SPOTLESS


def _send(stretches: Sequence[Stretch], commands: Sequence[Array]) -> None:
    """Let the valve receive these commands."""
    for stretch, u in zip(stretches, commands, strict=True):
        stretch.send(u)


def _together(stretches: Sequence[Stretch]) -> None:
    """Let all steps of the command come alike."""
    for stretch in stretches:
        stretch.scatter(*NONE)


def _when_they_came(
    fitter: Fitter,
    valve: Valve,
    problem: Problem,
    told: Sequence[tuple[Rows, Array, Array]],
) -> Valve:
    """Return the valve refitted, each step of the command coming when it was told to have come.

    Who sends commands keeps other times than who takes samples.
    """
    for stretch, (steps, shifts, errors) in zip(fitter.bench.stretches, told, strict=True):
        known = SPREAD**2 / (SPREAD**2 + errors**2)
        came = np.clip(shifts, fitter.phase.lower, fitter.phase.upper)
        stretch.scatter(steps, known * (came - valve.values['phase']))
    return fitter.refined(valve, problem)


def shifts_of_steps(
    fitter: Fitter, valve: Valve, problem: Problem
) -> list[tuple[Rows, Array, Array]]:
    """Return by how much steps of the command came earlier than at the sample that shows them.

    All are told at once: behind a slow chamber what one leaves is still there when others come.
    Afterwards the valve receives the commands of the recording.

    Parameters
    ----------
    fitter : Fitter
        At the bench.
    valve : Valve
        As far as it is known.
    problem : tuple
        Unknowns, the signal that tells, and what drives the stages before it.

    Returns
    -------
    list of (ndarray, ndarray, ndarray), shape (m,) each
        By stretch: samples that are the first to show a large step, and their shifts with standard
        errors [periods].
    """
    _, signal, drive = problem
    stretches, row = fitter.bench.stretches, OUTPUTS.index(signal)
    steps = [_large_steps(stretch, valve, signal) for stretch in stretches]

    def results(moved: int) -> list[Array]:
        """Return the signal of all stretches with one step of each a sample earlier, -1: none."""
        for stretch, own in zip(stretches, steps, strict=True):
            stretch.send(shifted(stretch.shown, own[moved : moved + 1], True))
        return [result[row] for result in fitter.results(valve, drive)]

    moved = [results(index) for index in range(max(own.size for own in steps))]
    plain = results(-1)
    ends = np.cumsum([stretch.u.size for stretch in stretches])[:-1]
    residual = fitter.residuals(valve, signal, drive)
    left = leftover(residual)
    coarser = math.sqrt(max(left.floor, 1.0) * left.inflation)  # of one white sample
    residuals = np.split(residual, ends)
    found = []
    for index, (stretch, own, residual) in enumerate(
        zip(stretches, steps, residuals, strict=True)
    ):
        weight = (residual != 0.0) / stretch.noise[signal]
        changes = [(each[index] - plain[index]) * weight for each in moved[: own.size]]
        there = np.array(changes).reshape(own.size, weight.size)
        # one may be a period off: what the signal does not tell stays where it is
        covariance = np.linalg.inv(there @ there.T + np.eye(own.size))
        # without that caution again, with its own error
        kept = np.minimum(np.diag(covariance), 1.0 - 1e-9)
        shifts = valve.values['phase'] + covariance @ (there @ residual) / (1.0 - kept)
        found.append((own, shifts, coarser * np.sqrt(kept / (1.0 - kept))))
    return found


def _large_steps(stretch: Stretch, valve: Valve, signal: str) -> Rows:
    """Return the samples that are the first to show a step which p2 may tell."""
    quickest = min(valve.values['T_g1'], valve.values['T_g2'])
    push = np.abs(np.diff(stretch.shown)) * np.diff(stretch.time) / quickest
    steps = np.flatnonzero(push > LEAST_PUSH * float(np.median(stretch.noise[signal]))) + 1
    most = int(MOST_CELLS / stretch.shown.size)
    return np.sort(steps[np.argsort(-push[steps - 1], kind='stable')[:most]])
