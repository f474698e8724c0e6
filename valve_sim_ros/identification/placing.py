# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands whose sample the stamps leave in doubt, placed where the fitted valve answers best."""

import numpy as np

from ..model.pipeline import Array
from .problem import Problem
from .stretches import Mask

CLEAR = 2.0
"""Fall of the cost that speaks for another sample, times the mean square of the residuals."""
MOST_DOUBTS = 200
"""So many doubtful commands, the largest steps of each stretch, are looked at."""


def placed(problem: Problem, point: Array) -> Problem:
    """Return the problem with doubtful commands moved by one sample where that fits better.

    Parameters
    ----------
    problem : Problem
        The data; returned as it is if no command moves.
    point : ndarray, shape (size,)
        The valve: the optimum for the commands as they are.
    """
    if not any(stretch.doubtful for stretch in problem.stretches):
        return problem
    speaks = _speaking(problem)
    residuals = problem.residuals(point)
    # a valve fitted to misplaced commands leans towards them: what it could make up for by
    # other parameters does not count
    lean = problem.jacobian(point, residuals)
    lean[~speaks] = 0.0
    weight = np.linalg.pinv(lean.T @ lean, rcond=1e-12, hermitian=True)

    def beyond(values: Array) -> float:
        """Return the sum of squares that speaks and that no other parameters make up for."""
        along = lean.T @ values
        return float(np.square(values[speaks]).sum() - along @ weight @ along)

    cost = beyond(residuals)
    clear = CLEAR * max(cost / max(int(np.count_nonzero(residuals[speaks])), 1), 1.0)
    for index, stretch in enumerate(problem.stretches):
        sizes = {row: -abs(stretch.u[row] - stretch.u[row - 1]) for row in stretch.doubtful}
        for row in sorted(sorted(sizes, key=lambda row: sizes[row])[:MOST_DOUBTS]):
            for start in (row - 1, row + 1):
                u = _moved(problem.stretches[index].u, row, start)
                other = problem.with_command(index, u)
                moved = beyond(other.residuals(point))
                if moved < cost - clear:
                    problem, cost = other, moved
    return problem


def remark(before: Problem, after: Problem) -> list[str]:
    """Say how many commands were moved from one problem to the other, if any."""
    pairs = zip(before.stretches, after.stretches, strict=True)
    count = sum(int(np.count_nonzero(old.u != new.u)) for old, new in pairs)
    if not count:
        return []
    return [f'{count} command(s) in doubt moved by one sample, where the fitted valve answers']


def _speaking(problem: Problem) -> Mask:
    """Return which residuals tell when a command began: friction delays x, pressures do not."""
    names = [name for name in problem.signals if name != 'x'] or ['x']
    speaks = np.zeros(problem.blocks[-1][1].stop, dtype=bool)
    for name, rows in problem.blocks:
        speaks[rows] = name in names
    return speaks


def _moved(u: Array, row: int, start: int) -> Array:
    """Return the commands with the one that begins at `row` beginning at `start`."""
    moved = u.copy()
    if start < row:
        moved[start] = u[row]
    else:
        moved[row] = u[row - 1]
    return moved
