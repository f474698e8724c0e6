# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The race: each candidate effect is refitted together with the base valve of its group."""

from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
import os

import numpy as np
from scipy.signal import periodogram

from ..model.effects import CATALOGUE
from ..model.pipeline import Array
from . import odds
from .adequacy import leftover
from .alike import alike
from .base_valve import find_base, with_any_stem
from .fitting import by_cost, eased, FAINT, Fitter, LONG, Problem, SHORT, Valve
from .seen import (
    calibration_seen,
    DRIFT,
    drift_seen,
    DWELL,
    dwell_seen,
    friction_seen,
    shaken_seen,
    SHAKES,
    STOPS,
    stops_seen,
)
from .single_slips import slip_by_slip
from .stages import Candidate, Group
from .starts import friction_grid, grid, KINETIC, START
from .stretch import PUT_TO_REST, RESTS

ROUNDS = ((40, 5), (10, 14), (4, 30))
"""Rounds of a race where costs are rugged: how many still run, and for how many generations."""
MOST_STARTS, FEWER_STARTS = 24, 8
"""Up to so many starts of an effect are tried with each level of friction; if there are more, only
so many of the best."""
SCREENED, SCREENED_IF_SMOOTH, FINISHERS, REFINED = 3, 8, 5, 2
"""How many starts of a candidate are followed (more without a stem: such fits are quick), runners
refitted, and refined to the end."""
FAR_AHEAD, BEHIND = 0.2, 0.5
"""Where the best leaves no more than this part of the cost, or nothing but noise, runners short of
more than a part of its gain are not followed."""
NEARLY_ALL = 0.02
"""What the best may leave of the excess, and no more than noise, where effects that take long and
do not look like it are not tried."""

DEEPENED = 3
"""So many effects are searched more deeply where none explains what is left."""

Bases = list[dict[str, float]]
LAGS = ('T_g1', 'T_g2')


