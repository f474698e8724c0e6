# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The race: each candidate effect is refitted together with the base valve of its group."""

from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
import os

from . import odds
from .adequacy import Leftover, leftover
from .alike import alike
from .base_valve import find_base
from .fitting import by_cost, FAINT, Fitter, GENERATIONS, NARROW, Valve
from .screening import Bases, screened
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
    swings_seen,
    WANDER,
)
from .stages import Candidate, Group
from .starts import friction_grid, grid, START
from .stretch import RESTS

ROUNDS = ((40, 5), (10, 14), (4, 30))
"""Rounds of a race where costs are rugged: how many still run, and for how many generations."""
FINISHERS, REFINED = 5, 2
"""How many runners are refitted, and refined to the end."""
FAR_AHEAD, BEHIND = 0.2, 0.5
"""Where the best leaves no more than this part of the cost, or nothing but noise, runners short of
more than a part of its gain are not followed."""
PROMISING = 0.05
"""Part of the gap that a first refit must close for any to be followed before all have begun."""
DEEPENED, OUTRUN = 3, 2.0
"""So many effects are searched more deeply where none explains what is left, none of which costs
more than this [cost of the best]."""

LAGS = ('T_g1', 'T_g2')


def race(
    fitter: Fitter,
    group: Group,
    valve: Valve,
    candidates: Sequence[Candidate],
    progress: Callable[[float], object] = lambda share: None,
    *,
    deeply: bool = False,
    hastily: bool = False,
    raced: Sequence[Valve] = (),
    stops: tuple[type[BaseException], ...] = (),
) -> list[Valve]:
    """Return valves with one more effect, best first; the better, the more refitted.

    `deeply` searches for the base valve anew beside the best, `hastily` leaves out effects whose
    search takes long if no other one explains nearly all. `raced` is what that ended with before.
    After one of `stops` it is what was found until then, and no further search begins.
    """
    found, runners = [*raced], list[Valve]()
    with fitter.ends_at(stops):
        runners = _run(fitter, group, valve, candidates, progress, found, deeply, hastily)
    if not (runners or found):
        fitter.alive()
    return runners or sorted(found, key=by_cost)


