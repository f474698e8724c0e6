# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""On which side of a sample each command came, where p1 does not show it."""

import numpy as np

from ..model.pipeline import Array
from ..recordings.recording import OUTPUTS
from .fitting import Fitter, Problem, Valve
from .seen import ENOUGH_STEPS, LEAST_EACH
from .stages import Group
from .stretch import earlier, Rows, Stretch

WHOLE, MOST = 0.3, 0.8
"""So near to a whole period, and so many of the steps."""
SURE = 0.25
"""The error with which a step must be told [periods]."""
LEAST_PUSH, MOST_CELLS = 1.0, 5e6
"""What a sample more of a step must do to p2 [noise]; the largest are looked at, no more cells of
samples times steps than so many."""


def put_in_its_period(fitter: Fitter, group: Group, valve: Valve, problem: Problem) -> Valve:
    """Put steps of the command a sample earlier that came a whole period before the others.

    Where samples are taken just when commands arrive, nobody sees on which side of a sample a step
    was; p2 shows it. Returns the valve, refitted if any was put elsewhere.
    """
    if group.has_stem or 'p1-p2' not in group.stages or 'p1' in problem[2]:
        return valve
    stretches = fitter.bench.stretches
    sent = [stretch.u for stretch in stretches]
    each = shifts_of_steps(fitter, valve, problem)
    shifts = np.concatenate([shifts for _, shifts in each])
    early, on_time = (np.abs(shifts - whole) < WHOLE for whole in (1.0, 0.0))
    if (
        shifts.size < ENOUGH_STEPS
        or min(early.sum(), on_time.sum()) < LEAST_EACH
        or np.mean(early | on_time) < MOST
    ):
        for stretch, u in zip(stretches, sent, strict=True):
            stretch.send(u)
        return valve
    for stretch, (steps, shifts) in zip(stretches, each, strict=True):
        stretch.put_earlier(steps[shifts > 0.5])
    return fitter.refined(valve, problem)


def shifts_of_steps(fitter: Fitter, valve: Valve, problem: Problem) -> list[tuple[Rows, Array]]:
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
    list of (ndarray, ndarray), shape (m,) each
        By stretch: samples that are the first to show a step, of those that are told well enough,
        and their shifts [periods].
    """
    _, signal, drive = problem
    stretches, row = fitter.bench.stretches, OUTPUTS.index(signal)
    steps = [_large_steps(stretch, valve, signal) for stretch in stretches]

    def results(moved: int) -> list[Array]:
        """Return the signal of all stretches with one step of each a sample earlier, -1: none."""
        for stretch, own in zip(stretches, steps, strict=True):
            stretch.send(earlier(stretch.shown, own[moved : moved + 1]))
        return [result[row] for result in fitter.results(valve, drive)]

    moved = [results(index) for index in range(max(own.size for own in steps))]
    plain = results(-1)
    ends = np.cumsum([stretch.u.size for stretch in stretches])[:-1]
    residuals = np.split(fitter.residuals(valve, signal, drive), ends)
    found = []
    for index, (stretch, own, residual) in enumerate(
        zip(stretches, steps, residuals, strict=True)
    ):
        weight = (residual != 0.0) / stretch.noise[signal]
        changes = [(each[index] - plain[index]) * weight for each in moved[: own.size]]
        there = np.array(changes).reshape(own.size, weight.size)
        # one may be a period off: what the signal does not tell stays where it is
        covariance = np.linalg.inv(there @ there.T + np.eye(own.size))
        told = np.sqrt(np.diag(covariance)) < SURE
        shifts = valve.values['phase'] + covariance @ (there @ residual)
        found.append((own[told], shifts[told]))
    return found


def _large_steps(stretch: Stretch, valve: Valve, signal: str) -> Rows:
    """Return the samples that are the first to show a step which p2 may tell."""
    quickest = min(valve.values['T_g1'], valve.values['T_g2'])
    push = np.abs(np.diff(stretch.shown)) * np.diff(stretch.time) / quickest
    steps = np.flatnonzero(push > LEAST_PUSH * float(np.median(stretch.noise[signal]))) + 1
    most = int(MOST_CELLS / stretch.shown.size)
    return np.sort(steps[np.argsort(-push[steps - 1], kind='stable')[:most]])