def race(
    fitter: Fitter,
    group: Group,
    valve: Valve,
    candidates: Sequence[Candidate],
    progress: Callable[[float], object] = lambda share: None,
    *,
    deeply: bool = False,
) -> list[Valve]:
    """Return valves with one more effect, best first; the better, the more refitted.

    `deeply` searches for the base valve anew beside the best.
    """
    seen: dict[str, tuple[float, ...]] = {}
    # without the effect a valve may have found its lags far off
    free = {each.name: each for each in fitter.unknowns(group)}
    lags: Bases = grid([free[name] for name in LAGS if name in free])
    frictions: Bases = [{}]
    held = valve.values['f_s']
    shown: dict[str, Bases] = {}
    if group.has_stem:
        results = fitter.results(valve)
        # whole slips would hide a swing
        residual = fitter.residuals(valve, group.signal, (*fitter.drive, RESTS))
        seen = {
            'swings': _swings(fitter, residual),
            'steps': tuple(step for step, _ in fitter.bench.grids_of_x),
            'offsets': tuple(offset for _, offset in fitter.bench.grids_of_x),
            **calibration_seen(fitter.bench, results),
        }
        if not any(seen['offsets']):  # a grid through 0 needs none
            candidates = [each for each in candidates if not _shifted(each)]
        held = friction_seen(fitter.bench, results)[0]
        frictions = friction_grid(held)
        if 'f_d1' in free and valve.values['f_d1'] > valve.values['f_s']:
            # a play of the converter may have made up for friction
            frictions += [{**each, 'f_d1': START['f_d1']} for each in frictions]
        shown = {
            DRIFT: drift_seen(fitter.bench, results),
            DWELL: dwell_seen(fitter.bench, results),
            SHAKES: shaken_seen(fitter.bench, held),
            STOPS: stops_seen(fitter.bench, results),
        }
    done = 0

    def count(runner: Valve) -> Valve:
        nonlocal done
        done += 1
        progress(done / len(candidates))
        return runner

    def screened(candidate: Candidate) -> Valve:
        own, suited = candidate.starts(seen), candidate.suited(shown.get(candidate.effect, []))
        return _screened(fitter, candidate, group, valve, own, suited, frictions, lags, held)

    def evolved(runner: Valve, generations: int) -> Valve:
        more = fitter.evolve(runner, fitter.problem(group, runner), generations)
        return min(runner, more, key=by_cost)

    def fitted(runner: Valve) -> Valve:
        return fitter.fit(runner, fitter.problem(group, runner))

    def refined(runner: Valve) -> Valve:
        return fitter.refined(runner, fitter.problem(group, runner))

    def excess(runner: Valve) -> float:
        return leftover(fitter.residuals(runner, group.signal)).excess

    def within(runners: Sequence[Valve], most: int) -> int:
        """Return how many are to be followed: none far behind one that explains nearly all."""
        best = runners[0]
        far_ahead = best.cost < FAR_AHEAD * valve.cost or excess(best) <= odds.SPOTLESS
        return len(in_reach(valve, runners[:most])) if far_ahead else most

    with ThreadPoolExecutor(os.cpu_count()) as pool:  # compiled runs release the lock

        def followed(
            how: Callable[..., Valve],
            runners: list[Valve],
            most: int,
            done: Collection[Valve] = (),
        ) -> list[Valve]:
            """Return the runners, the best but those `done` taken further, in their new order."""
            progress(1.0)
            most = within(runners, most)
            ahead = [each for each in runners[:most] if each not in done]
            others = [each for each in runners if each not in ahead]
            return sorted([*pool.map(how, ahead), *others], key=by_cost)

        def heat(ahead: list[Valve], some: Sequence[Candidate]) -> list[Valve]:
            """Return the runners with some more, which are refitted as far as they lead."""
            if not some:
                return ahead
            fresh = sorted(map(count, pool.map(screened, some)), key=by_cost)
            for left, generations in ROUNDS if group.has_stem else ():
                last = sorted(each.cost for each in (*ahead, *fresh))[:left][-1]
                among = sum(each.cost <= last for each in fresh)
                if among:
                    fresh = followed(partial(evolved, generations=generations), fresh, among)
            runners = followed(fitted, sorted([*ahead, *fresh], key=by_cost), FINISHERS, ahead)
            if not group.has_stem:
                return runners
            near = sum(excess(each) <= odds.CLEAN for each in runners[:REFINED])
            return followed(refined, runners, near or REFINED, ahead)

        slow = [each for each in candidates if _slow(each.effect)]
        quick = [each for each in candidates if each not in slow]
        runners = heat([], quick)
        if deeply and runners:
            runners = _deepened(fitter, group, valve, runners, quick, progress)
        best = runners[0] if runners else valve
        left = excess(valve)
        hidden = [e for e in slow if left < FAINT and odds.imitates(valve, e.effect)]
        if excess(best) <= min(odds.CLEAN, NEARLY_ALL * left):
            effect = best.candidates[-1].effect
            slow = [e for e in slow if e in hidden or odds.look_alike(effect, e.effect)]
        elif runners and left < (odds.CLEAN if valve.candidates else FAINT):
            slow = [e for e in slow if e in hidden or not CATALOGUE[e.effect].laborious]
        runners = heat(runners, slow)
        if deeply:
            runners = _deepened(fitter, group, valve, runners, slow, progress)
    return alike(fitter, group, runners)


def _shifted(candidate: Candidate) -> bool:
    """Tell whether it is a coarse sensor whose grid does not go through 0."""
    return candidate.effect == odds.COARSE and 'offset' in candidate.names


def _slow(effect: str) -> bool:
    """Tell whether a search for an effect takes many times as long as one for another."""
    return CATALOGUE[effect].laborious or CATALOGUE[effect].rugged


def in_reach(valve: Valve, runners: Sequence[Valve]) -> list[Valve]:
    """Return the runners that are not far behind the first in what they gain over the valve."""
    best = runners[0].cost
    return [each for each in runners if each.cost <= best + BEHIND * (valve.cost - best)]