def _run(
    fitter: Fitter,
    group: Group,
    valve: Valve,
    candidates: Sequence[Candidate],
    progress: Callable[[float], object],
    found: list[Valve],
    deeply: bool,
    hastily: bool,
) -> list[Valve]:
    """Return the same to the end, while each valve that a search ends with is `found`."""
    raced = [*found]
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
            'swings': swings_seen(fitter.bench, residual),
            'steps': tuple(step for step, _ in fitter.bench.grids_of_x),
            'offsets': tuple(offset for _, offset in fitter.bench.grids_of_x),
            **calibration_seen(fitter.bench, results),
        }
        if not seen['steps']:  # then x keeps to none
            candidates = [each for each in candidates if each.effect != odds.COARSE]
        if not any(seen['offsets']):  # a grid through 0 needs none
            candidates = [each for each in candidates if not _shifted(each)]
        held = friction_seen(fitter.bench, results)[0]
        frictions = friction_grid(held)
        if 'f_d1' in free and valve.values['f_d1'] > valve.values['f_s']:
            # a play of the converter may have made up for friction
            frictions += [{**each, 'f_d1': START['f_d1']} for each in frictions]
        shown = {
            **{name: drift_seen(fitter.bench, results, name) for name in (DRIFT, WANDER)},
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

    def begun(candidate: Candidate) -> Valve:
        own, suited = candidate.starts(seen), candidate.suited(shown.get(candidate.effect, []))
        return noted(screened(fitter, candidate, group, valve, own, suited, frictions, lags, held))

    def noted(runner: Valve) -> Valve:
        found.append(runner)
        return runner

    def evolved(runner: Valve, generations: int) -> Valve:
        more = fitter.evolve(runner, fitter.problem(group, runner), generations)
        return noted(min(runner, more, key=by_cost))

    def fitted(runner: Valve) -> Valve:
        return noted(fitter.fit(runner, fitter.problem(group, runner)))

    def refined(runner: Valve) -> Valve:
        return noted(fitter.refined(runner, fitter.problem(group, runner)))

    def whole(runner: Valve) -> Leftover:
        return leftover(fitter.residuals(runner, group.signal))

    def excess(runner: Valve) -> float:
        return whole(runner).excess

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

        before = whole(valve)
        left = before.excess
        gap = valve.cost * left / (1.0 + left)
        waiting: list[Valve] = []

        def promising(runners: Sequence[Valve]) -> bool:
            gained = max((valve.cost - each.cost for each in runners), default=0.0)
            return not group.has_stem or gained >= PROMISING * gap

        def all_begun(
            some: Sequence[Candidate], how: Callable[[Candidate], Valve] = begun
        ) -> list[Valve]:
            return [*map(count, pool.map(how, some))]

        def heat(ahead: list[Valve], fresh: list[Valve], *, last: bool = False) -> list[Valve]:
            """Return the runners with fresh ones, which are refitted as far as they lead.

            If none of them is promising they wait for those of the next heat; in the last one they
            are followed only where too much is left to be called adequate.
            """
            nonlocal waiting
            fresh = sorted([*waiting, *fresh], key=by_cost)
            waiting = []
            if not fresh:
                return ahead
            if not (last or promising(fresh)):
                waiting = fresh
                return ahead
            if last and odds.adequate(group.signal, before) and not promising(fresh):
                return sorted([*ahead, *fresh], key=by_cost)
            for most, generations in ROUNDS if group.has_stem else ():
                slowest = sorted(each.cost for each in (*ahead, *fresh))[:most][-1]
                among = sum(each.cost <= slowest for each in fresh)
                if among:
                    fresh = followed(partial(evolved, generations=generations), fresh, among)
            runners = followed(fitted, sorted([*ahead, *fresh], key=by_cost), FINISHERS, ahead)
            if not group.has_stem:
                return runners
            near = sum(excess(each) <= odds.CLEAN for each in runners[:REFINED])
            return followed(refined, runners, near or REFINED, ahead)

        def nearly_all(best: Valve) -> bool:
            return odds.nearly_all(before, whole(best))

        def closes_most(some: Sequence[Valve]) -> bool:
            best = min(some, key=by_cost, default=valve)
            return before.closed_by(whole(best)) >= odds.MOSTLY

        if not group.has_stem and left < FAINT:  # behind nothing a law needs no more parameters
            candidates = [each for each in candidates if not each.extends(candidates)]
        quick, imitated, slow = (
            [each for each in candidates if each.tier == tier] for tier in range(3)
        )
        # what rests show is led by single slips: that waits where others close most without
        told = [each for each in quick if shown.get(each.effect)]
        if raced:
            runners, waiting = ([*raced], []) if promising(raced) else ([], [*raced])
        else:
            fresh = all_begun([each for each in quick if each not in told])
            if not closes_most(fresh):
                fresh, told = [*fresh, *all_begun(told)], []
            runners = heat([], fresh)
            for some in (told, imitated):
                # where there is no gap nothing closes it
                if runners and left >= FAINT and nearly_all(runners[0]):
                    effect = runners[0].candidates[-1].effect
                    some = [each for each in some if odds.look_alike(effect, each.effect)]
                runners = heat(runners, all_begun(some))
        ended = sorted([*runners, *waiting], key=by_cost)
        mostly = closes_most(ended)
        hasty = hastily and ended and not nearly_all(ended[0])
        # in haste what explains most was deepened already
        if deeply and runners and (mostly if hasty else not (raced and mostly)):
            ended = runners = _deepened(
                fitter, group, valve, runners, [*quick, *imitated], progress
            )
        if hasty and not nearly_all(ended[0]):
            return alike(fitter, group, ended)
        best = ended[0] if ended else valve
        hidden = [e for e in slow if left < FAINT and odds.imitates(valve, e.effect)]
        if nearly_all(best):
            effect = best.candidates[-1].effect
            slow = [e for e in slow if e in hidden or odds.look_alike(effect, e.effect)]
        elif ended and left < (odds.CLEAN if valve.candidates else odds.SPOTLESS):
            slow = [e for e in slow if e in hidden or not e.laborious]
        # a law with one more parameter is tried only where the plain one leaves something
        further = [e for e in slow if group.has_stem and e.extends(slow)]
        runners = heat(runners, all_begun([e for e in slow if e not in further]), last=not further)
        how = begun
        if runners:
            plain = runners[0]
            law = plain.candidates[-1]
            if nearly_all(plain) or (law in slow and excess(plain) <= odds.SPOTLESS):
                further = []
            elif law in slow and before.closed_by(whole(plain)) >= odds.MOSTLY:
                further = [e for e in further if e.effect == law.effect]

                def how(candidate: Candidate) -> Valve:
                    return noted(_carried_on(fitter, group, plain, candidate))

        runners = heat(runners, all_begun(further, how), last=True)
        if deeply:
            runners = _deepened(fitter, group, valve, runners, slow, progress)
    return alike(fitter, group, runners)


def _shifted(candidate: Candidate) -> bool:
    """Tell whether it is a coarse sensor whose grid does not go through 0."""
    return candidate.effect == odds.COARSE and 'offset' in candidate.names


def _carried_on(fitter: Fitter, group: Group, plain: Valve, candidate: Candidate) -> Valve:
    """Return a valve with a law that has one more parameter, begun from the plain one."""
    there = replace(plain, candidates=(*plain.candidates[:-1], candidate))
    return fitter.evolve(there, fitter.problem(group, there), GENERATIONS, NARROW)


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
    near = [each for each in runners if each.cost <= OUTRUN * best.cost]
    for each in in_reach(valve, odds.best_per_effect(near)[:DEEPENED]):
        # far behind one that explains the signal, others need no deeper search
        hopeless = explains(best) and each.cost > best.cost / FAR_AHEAD
        added = each.candidates[-1]
        if hopeless or added not in candidates or added.laborious:
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
    if group.has_stem and not odds.no_base(leftover(fitter.residuals(best, group.signal)), group):
        best = fitter.refined(best, problem)
    return min(valve, best, key=by_cost)
