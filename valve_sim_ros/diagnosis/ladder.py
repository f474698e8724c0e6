# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ladder: in one group of stages, one effect after the other until noise is left."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..model.effects import CATALOGUE
from . import odds
from .adequacy import but_one_slip, Leftover, leftover
from .arrivals import put_in_its_period
from .base_valve import ahead_on_ramps, find_base, on_other_side, on_time, standing_still
from .clues import keeps_to_steps
from .fitting import by_cost, Fitter, Valve
from .loosening import loosened
from .outcome import Ladder
from .race import race, rebased
from .reconsidering import reconsidered
from .rung import judged, Rung
from .seen import rests_show
from .stages import Candidate, Group
from .stretch import HELD, MODELLED, PUT_TO_REST

MOST_EFFECTS = 2
"""Most effects named in one group of stages."""


def climb(
    fitter: Fitter,
    group: Group,
    valve: Valve,
    candidates: Sequence[Candidate],
    *,
    refit: bool,
    named: bool = False,
    carried: float = 0.0,
    hastily: bool = False,
    raced: Sequence[Valve] = (),
    most: int = MOST_EFFECTS,
    loop: Callable[[Valve], tuple[Valve, Leftover] | None] | None = None,
    progress: Callable[[float], object],
    stops: tuple[type[BaseException], ...],
) -> Ladder:
    """Add effects to a valve as long as the evidence asks for more; not concluded yet.

    Parameters
    ----------
    fitter : Fitter
        At the bench.
    group : Group
        The stages in question.
    valve : Valve
        With the effects of the stages before.
    candidates : sequence of Candidate
        What may be missing.
    refit : bool
        Find the base valve's values in these stages anew.
    named : bool
        Whether an effect is named in the stages before: one more needs more evidence.
    carried : float
        Excess that the signals before this one leave: if that is more than noise, no more than
        that says nothing.
    hastily : bool
        End races early, see `race`.
    raced : sequence of Valve
        What a first race ended with when done hastily.
    most : int
        Most effects to add.
    loop : callable, optional
        Fits a valve as it runs alone where the stem acts back, and tells what it leaves, if that
        explains more than a stem as measured.
    progress : callable
        Called with the share done.
    stops : tuple of type
        The exceptions that end the climb where it is.
    """
    rungs: list[Rung] = []
    guess = None
    first: list[Valve] = [*raced]
    chance: Leftover | None = None  # left where the gap is but slips that hang on noise
    complete = False
    again = not PUT_TO_REST.isdisjoint(fitter.drive)

    def seen(there: Valve) -> tuple[Valve, Leftover]:
        cost = fitter.score(there, group.signal, fitter.drive)
        return replace(there, cost=cost), leftover(fitter.residuals(there, group.signal))

    def worth(left: Leftover) -> bool:
        if odds.carried_on(left, carried):
            return False
        name = rungs[0].effect if rungs else ''
        # far errors come with every detail missed, or where x is next to the edge of a step
        if name == odds.COARSE or (name and CATALOGUE[name].rugged):
            return left.excess >= odds.CLEAN
        if rungs:
            return odds.unfinished(left, odds.MORE_EXCESS)
        if named and not odds.unfinished(left, odds.CLEAN):
            return False
        return odds.late(now, group) or odds.suspicious(left, group, fitter.bench.mixed)

    def chance_apart(valve: Valve, left: Leftover) -> Leftover:
        """Return what is left but for slips that hang on noise, all if it is worth a look."""
        if not group.has_stem or again or not worth(left):
            return left
        rest = leftover(but_one_slip(fitter.residuals(valve, group.signal)))
        if not worth(rest):
            return rest
        rest = on_time(fitter, group, valve)
        by_chance = rest.excess <= odds.SPOTLESS and rest.far < odds.MORE_FAR
        # a stem that is caught hides what stops it
        by_chance = by_chance and not rests_show(fitter.bench, fitter.results(valve))
        return rest if by_chance else left

    def sought(left: Leftover) -> Sequence[Candidate]:
        if left is not chance and worth(left):
            return candidates
        hidden = group.stages == ('p2-x',) and not (rungs or named or carried > odds.SPOTLESS)
        stepped = not (rungs or left is chance) and keeps_to_steps(fitter, group, now)
        return [
            each
            for each in candidates
            if (hidden and _imitated(each.effect, now)) or (stepped and each.effect == odds.COARSE)
        ]

    def explained(rung: Rung) -> bool:
        blurred = odds.blurred(rung.valve, fitter.bench.noise)
        return odds.explained(group.signal, base_left, rung.after, [rung.effect], blurred)

    now, before = base, base_left = seen(valve)
    with fitter.ends_at(stops):
        progress(0.0)
        if refit:
            now, before = seen(find_base(fitter, group, valve, fitter.drive, carried=carried))
            modelled = group.has_stem and group.drive and not {*fitter.drive} - {MODELLED}
            if modelled and before.excess > odds.SPOTLESS:
                loose, left = seen(loosened(fitter, group, now))
                if not worth(left):
                    now, before = loose, left
            if loop and worth(before) and (alone := loop(now)):
                now, before = alone
            base, base_left = now, before
        rest = chance_apart(now, before)
        if rest is not before:
            before = base_left = chance = rest
        hastily = hastily and before.excess > odds.CLEAN  # little is looked at as a whole at once
        for step in range(most):
            some = sought(before)
            if not some:
                break
            # where the stem alone is put to rest, no valley of the base is missed
            hidden = len(group.stages) > 1 or not again
            deeply = group.has_stem and some is candidates and not rungs and hidden
            runners = race(
                fitter,
                group,
                now,
                some,
                _within(progress, step),
                deeply=deeply,
                hastily=hastily,
                raced=raced if some is candidates and not rungs else (),
                stops=stops,
            )
            first = first or runners
            with fitter.ends_at(stops):
                now = rebased(fitter, group, now, runners[:5])
            before = leftover(fitter.residuals(now, group.signal))
            if not rungs:
                base, base_left = now, before
            rung = judged(fitter, group, now, before, runners)
            if rung and some is not candidates:  # another valley of the base valve may do as well
                close = find_base(fitter, group, now, fitter.drive, closely=True)
                now, before = seen(min(now, close, key=by_cost))
                base, base_left = now, before
                rung = judged(fitter, group, now, before, runners)
            if rung is None or rung.effect not in {each.effect for each in sought(before)}:
                break
            with fitter.ends_at(stops):  # an end here leaves the name as it is
                rung = _with(fitter, group, rung, on_other_side(fitter, group, rung.valve))
                rung = _on_time(fitter, group, rung)
            gained = rung.gains[rung.effect]
            if not odds.strong(
                group.signal, before, gained, rung.closed, first=not rungs, named=named
            ):
                guess = guess or rung
                break
            if rungs:
                both = [*rungs, rung]
                with fitter.ends_at(stops):
                    both = reconsidered(fitter, group, base, both, lightly=again)
                names = [each.effect for each in both]
                # one that does is the first, found better, or the second alone
                needed = odds.needed(base_left, before, rung.closed, both[-1].after, names)
                if len(both) > 1 and not needed:
                    guess = guess or rung
                    break
                rungs, rung = both[:-1], both[-1]
            elif not explained(rung):
                guess = rung
                if loop and rung.closed >= odds.LEAST_LED and (alone := loop(rung.valve)):
                    now, before = alone
                    rungs.append(_ending(rung, now, before))
                    break
                little = again or odds.adequate(group.signal, base_left)
                if rung.closed < (odds.LEAST_AGAIN if little else odds.LEAST_FIRST):
                    break
                if CATALOGUE[rung.effect].rugged and not again:
                    break
                if hastily and not again and rung.closed < odds.MOSTLY:
                    break
            rungs.append(rung)
            now, before = rung.valve, rung.after  # first, so that an end here loses nothing
            rung = rungs[-1] = _with_its_own_stem(fitter, group, rung)
            before = rung.after
            rest = chance_apart(now, before)
            if rest is not before:
                before = rest
                rungs[-1] = _ending(rung, now, rest)
                break
            others = [each for each in candidates if each.effect != rung.effect]
            quick = [each for each in others if not each.laborious]
            candidates = quick if again and not hastily else others
        progress(1.0)
        fitter.alive()
        complete = True
    after = before if rungs else leftover(fitter.residuals(now, group.signal))
    return Ladder(
        group,
        'adequate',
        base,
        now,
        base_left,
        after,
        tuple(rungs),
        guess,
        complete,
        odds.blurred(now, fitter.bench.noise),
        tuple(first),
    )


