# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The heats of a race: valves with one more effect each are refitted, the better the more."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeVar

from . import odds
from .adequacy import Leftover, leftover
from .clues import Clues
from .fitting import by_cost, Fitter, GENERATIONS, NARROW, Valve
from .screening import screened
from .stages import Candidate, Group
from .workers import each_on_its_own

Start = TypeVar('Start')

ROUNDS = ((40, 5), (10, 14), (4, 30))
"""Rounds of a race where costs are rugged: how many still run, and for how many generations."""
FINISHERS, REFINED = 5, 2
"""How many runners are refitted, and refined to the end."""
OUTRUN = 2.0
"""What a runner may cost to be searched for longer [cost of the best]."""
FAR_AHEAD, BEHIND = 0.2, 0.5
"""Where the best leaves no more than this part of the cost, or nothing but noise, runners short of
more than a part of its gain are not followed."""
PROMISING = 0.05
"""Part of the gap that a first refit must close for any to be followed before all have begun."""


def in_reach(valve: Valve, runners: Sequence[Valve]) -> list[Valve]:
    """Return the runners that are not far behind the first in what they gain over the valve."""
    best = runners[0].cost
    return [each for each in runners if each.cost <= best + BEHIND * (valve.cost - best)]


@dataclass
class Heats:
    """The heats of one race.

    Attributes
    ----------
    fitter, group : Fitter, Group
        At the bench, and the stages in question.
    valve, before : Valve, Leftover
        The one without any of the effects that race, and what it leaves.
    clues : Clues
        Where searches begin.
    total : int
        How many candidates there are.
    progress : callable
        Called with the share of them that began, and before each round.
    found : list of Valve
        What every search ended with, in whatever order.
    runners, waiting : list of Valve
        What the heats so far ended with, best first; and those that wait for the next one.
    begun : int
        How many candidates have begun.
    """

    fitter: Fitter
    group: Group
    valve: Valve
    before: Leftover
    clues: Clues
    total: int
    progress: Callable[[float], object]
    found: list[Valve]
    runners: list[Valve] = field(default_factory=list)
    waiting: list[Valve] = field(default_factory=list)
    begun: int = 0

    @property
    def ended(self) -> list[Valve]:
        """All that have begun, best first."""
        return sorted([*self.runners, *self.waiting], key=by_cost)

    def left_by(self, runner: Valve) -> Leftover:
        """Return what a runner leaves."""
        return leftover(self.fitter.residuals(runner, self.group.signal))

    def nearly_all(self, runner: Valve) -> bool:
        """Tell whether it closes so much of the gap that only effects like it are tried further.

        An effect far larger than usual stands for another, which may not have begun.
        """
        last = runner.candidates[-1].effect if runner.candidates else ''
        large = last and odds.too_large(runner, last)
        return not large and odds.nearly_all(self.before, self.left_by(runner), last)

    def most(self, runners: Sequence[Valve], part: float = odds.MOSTLY) -> bool:
        """Tell whether the best of these closes most of the gap, or a given part of it."""
        best = min(runners, key=by_cost, default=self.valve)
        return self.before.closed_by(self.left_by(best)) >= part

    def promising(self, runners: Sequence[Valve]) -> bool:
        """Tell whether the best of these closes enough of the gap to be followed."""
        gap = self.valve.cost * self.before.excess / (1.0 + self.before.excess)
        gained = max((self.valve.cost - each.cost for each in runners), default=0.0)
        return not self.group.has_stem or gained >= PROMISING * gap

    def screen(self, candidates: Collection[Candidate]) -> list[Valve]:
        """Return a valve with each candidate that has not begun yet, after its first refit."""
        begun = [each.candidates[-1] for each in self.ended]
        return self._begin(
            lambda each: screened(self.fitter, each, self.group, self.valve, self.clues),
            [each for each in candidates if each not in begun],
        )

    def extend(self, plain: Valve, candidates: Collection[Candidate]) -> list[Valve]:
        """Return a valve with each law that has one more parameter, begun from the plain one."""

        def carried_on(candidate: Candidate) -> Valve:
            there = replace(plain, candidates=(*plain.candidates[:-1], candidate))
            problem = self.fitter.problem(self.group, there)
            return self.fitter.evolve(there, problem, GENERATIONS, NARROW)

        return self._begin(carried_on, candidates)

    def run(self, fresh: Sequence[Valve], *, last: bool = False) -> None:
        """Run a heat: fresh valves are refitted as far as they lead.

        If none of them is promising they wait for those of the next heat; in the last one they
        are followed only where too much is left to be called adequate.
        """
        fresh = sorted([*self.waiting, *fresh], key=by_cost)
        self.waiting = []
        if not fresh:
            return
        if not (last or self.promising(fresh)):
            self.waiting = fresh
            return
        ahead = self.runners
        if last and odds.adequate(self.group.signal, self.before) and not self.promising(fresh):
            self.runners = sorted([*ahead, *fresh], key=by_cost)
            return
        for most, generations in ROUNDS if self.group.has_stem else ():
            slowest = sorted(each.cost for each in (*ahead, *fresh))[:most][-1]
            among = sum(each.cost <= slowest for each in fresh)
            if among:
                further = partial(self._evolved, generations=generations)
                fresh = self._followed(further, fresh, among)
        runners = sorted([*ahead, *fresh], key=by_cost)
        runners = self._followed(self._fitted, runners, FINISHERS, ahead)
        if self.group.has_stem:
            some = [each for each in runners[:REFINED] if each.cost <= OUTRUN * runners[0].cost]
            near = sum(self.left_by(each).excess <= odds.CLEAN for each in some)
            runners = self._followed(self._refined, runners, near or len(some), ahead)
        self.runners = runners

    def _noted(self, search: Callable[[Start], Valve]) -> Callable[[Start], Valve]:
        """Return a search that leaves what it ends with, should no other end any more."""

        def noted(start: Start) -> Valve:
            runner = search(start)
            self.found.append(runner)
            return runner

        return noted

    def _begin(
        self, search: Callable[[Candidate], Valve], candidates: Collection[Candidate]
    ) -> list[Valve]:
        fresh = []
        for runner in each_on_its_own(self._noted(search), candidates):
            self.begun += 1
            self.progress(self.begun / self.total)
            fresh.append(runner)
        return fresh

    def _followed(
        self,
        search: Callable[[Valve], Valve],
        runners: list[Valve],
        most: int,
        done: Collection[Valve] = (),
    ) -> list[Valve]:
        """Return the runners, the best but those `done` taken further, in their new order.

        None is that is far behind one that explains nearly all.
        """
        self.progress(1.0)
        best = runners[0]
        far_ahead = best.cost < FAR_AHEAD * self.valve.cost
        if far_ahead or self.left_by(best).excess <= odds.SPOTLESS:
            most = len(in_reach(self.valve, runners[:most]))
        further = [each for each in runners[:most] if each not in done]
        others = [each for each in runners if each not in further]
        return sorted([*each_on_its_own(self._noted(search), further), *others], key=by_cost)

    def _evolved(self, runner: Valve, generations: int) -> Valve:
        more = self.fitter.evolve(runner, self.fitter.problem(self.group, runner), generations)
        return min(runner, more, key=by_cost)

    def _fitted(self, runner: Valve) -> Valve:
        return self.fitter.fit(runner, self.fitter.problem(self.group, runner))

    def _refined(self, runner: Valve) -> Valve:
        return self.fitter.refined(runner, self.fitter.problem(self.group, runner))
