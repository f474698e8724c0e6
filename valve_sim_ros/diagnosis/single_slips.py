# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Valves and effects whose law hangs on every slip, fitted to single slips first."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product

from ..model.effects import CATALOGUE
from . import odds
from .adequacy import Leftover, leftover
from .fitting import by_cost, eased, FAINT, FINE, Fitter, GENERATIONS, Problem, SHORT, Valve
from .starts import nearby, STEMS
from .stretch import CAUGHT, PUT_TO_REST, RESTS

BEGUN, DESCENT, FOLLOWED, TURNS, FINEST = 8, 12, 3, 25, 0.3
"""So many starts are led to single slips; steps of that descent; so many of its ends are taken on
to all slips, by evolutions of so many generations that begin with so little spread [steps of
unknowns]."""
FINENESS, SCATTERS = 11, 4
"""Binary logarithm of how many are scattered around the best of them, caught, if none of these
explains all; and how many of those are taken on."""
FAR_OFF = 1.0
"""Excess of a caught stem beyond which it is not worth while to let it go, if the effect does not
mostly explain x either."""


def slip_by_slip(
    fitter: Fitter, valve: Valve, starts: Sequence[Mapping[str, float]], problem: Problem
) -> list[Valve]:
    """Return valves that were fitted to single slips first, and then to all in a row.

    A stem that is put to rest wherever it was seen to rest begins each slip right, whatever it
    made of the one before: the cost has few valleys then.
    """
    unknowns, signal, drive = problem
    effect = CATALOGUE[valve.candidates[-1].effect] if valve.candidates else None
    # behind a play of the linkage x rests while the stem moves: it must not be stopped then
    how = CAUGHT if effect and effect.balance and effect.stage == 'sensor' else RESTS
    alone = (unknowns, signal, (*(each for each in drive if each not in PUT_TO_REST), how))
    apart: dict[tuple[float, ...], list[Mapping[str, float]]] = {}
    names = [unknown.name for unknown in unknowns if unknown.name != 'f_s']
    for start, stem in product(starts, ({}, *STEMS)):
        values = {**start, **stem}
        apart.setdefault(tuple(values[name] for name in names), []).append(values)
    nearest = [fitter.scan(valve, some, alone)[0] for some in apart.values()]
    begun = sorted((fitter.fit(one, alone, SHORT) for one in nearest), key=by_cost)
    each = sorted((fitter.fit(one, alone, DESCENT) for one in begun[:BEGUN]), key=by_cost)
    found: list[Valve] = []

    @cache
    def plain(drive: tuple[str, ...]) -> Leftover:
        """Return what the valve leaves without the effect that is sought, if one is."""
        effects = valve.effects[:-1] if valve.candidates else valve.effects
        without = replace(valve, effects=effects, candidates=valve.candidates[:-1])
        return leftover(fitter.residuals(without, signal, drive))

    def led(there: Valve) -> Leftover:
        """Lead a valve on to all slips; return what it leaves where that ended."""
        for way in eased(problem):
            # single slips hardly tell the law: it is found where their moments hardly count
            first = CAUGHT in way[2]
            turns, spread = (GENERATIONS, FINE) if first else (TURNS, FINEST)
            more = fitter.evolve(there, way, turns, spread)
            there = fitter.fit(more, way, DESCENT)
            left = leftover(fitter.residuals(there, signal, way[2]))
            if left.excess > FAR_OFF and plain(way[2]).closed_by(left) < odds.MOSTLY:
                return left
        found.append(fitter.fit(there, problem, DESCENT))
        return left

    if effect and effect.imitated and (not effect.rugged or plain(drive).excess < FAINT):
        # where the base valve leaves nothing, single slips do not lead
        scattered = nearby(each[0].values, unknowns, FINENESS)
        near = fitter.scan(each[0], scattered, problem, SCATTERS)
        found += [fitter.fit(there, problem, DESCENT) for there in near]
    for there in each[:FOLLOWED]:
        if led(there).excess <= odds.CLEAN:
            return found
    if effect and effect.rugged:
        scattered = nearby(each[0].values, unknowns, FINENESS)
        for there in fitter.scan(each[0], scattered, eased(problem)[0], SCATTERS):
            if led(there).excess <= odds.CLEAN:
                break
    return found
