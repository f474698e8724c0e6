# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The race: each candidate effect is refitted together with the base valve of its group."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from . import odds
from .adequacy import leftover
from .alike import alike
from .base_valve import find_base
from .clues import clues
from .fitting import by_cost, FAINT, Fitter, Valve
from .heats import FAR_AHEAD, Heats, in_reach, OUTRUN
from .stages import Candidate, Group
from .stretch import PUT_TO_REST

DEEPENED = 3
"""So many effects are searched more deeply where none explains what is left."""


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

    `deeply` searches for the base valve anew beside the best. `hastily` ends before effects whose
    search takes long, behind a measured p2 before their laws with one more parameter, unless one
    explains nearly all; beside another effect only if one explains most. `raced` is what that
    ended with before.
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
    shown = clues(fitter, group, valve)
    candidates = [each for each in candidates if shown.possible(each)]
    before = leftover(fitter.residuals(valve, group.signal))
    if not group.has_stem and before.excess < FAINT:
        # behind nothing a law needs no more parameters
        candidates = [each for each in candidates if not each.extends(candidates)]
    heats = Heats(fitter, group, valve, before, shown, len(candidates), progress, found)
    quick, imitated, slow = (
        [each for each in candidates if each.tier == tier] for tier in range(3)
    )
    if not raced:
        foretold = [each for each in candidates if each.effect == shown.foretold]
        heats.run(heats.screen(foretold))
        if deeply and heats.runners and heats.most(heats.runners):
            heats.runners = _deepened(heats, foretold)
        _run_quick(heats, quick, imitated)
    elif heats.promising(raced):
        heats.runners = raced
    else:
        heats.waiting = raced
    stem_only = len(group.stages) == 1 and PUT_TO_REST.isdisjoint(fitter.drive)
    beside = any(each.stage in group.stages for each in valve.candidates)
    enough = heats.most(heats.ended, odds.MOSTLY if beside else odds.EXPLAINED['x'])
    early = stem_only and not raced if hastily else raced
    if early and heats.ended and not enough:
        # one whose search takes long may explain all: before others are deepened in vain
        _run_slow(heats, slow, plainly=True)
    ended = heats.ended
    mostly = heats.most(ended)
    hasty = hastily and ended and (mostly or not beside) and not heats.nearly_all(ended[0])
    # in haste what explains most was deepened already
    if deeply and heats.runners and (mostly if hasty else not (raced and mostly)):
        ended = heats.runners = _deepened(heats, [*quick, *imitated])
    if hasty and not heats.nearly_all(ended[0]):
        return alike(fitter, group, ended)
    _run_slow(heats, slow)
    if deeply:
        heats.runners = _deepened(heats, slow)
    return alike(fitter, group, heats.runners)


def _run_quick(heats: Heats, quick: Sequence[Candidate], imitated: Sequence[Candidate]) -> None:
    """Run the heats of effects whose search is quick, and of those that a base valve imitates."""
    # what rests show is led by single slips: that waits where others close most without
    told = [each for each in quick if heats.clues.told.get(each.effect)]
    fresh = heats.screen(_worth([each for each in quick if each not in told], heats))
    if not heats.most([*heats.ended, *fresh]):
        fresh, told = [*fresh, *heats.screen(told)], []
    heats.run(fresh)
    for some in (told, imitated):
        heats.run(heats.screen(_worth(some, heats)))


def _worth(candidates: Sequence[Candidate], heats: Heats) -> Sequence[Candidate]:
    """Return the candidates that look like one that closes nearly all, all if none does."""
    # where there is no gap nothing closes it
    gap = heats.before.excess >= FAINT
    if gap and heats.runners and heats.nearly_all(best := heats.runners[0]):
        return [each for each in candidates if _like(best, each)]
    return candidates


def _run_slow(heats: Heats, slow: Sequence[Candidate], *, plainly: bool = False) -> None:
    """Run the heats of effects whose search takes long, as far as the others leave a reason.

    `plainly` leaves out laws that have one more parameter.
    """
    group, valve, left = heats.group, heats.valve, heats.before.excess
    best = next(iter(heats.ended), valve)
    hidden = [each for each in slow if left < FAINT and odds.imitates(valve, each.effect)]
    if heats.nearly_all(best):
        slow = [each for each in slow if each in hidden or _like(best, each)]
    little = odds.CLEAN if valve.candidates else FAINT if group.has_stem else odds.SPOTLESS
    if best is not valve and left < little:
        slow = [each for each in slow if each in hidden or not each.laborious]
    # a law with one more parameter is tried only where the plain one leaves something
    further = [each for each in slow if group.has_stem and each.extends(slow)]
    plain = heats.screen([each for each in slow if each not in further])
    heats.run(plain, last=not (further or plainly))
    if plainly:
        return
    fresh = []
    if heats.runners:
        best = heats.runners[0]
        law, after = best.candidates[-1], heats.left_by(best)
        if heats.nearly_all(best) or (law in slow and after.excess <= odds.SPOTLESS):
            further = []
        elif law in slow:
            own = [each for each in further if each.effect == law.effect]
            fresh = heats.extend(best, own)
            mostly = heats.before.closed_by(after) >= odds.MOSTLY
            further = [] if mostly else [each for each in further if each not in own]
    heats.run([*fresh, *heats.screen(further)], last=True)


def _like(best: Valve, candidate: Candidate) -> bool:
    """Tell whether an effect looks like the one that a valve has."""
    return odds.look_alike(best.candidates[-1].effect, candidate.effect)


def _deepened(heats: Heats, candidates: Collection[Candidate]) -> list[Valve]:
    """Search for the base valve anew beside the best candidates, if none explains the signal.

    Not beside those whose runs take long: it would take minutes.
    """
    fitter, group, runners = heats.fitter, heats.group, heats.runners

    def explains(runner: Valve) -> bool:
        return heats.left_by(runner).excess <= odds.CLEAN

    best = runners[0]
    if explains(best):
        return runners
    found = []
    near = [each for each in runners if each.cost <= OUTRUN * best.cost]
    for each in in_reach(heats.valve, odds.best_per_effect(near)[:DEEPENED]):
        # far behind one that explains the signal, others need no deeper search
        hopeless = explains(best) and each.cost > best.cost / FAR_AHEAD
        added = each.candidates[-1]
        if hopeless or added not in candidates or added.laborious:
            continue
        heats.progress(1.0)
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