def _deepened(
    fitter: Fitter,
    group: Group,
    valve: Valve,
    runners: list[Valve],
    candidates: Collection[Candidate],
    progress: Callable[[float], object],
) -> list[Valve]:
    """Search for the base valve anew beside the best candidates, if none explains the signal.

    Not beside those whose runs take long: it would take minutes.
    """

    def explains(runner: Valve) -> bool:
        return leftover(fitter.residuals(runner, group.signal)).excess <= odds.CLEAN

    best = runners[0]
    if explains(best):
        return runners
    found = []
    for each in in_reach(valve, odds.best_per_effect(runners)[:DEEPENED]):
        # far behind one that explains the signal, others need no deeper search
        hopeless = explains(best) and each.cost > best.cost / FAR_AHEAD
        added = each.candidates[-1]
        if hopeless or added not in candidates or CATALOGUE[added.effect].laborious:
            continue
        progress(1.0)
        there = find_base(fitter, group, each, fitter.drive)
        found.append(fitter.refined(there, fitter.problem(group, there)))
        best = min(best, found[-1], key=by_cost)
    return alike(fitter, group, sorted([*found, *runners], key=by_cost)) if found else runners


def rebased(fitter: Fitter, group: Group, valve: Valve, runners: Sequence[Valve]) -> Valve:
    """Return the valve without a further effect, refitted from where the runners ended."""
    problem = fitter.problem(group, valve)
    names = [unknown.name for unknown in problem[0]]
    there = [
        replace(valve, values={**valve.values, **{name: r.values[name] for name in names}})
        for r in runners
    ]
    best = min((fitter.fit(each, problem) for each in there), key=by_cost)
    return min(valve, fitter.refined(best, problem) if group.has_stem else best, key=by_cost)


def _screened(
    fitter: Fitter,
    candidate: Candidate,
    group: Group,
    valve: Valve,
    own: Sequence[dict[str, float]],
    suited: Sequence[dict[str, float]],
    frictions: Bases,
    lags: Bases,
    held: float,
) -> Valve:
    """Return the valve with one more effect after a short refit of its group.

    `own` are starts of the effect, `suited` those that the data show, as they do what holds the
    stem, `held` [% of span].
    """
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

    levels = [level for level in (usual['f_s'], held) if level > 0.0]

    def balanced(start: Mapping[str, float]) -> Bases:
        each = [candidate.balanced(level, usual, start) for level in levels]
        # held as before, the stem may slip as before or further
        further = [{**some[0], **share} for some in each if some for share in KINETIC]
        return [*(one for some in each for one in some), *further] or [{}]

    def around(bases: Bases) -> list[Bases]:
        each = [balanced(start) for start in own]
        return [
            [{**usual, **base, **start} for base in (*some, *bases)]
            for some, start in zip(each, own, strict=True)
        ]

    def best(starts: Sequence[Bases], way: Problem, count: int) -> list[Valve]:
        each = [fitter.scan(there, some, way)[0] for some in starts]
        best = sorted(each, key=by_cost)[:count]
        # without the effect a stem may have been found that creeps instead of swinging
        return [with_any_stem(fitter, one, way) for one in best] if group.has_stem else best

    starts = around(frictions if group.has_stem else lags)
    found = best(starts, problem, SCREENED if group.has_stem else SCREENED_IF_SMOOTH)
    first = not group.unknowns_of(valve.candidates)  # beside another effect it takes too long
    if group.has_stem and lags != [{}] and first:
        anew = [some[1:] for some in around(lags)]
        found += [fitter.fit(each, way, SHORT) for each in best(anew, way, 1)]
    effect = CATALOGUE[candidate.effect]
    # in a second look the stem is put to rest for all
    led = RESTS in fitter.drive or (effect.laborious and not PUT_TO_REST.isdisjoint(fitter.drive))
    # what tells on every slip
    some = starts if effect.rugged or effect.imitated else starts[len(own) - len(suited) :]
    if first and not led and some:
        found += slip_by_slip(fitter, there, [one for each in some for one in each], problem)
    elif way != problem:
        found += [fitter.fit(each, way, SHORT) for each in best(starts, way, 1)]
    steps = SHORT if group.has_stem else LONG
    return min((fitter.fit(each, problem, steps) for each in found), key=by_cost)


def _swings(fitter: Fitter, residual: Array) -> tuple[float, ...]:
    """Return the frequencies at which a residual swings most, and their neighbours [Hz]."""
    period = float(np.median(np.diff(fitter.bench.stretches[0].time)))
    frequency, power = periodogram(np.clip(residual, -10.0, 10.0), 1.0 / period)
    inside = (frequency > 0.02) & (frequency < 0.45 / period)
    tops = frequency[inside][np.argsort(-power[inside])[:3]]
    return tuple(f + part * frequency[1] for f in tops for part in (-0.4, 0.0, 0.4))
