# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A coarse position sensor, told by the values that x takes.

Under a noise of a third of a step, rounding what is modelled explains no more of x than not to
round it: nothing but these values shows the steps then.
"""

from collections.abc import Sequence
from dataclasses import replace
import math

from . import odds
from .adequacy import leftover
from .fitting import Fitter
from .odds import COARSE
from .outcome import Ladder
from .readings import OFF
from .rung import Rung
from .stages import Candidate


def rounded(fitter: Fitter, ladder: Ladder, candidates: Sequence[Candidate]) -> Ladder:
    """Return the ladder of an x that lies on steps with these named, too."""
    offset = fitter.bench.grid_of_x[1]
    candidate = next(
        each
        for each in candidates
        if each.effect == COARSE and ('offset' in each.names) == (offset != 0.0)
    )
    rung = _read(fitter, ladder, candidate)
    return replace(
        ladder,
        outcome='missing_effect',
        valve=rung.valve,
        after=rung.after,
        rungs=(*ladder.rungs, rung),
    )


def _read(fitter: Fitter, ladder: Ladder, candidate: Candidate) -> Rung:
    """Return the step to a coarse sensor.

    The evidence is that all independent values lie so near to multiples of a step by chance.
    """
    group, before = ladder.group, ladder.after
    step, offset = fitter.bench.grid_of_x
    own = {f'{COARSE}.step': step, f'{COARSE}.offset': offset}
    valve = replace(
        ladder.valve,
        values={**ladder.valve.values, **own},
        effects=(*ladder.valve.effects, COARSE),
        candidates=(*ladder.valve.candidates, candidate),
    )
    after = leftover(fitter.residuals(valve, group.signal))
    gains = {COARSE: -before.samples / before.inflation * math.log(2.0 * OFF)}
    probability = odds.probability(gains, COARSE, 1.0)
    closed = before.closed_by(after)
    return Rung(COARSE, candidate.stage, gains, before, after, closed, probability, (), valve)
