# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Effects whose law hangs on every slip, fitted to single slips first."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product

from . import odds
from .adequacy import Leftover, leftover
from .fitting import by_cost, eased, FINE, Fitter, GENERATIONS, Problem, SHORT, Valve
from .starts import STEMS
from .stretch import CAUGHT, PUT_TO_REST, RESTS

BEGUN, DESCENT, FOLLOWED, TURNS, FINEST = 8, 12, 3, 25, 0.3
"""So many starts are led to single slips; steps of that descent; so many of its ends are taken on
to all slips, by evolutions of so many generations that begin with so little spread [steps of
unknowns]."""
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
    alone = (unknowns, signal, (*(each for each in drive if each not in PUT_TO_REST), RESTS))
    apart: dict[tuple[float, ...], list[Mapping[str, float]]] = {}
    names = [unknown.name for unknown in unknowns if unknown.name != 'f_s']
    for start, stem in product(starts, STEMS):
        values = {**start, **stem}
        apart.setdefault(tuple(values[name] for name in names), []).append(values)
    nearest = [fitter.scan(valve, some, alone)[0] for some in apart.values()]
    begun = sorted((fitter.fit(one, alone, SHORT) for one in nearest), key=by_cost)
    each = sorted((fitter.fit(one, alone, DESCENT) for one in begun[:BEGUN]), key=by_cost)
    found: list[Valve] = []

    @cache
    def plain(drive: tuple[str, ...]) -> Leftover:
        """Return what the valve leaves without the effect."""
        without = replace(valve, effects=valve.effects[:-1], candidates=valve.candidates[:-1])
        return leftover(fitter.residuals(without, signal, drive))

    for there in each[:FOLLOWED]:
        for way in eased(problem):
            # single slips hardly tell the law: it is found where their moments hardly count
            first = CAUGHT in way[2]
            turns, spread = (GENERATIONS, FINE) if first else (TURNS, FINEST)
            more = fitter.evolve(there, way, turns, spread)
            there = fitter.fit(more, way, DESCENT)
            left = leftover(fitter.residuals(there, signal, way[2]))
            if left.excess > FAR_OFF and plain(way[2]).closed_by(left) < odds.MOSTLY:
                break
        else:
            found.append(fitter.fit(there, problem, DESCENT))
        if left.excess <= odds.CLEAN:
            break
    return found
