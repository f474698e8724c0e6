# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ladders of all groups of stages, climbed in the order of the flow."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
import math

from ..identification.watch import Progress
from . import dead_time, odds
from .adequacy import leftover
from .base_valve import find_base, standing_still
from .coarse import rounded
from .fitting import by_cost, FINE, Fitter, GENERATIONS, NARROW, PATIENT, Valve
from .ladder import climb, MOST_EFFECTS
from .loop import acts_back, closed_loop
from .outcome import but_seats, concluded, excused, Ladder
from .rung import Rung
from .stages import Candidate, Group
from .stretch import CAUGHT, HELD, MODELLED, RESTS
from .unknowns import PHASE


def climb_all(
    fitter: Fitter,
    parts: Sequence[Group],
    valve: Valve,
    without: Collection[str],
    tell: Progress,
    stops: tuple[type[BaseException], ...],
) -> tuple[list[Ladder], Valve]:
    """Climb the ladder of each group in the order of the flow; once stopped, only look at them.

    Also returned is the base valve, fitted to all signals without any effect that was added.
    """
    ladders: list[Ladder] = []
    base = valve
    for index, group in enumerate(parts):
        added = any(ladder.rungs for ladder in ladders)
        if added:
            with fitter.ends_at(stops):
                base = _refitted(fitter, group, base)
        share, width = 0.1 + 0.78 * index / len(parts), 0.78 / len(parts)
        text = f'looking at {group.signal}'
        known = {*without, *valve.effects}
        # a stem driven by a noisy p2 slips at other moments: nothing is named after such a one
        blind = any(
            ladder.outcome == 'unknown_effect' and ladder.group.signal == 'p2'
            for ladder in ladders
        )
        candidates = () if blind else group.candidates(known)
        drive, loop = fitter.drive, None
        if not group.has_stem:
            with fitter.ends_at(stops):
                fitter.drive = _best_drive(fitter, group, valve, ladders)
            # behind a law that is not quite right, what it leaves would be sought again
            drive = tuple(each for each in fitter.drive if each != HELD)
        elif _carries_on(fitter, group, valve):
            fitter.bench.before = valve.effects
            fitter.drive = drive = (*fitter.drive, MODELLED)
            if acts_back(valve):
                loop = partial(closed_loop, fitter, parts)
        carried = max((each.after.excess for each in ladders), default=0.0)
        climbing = partial(climb, fitter, group, named=added, stops=stops)
        first = partial(
            climbing,
            refit=bool(ladders),
            loop=loop,
            carried=carried,
            progress=_within(tell, share, width, text),
        )
        again = partial(
            climbing, refit=True, progress=_within(tell, share + width, 0.0, f'{text} again')
        )
        # x that lies on steps is told by these: they are named, and count as noise of the rest
        stepped = (
            group.has_stem
            and fitter.bench.grid_of_x[0] > 0.0
            and any(each.effect == odds.COARSE for each in candidates)
        )
        others = candidates
        if stepped:
            fitter.bench.forgive_steps()
            others = [each for each in candidates if each.effect != odds.COARSE]
            first, again = partial(first, named=True), partial(again, named=True)
        if group.has_stem:
            ladder = _quickly(fitter, valve, others, first, again, stops)
        else:
            ladder = first(valve, candidates)
        if loop and not fitter.drive:
            drive = ()
            ladders = [replace(each, valve=ladder.valve) for each in ladders]
        fitter.drive = drive
        ladder = concluded(ladder)
        if added:
            plain = leftover(fitter.residuals(base, group.signal, ()))
            sure = all(
                each.before.closed_by(each.after) >= odds.EXPLAINED_BUT_FAR
                for each in ladders
                if each.rungs
            )
            ladder = excused(ladder, plain, carried, sure=sure)
        lost = ladder.outcome == 'unknown_effect'
        if group.has_stem and others and lost and ladder.complete:
            unknown, ladder = ladder, replace(ladder, complete=False)
            with fitter.ends_at(stops):
                ladder = _second_look(fitter, unknown, partial(again, unknown.valve, others))
        if stepped and ladder.outcome != 'unknown_effect':
            ladder = rounded(fitter, ladder, candidates)
        ladders.append(ladder)
        valve = ladder.valve
        if group.signal == 'p1' and dead_time.EFFECT in valve.effects:
            fitter.phase = PHASE  # p1 shows a dead time to a sample only, what follows the rest
        if not added:
            base = ladder.base
        inexact = group.signal == 'p1' and ladder.after.excess > odds.ADEQUATE
        if ladder.outcome == 'unknown_effect' or inexact:
            # what is wrong here must not be blamed on the stages that follow; a stem that is
            # driven by a noisy p2 would slip at other moments
            fitter.drive = (*fitter.drive, group.signal)
        if ladder.outcome == 'unknown_effect':
            for stretch in fitter.bench.stretches:
                stretch.stand_alone(group.signal)
    fitter.drive = ()
    return but_seats(ladders), base


