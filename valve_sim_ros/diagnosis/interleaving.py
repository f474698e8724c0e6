# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Samples and the commands that came between them in one row, compiled: fits move them often."""

from typing import Any

from numba import njit
import numpy as np
import numpy.typing as npt

from ..model.pipeline import Array

Rows = npt.NDArray[np.intp]


@njit(cache=True, nogil=True)
def interleaved(time: Array, sent: Array, sooner: Array) -> tuple[Array, Array, Array, Any]:
    """Return samples and those changes of the command that came between them, in order.

    Parameters
    ----------
    time, sent : ndarray, shape (n,)
        When samples were taken [s], and the commands they show [% of span].
    sooner : ndarray, shape (n,)
        By how much a command came sooner than the sample that shows it [periods]; none overtakes
        another.

    Returns
    -------
    now, dt, u : ndarray, shape (m,)
        Time, time since the row before, rounded so that equal steps stay equal [s], command.
    rows : ndarray of int, shape (n,)
        Where the samples are.
    """
    n = time.size
    came, value = np.empty(n), np.empty(n)
    between = np.zeros(n, dtype=np.bool_)
    changes = extra = 0
    for k in range(1, n):
        if sent[k] != sent[k - 1]:
            following = time[k + 1] - time[k] if k + 1 < n else time[k] - time[k - 1]
            period = time[k] - time[k - 1] if sooner[k] > 0.0 else following
            came[changes] = time[k] - sooner[k] * period
            if changes and came[changes] < came[changes - 1]:
                came[changes] = came[changes - 1]
            value[changes] = sent[k]
            between[changes] = sooner[k] != 0.0
            extra += between[changes]
            changes += 1
    now, dt, u = np.empty(n + extra), np.empty(n + extra), np.empty(n + extra)
    rows = np.empty(n, dtype=np.intp)
    sample = change = received = 0
    for row in range(n + extra):
        while change < changes and not between[change]:
            change += 1
        if change == changes or (sample < n and time[sample] <= came[change]):
            now[row] = time[sample]
            rows[sample] = row
            sample += 1
        else:
            now[row] = came[change]
            change += 1
        while received < changes and came[received] <= now[row]:
            received += 1
        u[row] = value[received - 1] if received else sent[0]
        dt[row] = np.rint((now[row] - now[max(row - 1, 0)]) * 1e9) / 1e9
    return now, dt, u, rows


@njit(cache=True, nogil=True)
def spread(values: Array, rows: Any, size: int) -> Array:
    """Return values of the samples, shape (k, n), at their rows: (k, size), else NaN."""
    found = np.full((values.shape[0], size), np.nan)
    for index in range(values.shape[0]):
        for sample in range(rows.size):
            found[index, rows[sample]] = values[index, sample]
    return found
