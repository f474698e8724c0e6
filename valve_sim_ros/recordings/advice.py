# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands to record next, so that every parameter of the valve can be seen."""

from collections.abc import Collection

import numpy as np

from .doctor import Examination, HIDDEN, PARAMETERS, Verdict
from .errors import RecordingError
from .recording import Provenance, Recording

USUAL_FILLING, USUAL_EMPTYING = 10.0, 150.0
"""Time constants [s] where nothing is known: those of the paper's valve, rounded."""
SMALL_TURNS = (-2.0, 2.0, -4.0, 4.0, -8.0, 8.0, -15.0, 15.0)
"""Away from the middle and back [%]: the backlash and friction of most valves lie between."""
STAIRS = (0.0, 0.12, 0.3, 0.45, 0.7, 0.78, 1.0)
LONGEST_HOLD = 600.0


def recommended(
    examination: Examination | None = None,
    *,
    missing: Collection[str] = PARAMETERS,
    sample_time: float | None = None,
    low: float = 10.0,
    high: float = 90.0,
) -> Recording:
    """Return the recommended commands as a recording without outputs.

    Parameters
    ----------
    examination : Examination, optional
        Of an earlier recording: its time constants set the lengths of the holds.
    missing : collection of str
        The parameters to make visible; what only others need is left out.
    sample_time : float, optional
        Of the commands [s]; that of the examination, or 0.2.
    low, high : float
        The lowest and the highest command the plant may see [%].

    Returns
    -------
    Recording
        Time and u.

    Raises
    ------
    RecordingError
        If the range is too small to show anything.
    """
    if not 0.0 <= low < high <= 100.0 or high - low < 20.0:
        raise RecordingError(
            f'commands from {low:g} to {high:g} %: expected a range of at least 20 % within 0 to '
            '100 %, or the valve shows nothing'
        )
    known = examination.sample_time if examination else float('nan')
    step = sample_time or (known if known > 0.0 else 0.2)
    filling, emptying = USUAL_FILLING, USUAL_EMPTYING
    if examination:
        filling = _likely(examination.filling.time_constant, filling)
        emptying = _likely(examination.emptying.time_constant, emptying)
    fill, empty = _hold(2.0 * filling, step), _hold(0.5 * emptying, step)
    back = _hold(0.2 * emptying, step)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    plan = [(middle, max(fill, empty))]
    if {'f_d1', 'f_s', 'f_d', 'a_1/a_2'} & set(missing):
        for away in SMALL_TURNS:
            level = middle + float(np.clip(away, -half, half))
            plan += [(level, fill if away > 0.0 else back), (middle, back if away > 0.0 else fill)]
    if {'f_s', 'f_d', 'T_g1'} & set(missing):
        plan += [(low + share * (high - low), fill) for share in STAIRS]
    if {'f_s', 'f_d', 'T_g2'} & set(missing):
        plan += [(high - share * (high - low), empty) for share in STAIRS]
    plan += [(low, empty), (high, _hold(4.0 * filling, step)), (low, _hold(2.0 * emptying, step))]
    levels = np.array([level for level, _ in plan])
    counts = np.array([max(round(seconds / step), 1) for _, seconds in plan])
    u = np.repeat(levels, counts)
    return Recording(
        time=np.round(np.arange(u.size, dtype=np.float64) * step, 9),
        u=u,
        provenance=Provenance(comments=('recommended test signal',)),
    )


def wanted(verdicts: Collection[Verdict]) -> tuple[str, ...]:
    """Return the parameters that ask for more; all if none does."""
    names = tuple(each.parameter for each in verdicts if each.cure or each.visibility == HIDDEN)
    return names or PARAMETERS


def _likely(found: float, usual: float) -> float:
    """Return an estimated time constant [s], unless it makes no sense."""
    return found if 0.01 * usual < found < 5.0 * usual else usual


def _hold(seconds: float, step: float) -> float:
    """Return a length for a hold: some samples at least, and nobody waits for ever."""
    return float(np.clip(seconds, 10.0 * step, LONGEST_HOLD))
