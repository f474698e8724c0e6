# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Valves and effects whose law hangs on every slip, fitted to single slips first."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
import math

from ..model.effects import CATALOGUE
from . import odds
from .adequacy import Leftover, leftover
from .fitting import (
    by_cost,
    CROWD,
    eased,
    FAINT,
    FINE,
    Fitter,
    GENERATIONS,
    PATIENT,
    POPULATION,
    Problem,
    SHORT,
    Valve,
)
from .starts import nearby, sliding, STEMS
from .stretch import CAUGHT, PUT_TO_REST, RESTS, SOON

BEGUN, DESCENT, FOLLOWED, TURNS, FINEST = 8, 12, 3, 25, 0.3
"""So many starts are led to single slips; steps of that descent; so many of its ends are taken on
to all slips, by evolutions of so many generations that begin with so little spread [steps of
unknowns]."""
FINENESS, SCATTERS = 11, 4
"""Binary logarithm of how many are scattered around the best of them, caught, if none of these
explains all; and how many of those are taken on."""
FINELY = 13
"""The same for a law that falls with speed: its valley is long, narrow and bent."""
WORTH_LEADING = 0.95
"""Part of the cost of the base valve, caught as soon, beyond which such a law is not led on."""
FAR_OFF = 1.0
"""Excess of a caught stem beyond which it is not worth while to let it go, if the effect does not
mostly explain x either."""


def slip_by_slip(
    fitter: Fitter,
    valve: Valve,
    starts: Sequence[Mapping[str, float]],
    problem: Problem,
    held: float = math.nan,
) -> list[Valve]:
    """Return valves that were fitted to single slips first, and then to all in a row.

    `held` is what the data show to hold the stem [% of span], NaN if they do not.

    A stem that is put to rest wherever it was seen to rest begins each slip right, whatever it
    made of the one before: the cost has few valleys then.
    """
    unknowns, signal, drive = problem
    effect = CATALOGUE[valve.candidates[-1].effect] if valve.candidates else None
    by_stem = effect is not None and effect.rugged and effect.imitated != ''
    ways = eased(problem)
    if by_stem:
        ways = [(unknowns, signal, _put(drive, SOON)), *ways]
        each = _stem_by_stem(fitter, valve, starts, ways[0], held)
    else:
        each = _at_rest(fitter, valve, starts, problem)
    found: list[Valve] = []

    @cache
    def plain(drive: tuple[str, ...]) -> Leftover:
        """Return what the valve leaves without the effect that is sought, if one is."""
        effects = valve.effects[:-1] if valve.candidates else valve.effects
        without = replace(valve, effects=effects, candidates=valve.candidates[:-1])
        return leftover(fitter.residuals(without, signal, drive))

    def led(there: Valve) -> Leftover:
        """Lead a valve on to all slips; return what it leaves where that ended."""
        for way in ways:
            # single slips hardly tell the law: it is found where their moments hardly count
            turns, spread, size = TURNS, FINEST, POPULATION
            if SOON in way[2]:
                turns, spread, size = PATIENT, FINE, CROWD
            elif CAUGHT in way[2]:
                turns, spread = GENERATIONS, FINEST if by_stem else FINE
            more = fitter.evolve(there, way, turns, spread, size)
            there = fitter.fit(more, way, DESCENT)
            left = leftover(fitter.residuals(there, signal, way[2]))
            if left.excess > FAR_OFF and plain(way[2]).closed_by(left) < odds.MOSTLY:
                return left
        found.append(fitter.fit(there, problem, DESCENT))
        return left

    hidden = effect is not None and effect.imitated != '' and plain(drive).excess < FAINT
    if by_stem and not (hidden or _worth_leading(fitter, each[0], ways[0])):
        return [fitter.fit(each[0], problem, DESCENT)]
    if effect and effect.imitated and (hidden or not by_stem):
        # where the base valve leaves nothing, single slips do not lead
        scattered = nearby(each[0].values, unknowns, FINENESS)
        near = fitter.scan(each[0], scattered, problem, SCATTERS)
        found += [fitter.fit(there, problem, DESCENT) for there in near]
    for there in each[:FOLLOWED]:
        if led(there).excess <= odds.CLEAN:
            return found
    if effect and effect.rugged and not by_stem:
        scattered = nearby(each[0].values, unknowns, FINENESS)
        for there in fitter.scan(each[0], scattered, eased(problem)[0], SCATTERS):
            if led(there).excess <= odds.CLEAN:
                break
    return found


def _at_rest(
    fitter: Fitter, valve: Valve, starts: Sequence[Mapping[str, float]], problem: Problem
) -> list[Valve]:
    """Return valves that were fitted to single slips, best first."""
    unknowns, signal, drive = problem
    effect = CATALOGUE[valve.candidates[-1].effect] if valve.candidates else None
    # behind a play of the linkage x rests while the stem moves: it must not be stopped then
    how = CAUGHT if effect and effect.balance and effect.stage == 'sensor' else RESTS
    alone = (unknowns, signal, _put(drive, how))
    apart: dict[tuple[float, ...], list[Mapping[str, float]]] = {}
    names = [unknown.name for unknown in unknowns if unknown.name != 'f_s']
    for start, stem in product(starts, ({}, *STEMS)):
        values = {**start, **stem}
        apart.setdefault(tuple(values[name] for name in names), []).append(values)
    nearest = [fitter.scan(valve, some, alone)[0] for some in apart.values()]
    begun = sorted((fitter.fit(one, alone, SHORT) for one in nearest), key=by_cost)
    return sorted((fitter.fit(one, alone, DESCENT) for one in begun[:BEGUN]), key=by_cost)


def _stem_by_stem(
    fitter: Fitter,
    valve: Valve,
    starts: Sequence[Mapping[str, float]],
    soon: Problem,
    held: float,
) -> list[Valve]:
    """Return valves that were fitted from stems of all kinds, best first.

    A friction that falls with speed shows in trains of slips rather than in single ones, and a
    stem that creeps seems to rest: it is caught as soon as it is half a slip off.
    """
    names = [unknown.name for unknown in valve.candidates[-1].unknowns]
    level = held if held > 0.0 else valve.values['f_s']
    near = fitter.scan(valve, sliding(starts, names, level, FINELY), soon, BEGUN)
    each = [fitter.evolve(one, soon, GENERATIONS, FINE) for one in near]
    return sorted((fitter.fit(one, soon, DESCENT) for one in each), key=by_cost)


def _worth_leading(fitter: Fitter, valve: Valve, soon: Problem) -> bool:
    """Tell whether an effect gains so much over the base valve, both caught soon."""
    added = valve.candidates[-1].unknowns
    soon = (tuple(unknown for unknown in soon[0] if unknown not in added), *soon[1:])
    plain = replace(valve, effects=valve.effects[:-1], candidates=valve.candidates[:-1])
    plain = fitter.fit(fitter.evolve(plain, soon, GENERATIONS, FINE), soon, DESCENT)
    return valve.cost <= WORTH_LEADING * plain.cost


def _put(drive: tuple[str, ...], how: str) -> tuple[str, ...]:
    """Return a drive by which a stem is put to rest in another way."""
    return (*(each for each in drive if each not in PUT_TO_REST), how)
