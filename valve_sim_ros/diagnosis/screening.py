# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A first refit of the base valve with one candidate, from all starts of that."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..model.effects import CATALOGUE
from . import odds
from .base_valve import with_any_stem
from .clues import Clues
from .fitting import by_cost, eased, Fitter, LONG, Problem, SHORT, Valve
from .single_slips import DESCENT, slip_by_slip
from .stages import Candidate, Group
from .starts import KINETIC, Starts
from .stretch import PUT_TO_REST, RESTS

MOST_STARTS, FEWER_STARTS = 24, 8
"""Up to so many starts of an effect are tried with each level of friction; if there are more, only
so many of the best."""
SCREENED, SCREENED_IF_SMOOTH = 3, 8
"""How many starts of a candidate are followed (more without a stem: such fits are quick)."""


def screened(
    fitter: Fitter,
    candidate: Candidate,
    group: Group,
    valve: Valve,
    clues: Clues,
) -> Valve:
    """Return the valve with one more effect after a short refit of its group."""
    own, suited = clues.own(candidate), clues.suited(candidate)
    there = replace(
        valve,
        effects=tuple(dict.fromkeys((*valve.effects, candidate.effect))),
        candidates=(*valve.candidates, candidate),
    )
    problem = fitter.problem(group, there)
    way = eased(problem)[0] if group.has_stem else problem
    usual = {**candidate.neutral, **valve.values}
    if len(own) > MOST_STARTS:
        costs = [fitter.scan(there, [{**usual, **start}], way)[0].cost for start in own]
        # of those that act at the same sample one is enough
        own = [own[index] for index in np.unique(costs, return_index=True)[1][:FEWER_STARTS]]
    own = [*own, *suited]

    levels = [level for level in (usual['f_s'], clues.held) if level > 0.0]

    def balanced(start: Mapping[str, float]) -> Starts:
        each = [candidate.balanced(level, usual, start) for level in levels]
        # held as before, the stem may slip as before or further
        further = [{**some[0], **share} for some in each if some for share in KINETIC]
        return [*(one for some in each for one in some), *further] or [{}]

    def around(bases: Starts) -> list[Starts]:
        each = [balanced(start) for start in own]
        return [
            [{**usual, **base, **start} for base in (*some, *bases)]
            for some, start in zip(each, own, strict=True)
        ]

    def best(starts: Sequence[Starts], way: Problem, count: int) -> list[Valve]:
        each = [fitter.scan(there, some, way)[0] for some in starts]
        best = sorted(each, key=by_cost)[:count]
        # without the effect a stem may have been found that creeps instead of swinging
        return [with_any_stem(fitter, one, way) for one in best] if group.has_stem else best

    def descended(start: Mapping[str, float]) -> Valve:
        """Return where a start leads from the valve as it is, which the other effect explains.

        What does next to nothing there costs least at first: a bump where the stem never is.
        """
        held_alike = [{**usual, **base, **start} for base in balanced(start)]
        found = [replace(there, values={**usual, **start}), *fitter.scan(there, held_alike, way)]
        return min((fitter.fit(one, way, DESCENT) for one in found), key=by_cost)

    starts = around(clues.frictions if group.has_stem else clues.lags)
    found = best(starts, problem, SCREENED if group.has_stem else SCREENED_IF_SMOOTH)
    first = not group.unknowns_of(valve.candidates)
    if group.has_stem and not first:
        found += sorted(map(descended, own), key=by_cost)[:SCREENED]
    if group.has_stem and clues.lags != [{}] and first:
        anew = [some[1:] for some in around(clues.lags)]
        found += [fitter.fit(each, way, SHORT) for each in best(anew, way, 1)]
    effect = CATALOGUE[candidate.effect]
    # in a second look the stem is put to rest for all, and beside another effect it takes long
    caught = not PUT_TO_REST.isdisjoint(fitter.drive)
    led = RESTS in fitter.drive or (caught and (candidate.laborious or not effect.rugged))
    # what tells on every slip
    some = starts if effect.rugged or effect.imitated else starts[len(own) - len(suited) :]
    odd = odds.imitates(valve, candidate.effect)
    if some and (odd or (not led and (first or effect.rugged))):
        each = [one for each in some for one in each]
        found += slip_by_slip(fitter, there, each, problem, clues.held)
    elif way != problem:
        found += [fitter.fit(each, way, SHORT) for each in best(starts, way, 1)]
    steps = SHORT if group.has_stem else LONG
    return min((fitter.fit(each, problem, steps) for each in found), key=by_cost)