def _on_time(fitter: Fitter, group: Group, rung: Rung) -> Rung:
    """Return a step with commands, and the speed of stopping, as its valve shows them."""
    valve = ahead_on_ramps(fitter, group, rung.valve, fitter.problem(group, rung.valve))
    valve = standing_still(fitter, valve, fitter.problem(group, valve))
    valve = put_in_its_period(fitter, group, valve, fitter.problem(group, valve))
    return _with(fitter, group, rung, valve)


def _with(fitter: Fitter, group: Group, rung: Rung, valve: Valve) -> Rung:
    """Return a step that ends at another valve."""
    if valve is rung.valve:
        return rung
    return _ending(rung, valve, leftover(fitter.residuals(valve, group.signal)))


def _ending(rung: Rung, valve: Valve, after: Leftover) -> Rung:
    """Return a step that ends at another valve, which leaves `after`."""
    return replace(rung, valve=valve, after=after, closed=rung.before.closed_by(after))


def _with_its_own_stem(fitter: Fitter, group: Group, rung: Rung) -> Rung:
    """Return a step with what its valve leaves beside its own stem, if that is less.

    As measured nobody knows the stem between its samples.
    """
    if HELD not in fitter.drive:
        return rung
    drive = tuple(each for each in fitter.drive if each != HELD)
    after = leftover(fitter.residuals(rung.valve, group.signal, drive))
    return rung if after.excess >= rung.after.excess else _ending(rung, rung.valve, after)


def _imitated(effect: str, base: Valve) -> bool:
    """Tell whether to look for an effect where a base valve leaves nothing but noise."""
    if CATALOGUE[effect].laborious:
        return odds.imitates(base, effect)
    return CATALOGUE[effect].imitated != ''


def _within(progress: Callable[[float], object], step: int) -> Callable[[float], object]:
    """Return how to tell the progress of one step of the ladder."""
    return lambda share: progress((step + share) / MOST_EFFECTS)
