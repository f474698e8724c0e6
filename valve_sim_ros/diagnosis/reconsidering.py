# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The first name of two, chosen anew beside the second."""

from collections.abc import Sequence
from dataclasses import replace

from ..model.effects import CATALOGUE
from . import odds
from .adequacy import leftover
from .fitting import by_cost, Fitter, Valve
from .race import race, rebased
from .rung import judged, Rung
from .stages import Candidate, Group

RECONSIDERED, NEAR = 5, 0.5
"""So many rivals of the first effect are tried again beside the second, if they gained so much of
what it did."""


def reconsidered(
    fitter: Fitter, group: Group, base: Valve, rungs: Sequence[Rung], *, lightly: bool = False
) -> list[Rung]:
    """Return the rungs with the first name chosen anew beside the second, or one if that does.

    Alone, an effect may have been named because it made up for part of another one. `lightly`
    leaves out laborious effects but the first.
    """
    first, second = rungs[0], rungs[1]
    added = second.valve.candidates[-1]
    least = NEAR * first.gains[first.effect]
    rivals = [name for name in first.gains if first.gains[name] >= least]
    near = sorted(rivals, key=lambda name: -first.gains[name])[:RECONSIDERED]
    names = {first.effect, *(name for name in near if not (lightly and CATALOGUE[name].laborious))}
    others = group.candidates({*base.effects, second.effect})
    candidates = [each for each in others if each.effect in names]

    def alone(both: Valve, one: Candidate, other: Candidate) -> Valve:
        """Return the valve with only one of two effects."""
        valve = replace(
            both,
            effects=tuple(name for name in both.effects if name != other.effect),
            candidates=(*base.candidates, one),
        )
        problem = fitter.problem(group, valve)
        starts = [replace(valve, values=values) for values in other.let_go(both.values)]
        return min((fitter.fit(start, problem) for start in starts), key=by_cost)

    def enough(both: Rung, only: Valve) -> list[Rung]:
        """Return the step to one effect if two are hardly better."""
        if 0.5 * (only.cost - both.valve.cost) / both.after.worth >= odds.ENOUGH:
            return []
        runners = sorted((only, first.valve), key=by_cost)
        found = judged(fitter, group, base, first.before, runners)
        return [found] if found else []

    earlier = alone(second.valve, first.valve.candidates[-1], added)
    if only := enough(second, earlier):
        return only
    later = alone(second.valve, added, first.valve.candidates[-1])
    if not CATALOGUE[second.effect].laborious:  # the first may have led it into another valley
        later = min(later, *race(fitter, group, base, [added])[:1], key=by_cost)
    if only := enough(second, later):
        return only
    runners = race(fitter, group, later, candidates)
    later = rebased(fitter, group, later, runners[:5])
    if only := enough(second, later):
        return only
    before = leftover(fitter.residuals(later, group.signal))
    # as found it was searched for longer than beside the second alone
    *others_before, one, other = second.valve.candidates
    swapped = replace(second.valve, candidates=(*others_before, other, one))
    runners = sorted([*runners, swapped], key=by_cost)
    found = judged(fitter, group, later, before, runners)
    if found is None:
        return list(rungs)
    worse = 0.5 * (found.valve.cost - second.valve.cost) / found.after.worth
    if worse > odds.twin_limit(found.gains[found.effect]):
        return list(rungs)
    if found.effect == first.effect and worse > 0.0:
        found = replace(found, valve=second.valve, after=second.after)
    elif only := enough(found, alone(found.valve, found.valve.candidates[-1], added)):
        return only
    return [found, replace(second, after=found.after, valve=found.valve)]