def _second_look(fitter: Fitter, ladder: Ladder, again: Callable[[], Ladder]) -> Ladder:
    """Return what a stem shows that is put to rest where it was seen to rest, if it is named.

    A stem that slips on and on is soon a whole slip off, and then hides what each slip lacks.
    First it is only caught where it is far off; a search that strays even so is led more tightly.
    """
    drive, complete = fitter.drive, ladder.complete
    for how in (CAUGHT, RESTS):
        fitter.drive = (*drive, how)
        found = concluded(again())
        if found.complete and found.outcome != 'missing_effect' and found.best_guess:
            found = _patiently(fitter, found, found.best_guess)
        fitter.drive = drive
        complete = complete and found.complete
        if found.outcome == 'missing_effect':
            return replace(found, valve=_free(fitter, found.group, found.valve), base=ladder.base)
        if not complete:
            break
        if named := _let_go(fitter, ladder, found.best_guess):
            return named
    return replace(ladder, complete=complete)


def _quickly(
    fitter: Fitter,
    valve: Valve,
    candidates: Sequence[Candidate],
    climbing: Callable[..., Ladder],
    again: Callable[..., Ladder],
    stops: tuple[type[BaseException], ...],
) -> Ladder:
    """Return the ladder of a stem, races to their end only if nothing else explains it.

    One slip that comes at another moment spoils all that a free stem does until the next one: of
    two effects each looks as if it explained nothing. So before these it is looked at caught.
    """
    modelled = MODELLED in fitter.drive
    hasty = climbing(valve, candidates, hastily=True)
    found = concluded(hasty)
    alone = modelled and not fitter.drive  # what the whole loop explains is explained
    if alone or _final(found) or not hasty.complete or hasty.before.excess <= odds.CLEAN:
        return hasty
    base = hasty.base
    if found.outcome == 'unknown_effect':  # where little is left no slip hides much
        drive = fitter.drive
        caught = again
        # with x alone one that takes long is more likely than two at once
        for most in range(1, 2 if odds.x_alone(hasty.group) else MOST_EFFECTS + 1):
            fitter.drive = (*drive, CAUGHT)
            found = caught(base, candidates, hastily=True, most=most)
            fitter.drive = drive
            if free := _freed(fitter, hasty, concluded(found), stops):
                return free
            if not found.complete or len(found.rungs) < most:
                break
            base, caught = found.base, partial(again, refit=False, raced=found.raced)
    whole = climbing(hasty.base, candidates, refit=False, raced=hasty.raced)
    ended = whole.complete or concluded(whole).outcome == 'missing_effect'
    return whole if ended else replace(hasty, complete=False)


def _freed(
    fitter: Fitter, hasty: Ladder, caught: Ladder, stops: tuple[type[BaseException], ...]
) -> Ladder | None:
    """Return the ladder of a caught stem let go, if its names explain what a free one leaves."""
    if caught.outcome != 'missing_effect':
        return None
    free = caught.valve
    with fitter.ends_at(stops):
        free = _free(fitter, caught.group, free)
    after = leftover(fitter.residuals(free, caught.group.signal))
    found = replace(caught, base=hasty.base, valve=free, before=hasty.before, after=after)
    found = concluded(found)
    return found if _final(found) else None


def _free(fitter: Fitter, group: Group, valve: Valve) -> Valve:
    """Return a valve whose stem was put to rest, refined while it is free.

    Put to rest it does not show at which speed it stops.
    """
    problem = fitter.problem(group, valve)
    free = fitter.refined(valve, problem)
    there = standing_still(fitter, free, problem, [valve])
    return free if there is free else fitter.refined(there, fitter.problem(group, there))


