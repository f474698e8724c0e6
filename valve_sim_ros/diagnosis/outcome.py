# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was found in one group of stages, and its outcome: named, unknown, or nothing missing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from . import odds
from .adequacy import Leftover
from .fitting import Valve
from .rung import Rung
from .seats import ENDS, ends_of, STOPS
from .stages import Group

Outcome = Literal['adequate', 'missing_effect', 'unknown_effect']


@dataclass(frozen=True)
class Ladder:
    """What was found in one group of stages."""

    group: Group
    outcome: Outcome
    base: Valve
    valve: Valve
    before: Leftover
    after: Leftover
    rungs: tuple[Rung, ...] = ()
    best_guess: Rung | None = None
    complete: bool = True
    """Whether all that could be missing was tried; not so if the diagnosis was stopped."""
    blurred: float = 0.0
    """Excess that comes of the noise of a measured x."""
    raced: tuple[Valve, ...] = ()
    """How its first race ended."""

    @property
    def nearest(self) -> str:
        """What comes nearest to an effect that is unknown, and why it is not named, in words."""
        if self.outcome != 'unknown_effect' or not self.best_guess:
            return ''
        large = self.best_guess.too_large
        why = 'would be far larger than usual' if large else 'leaves too much of the gap open'
        return f'the least bad, {self.best_guess.effect}, {why}'

    @property
    def told(self) -> str:
        """The outcome in words."""
        return self.outcome.replace('_', ' ') + ('' if self.complete else ', not all was tried')


def concluded(ladder: Ladder) -> Ladder:
    """Return the ladder with its outcome: names only if together they explain the gap.

    None of them may be far larger than it usually is.
    """
    names = [rung.effect for rung in ladder.rungs]
    signal = ladder.group.signal
    # next to nothing is left to close where the base valve imitates it
    hidden = all(odds.imitates(ladder.base, name) for name in names)
    spotless = hidden and ladder.after.excess <= odds.SPOTLESS
    explained = odds.explained(signal, ladder.before, ladder.after, names, ladder.blurred)
    guess = ladder.best_guess
    if names and (spotless or explained):
        ended = [replace(rung, valve=ladder.valve) for rung in ladder.rungs]
        large = [rung for rung in ended if rung.too_large]
        if not large:
            return replace(ladder, outcome='missing_effect')
        guess = large[0]
    # what does not explain the gap is not left in the valve either
    outcome: Outcome = 'adequate' if odds.adequate(signal, ladder.before) else 'unknown_effect'
    return replace(
        ladder,
        outcome=outcome,
        valve=ladder.base,
        after=ladder.before,
        rungs=(),
        best_guess=guess,
    )


def but_seats(ladders: Sequence[Ladder]) -> list[Ladder]:
    """Return the ladders in which the ends of the stroke are no name beside another effect.

    The valve keeps them: what presses a stem beyond 0 or 100 % presses it into its seat.
    """
    named = {rung.effect for ladder in ladders for rung in ladder.rungs}
    valve = ladders[-1].valve
    stops = [n for c in valve.candidates if c.effect == STOPS for n in c.names if n in ENDS]
    if named <= {STOPS} or len(ends_of(valve.values, stops)) < len(stops):
        return [*ladders]
    found = []
    for each in ladders:
        rungs = tuple(rung for rung in each.rungs if rung.effect != STOPS)
        gone = each.rungs and not rungs
        found.append(replace(each, rungs=rungs, outcome='adequate' if gone else each.outcome))
    return found


def excused(ladder: Ladder, plain: Leftover, carried: float, *, sure: bool = False) -> Ladder:
    """Return the ladder of a group behind one with an effect, not unknown if that explains most.

    Its law is never quite right, and slips tell; nor is it unknown if no more is left than the
    `carried` excess of the signals before. `plain` is what the valve without it leaves. It is
    `sure` if it closes nearly all of a gap before, though more than noise is carried on.
    """
    explained = (carried <= odds.CLEAN or sure) and plain.closed_by(ladder.before) >= odds.MOSTLY
    carried_on = carried > odds.CLEAN and ladder.before.excess <= carried
    if ladder.outcome == 'unknown_effect' and (explained or carried_on):
        return replace(ladder, outcome='adequate')
    return ladder
