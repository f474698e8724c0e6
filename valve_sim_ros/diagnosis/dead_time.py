# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The dead time of the converter: p1 shows it to a sample, what follows tells the rest."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .fitting import Fitter, Valve
from .outcome import Ladder

EFFECT = 'ip_dead_time'
TIME = f'{EFFECT}.dead_time'
TOLD = 0.05
"""What follows p1 tells it to this part of a sample period."""


def settled(
    fitter: Fitter, ladders: Sequence[Ladder]
) -> tuple[list[Ladder], dict[str, tuple[float, float]]]:
    """Put into the dead time what the phase of the commands, as seen behind p1, tells of it.

    Parameters
    ----------
    fitter : Fitter
        At the bench.
    ladders : sequence of Ladder
        Of all groups, in the order of the flow.

    Returns
    -------
    list of Ladder
        With the dead time that p1 and what follows tell together, phase 0.
    dict of str to (float, float)
        Its 95 % interval [s] by full name; nothing if p1 shows no dead time.
    """
    first, *later = ladders
    if first.group.signal != 'p1' or EFFECT not in first.valve.effects:
        return list(ladders), {}
    period = fitter.bench.period
    seen = first.valve.values[TIME]
    blind = not later or later[0].outcome == 'unknown_effect'
    told = seen if blind else seen - period * later[0].valve.values['phase']

    def late(valve: Valve, time: float) -> Valve:
        return replace(valve, values={**valve.values, TIME: time, 'phase': 0.0})

    def cost(time: float) -> float:
        # p1 tells between which samples, what follows where
        return fitter.score(late(first.valve, time), 'p1') + ((time - told) / (TOLD * period)) ** 2

    times = np.maximum(told + np.linspace(-period, period, 41), 0.0)
    best = float(min(times, key=cost))
    # when a command acts is not known better than a sample
    span = max(best - period, 0.0), best + period
    return [replace(each, valve=late(each.valve, best)) for each in ladders], {TIME: span}