def _final(ladder: Ladder) -> bool:
    """Tell whether names found in haste may stay: one that leaves more than noise may be wrong."""
    names = [rung.effect for rung in ladder.rungs]
    enough = len(names) > 1 or odds.nearly_all(ladder.before, ladder.after)
    # a stem that is next to the edge of a step always leaves more
    return ladder.outcome == 'missing_effect' and (enough or names == [odds.COARSE])


def _patiently(fitter: Fitter, ladder: Ladder, guess: Rung) -> Ladder:
    """Return the ladder with a name that explains most, if it explains x after a long search."""
    if guess.closed < odds.LEAST_LED or guess.too_large:
        return ladder
    *others, _ = guess.valve.candidates
    found = []
    for each in ladder.group.candidates():
        if each.effect == guess.effect:
            valve = replace(guess.valve, candidates=(*others, each))
            problem = fitter.problem(ladder.group, valve)
            found.append(fitter.fit(fitter.evolve(valve, problem, PATIENT, FINE), problem))
    return _named(fitter, ladder, replace(guess, valve=min(found, key=by_cost)))


def _named(fitter: Fitter, ladder: Ladder, rung: Rung) -> Ladder:
    """Return the ladder concluded with one name only."""
    after = leftover(fitter.residuals(rung.valve, ladder.group.signal))
    rung = replace(rung, before=ladder.before, after=after, closed=ladder.before.closed_by(after))
    return concluded(replace(ladder, valve=rung.valve, after=after, rungs=(rung,)))


def _let_go(fitter: Fitter, ladder: Ladder, guess: Rung | None) -> Ladder | None:
    """Return the ladder with a name that explains x once the stem is free, or None.

    A stem that is put to rest cannot swing: a vibration explains little of it.
    """
    if guess is None or guess.closed < odds.LEAST_LED or guess.too_large:
        return None
    valve = _free(fitter, ladder.group, guess.valve)
    found = _named(fitter, ladder, replace(guess, valve=valve))
    return found if found.outcome == 'missing_effect' else None


def _within(tell: Progress, start: float, width: float, text: str) -> Callable[[float], object]:
    """Return how to tell the progress of a part of the work."""
    return lambda done: tell(start + width * done, text)


def _carries_on(fitter: Fitter, group: Group, valve: Valve) -> bool:
    """Tell whether a stem is driven by a p2 that the effects named before it explain."""
    named = {candidate.effect for candidate in valve.candidates}
    alone = group.stages == ('p2-x',) and group.drive[-1] not in fitter.drive
    return alone and bool(named) and named == {*valve.effects}


def _best_drive(
    fitter: Fitter, group: Group, valve: Valve, ladders: Sequence[Ladder]
) -> tuple[str, ...]:
    """Return what drives a group as measured: what explains most, if an effect comes before it.

    The stem may act on these stages (a positioner, the chamber's volume), but as measured nobody
    knows it between its samples. Nor does a law that is not quite right drive them best.
    """
    modelled = fitter.drive
    held = (HELD,) if 'x' in fitter.bench.signals else ()
    drives = [(*modelled, *held)]
    if any(ladder.rungs for ladder in ladders):
        left = {ladder.group.signal: ladder.after.excess for ladder in ladders}
        inexact = [n for n in left if left[n] > odds.SPOTLESS and n not in modelled]
        for signals in ((), tuple(inexact)):
            drives += [(*modelled, *signals, *held), (*modelled, *signals)]
    first, *others = dict.fromkeys(drives)
    if not others:
        return first
    best, least = first, math.inf
    for drive in (first, *others):
        found = find_base(fitter, group, valve, drive, roughly=True)
        excess = leftover(fitter.residuals(found, group.signal, drive)).excess
        if excess < least:
            best, least = drive, excess
        if least <= odds.SPOTLESS:
            break
    return best


def _refitted(fitter: Fitter, group: Group, valve: Valve) -> Valve:
    """Return a valve refitted in one group behind stages that lack an effect."""
    valve = find_base(fitter, group, valve, (), roughly=True)
    problem = (fitter.unknowns(group), group.signal, ())
    if group.has_stem:
        valve = fitter.evolve(valve, problem, GENERATIONS, NARROW)
    return fitter.fit(valve, problem)
