# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fits of one group of stages, from one start or from several."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
import math

import numpy as np

from ..identification.watch import Stop
from ..model.pipeline import Array
from .adequacy import leftover
from .bench import Bench
from .descent import descend, walk
from .evolution import evolve
from .stages import Candidate, Group
from .stretch import CAUGHT, ON_TIME, PUT_TO_REST
from .unknowns import (
    BLEND,
    complete,
    LEAD,
    PHASE,
    STANDSTILL,
    to_point,
    to_values,
    Unknown,
)
from .workers import cheapest

HOPELESS = 1e3
"""Residual of a run that is not finite [noise]."""
SHORT, LONG = 4, 20
"""Steps of a descent that only shows where it leads, and of one to the bottom."""
SPREAD, NARROW, FINE = 5.0, 3.0, 1.0
"""Standard deviation with which an evolution begins, near an optimum, and where a train of slips
hangs on every step [steps of unknowns]."""
REFINING = NARROW, FINE, 0.3, 0.1
"""The same for evolutions in turn that refine a valve: slips leave valleys of any width."""
POPULATION, CROWD = 14, 28
"""Points of a generation, and of one that follows a narrow and bent valley."""
FAINT, NEAR = 0.02, 2.0
"""Excess up to which a train of slips is right (laborious effects leave more in a base valve), and
up to which a valve is refined again and again, with fine steps as well."""
GENERATIONS, PATIENT, MOST_TURNS, ENDS = 40, 150, 3, 0.99
"""Generations of an evolution that refines a valve, and of one along a narrow valley; most
evolutions in turn, which end where no more than a hundredth of the cost is gained."""


@dataclass(frozen=True)
class Valve:
    """A fitted valve: values of all unknowns, effects in force, those added, its cost."""

    values: Mapping[str, float]
    effects: tuple[str, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    cost: float = math.inf


Problem = tuple[tuple[Unknown, ...], str, tuple[str, ...]]
"""What a fit varies, the signal it looks at, and the signals that drive the stages."""


def eased(problem: Problem) -> list[Problem]:
    """Return the problem after two easier ones in which a stem is caught where it is far off.

    First the moment of a slip hardly counts, then it does.
    """
    unknowns, signal, drive = problem
    if PUT_TO_REST & {*drive}:
        return [problem]
    return [*((unknowns, signal, (*drive, how)) for how in (CAUGHT, ON_TIME)), problem]


def by_cost(valve: Valve) -> float:
    """Return what to sort by."""
    return valve.cost


def go_on() -> None:
    """Never end a search."""


def ended() -> None:
    """Let no search begin."""
    raise Stop


@dataclass
class Fitter:
    """Fits valves to what a bench has measured.

    `alive` is called before every search, from any thread, and may raise `Stop`.
    """

    bench: Bench
    phase: Unknown = PHASE
    nuisances: frozenset[Unknown] = frozenset()
    drive: tuple[str, ...] = ()
    seed: int = 0
    alive: Callable[[], object] = go_on

    @contextmanager
    def ends_at(self, stops: tuple[type[BaseException], ...]) -> Iterator[None]:
        """Let one of these exceptions go no further, and no search begin after it."""
        try:
            yield
        except stops:
            self.alive = ended

    def unknowns(self, group: Group) -> tuple[Unknown, ...]:
        """Return what a fit of the base valve varies in a group."""
        here = {
            BLEND: group.stages == ('u-p1',),
            LEAD: group.signal == 'p2',
            STANDSTILL: group.has_stem,
        }
        own = (each for each in here if here[each] and each in self.nuisances)
        return (*group.unknowns(len(self.bench.stretches), self.phase), *own)

    def results(self, valve: Valve, drive: Sequence[str] | None = None) -> list[Array]:
        """Return what `Bench.run` makes of a valve, driven as is usual here unless told."""
        driven = self.drive if drive is None else drive
        return self.bench.run(complete(valve.values), valve.effects, driven)

    def residuals(
        self,
        valve: Valve,
        signal: str,
        drive: Sequence[str] | None = None,
    ) -> Array:
        """Return the residuals of a signal over its noise, 0 where they do not count."""
        results = self.results(valve, drive)
        residual = np.nan_to_num(self.bench.residual(results, signal))
        if not all(np.isfinite(each).all() for each in results):
            residual[:] = HOPELESS  # a run that blew up must not look like one that fits
        return residual

    def score(
        self,
        valve: Valve,
        signal: str,
        drive: Sequence[str] = (),
        bound: float = math.inf,
    ) -> float:
        """Return the robust sum of squares of a signal over its noise, or more than `bound`."""
        score = self.bench.score(complete(valve.values), valve.effects, signal, drive, bound)
        return score if math.isfinite(score) else math.inf

    def fit(self, valve: Valve, problem: Problem, most: int = LONG) -> Valve:
        """Return the valve at the bottom of the valley in which it stands."""
        self.alive()
        unknowns, signal, drive = problem

        def residuals(point: Array) -> Array:
            there = replace(valve, values=to_values(unknowns, point, valve.values))
            return self.residuals(there, signal, drive)

        def score(point: Array, bound: float) -> float:
            there = replace(valve, values=to_values(unknowns, point, valve.values))
            return self.score(there, signal, drive, bound)

        found = descend(residuals, to_point(unknowns, valve.values), most)
        if most > SHORT:
            found = walk(score, found)
        return replace(
            valve, values=to_values(unknowns, found.point, valve.values), cost=found.cost
        )

    def evolve(
        self,
        valve: Valve,
        problem: Problem,
        generations: int,
        spread: float = SPREAD,
        size: int = POPULATION,
    ) -> Valve:
        """Return the best valve that evolution finds around this one."""
        self.alive()
        unknowns, signal, drive = problem

        def score(point: Array, bound: float) -> float:
            there = replace(valve, values=to_values(unknowns, point, valve.values))
            return self.score(there, signal, drive, bound)

        found = evolve(
            score,
            to_point(unknowns, valve.values),
            spread,
            np.random.default_rng(self.seed),
            generations,
            size,
        )
        return replace(
            valve, values=to_values(unknowns, found.point, valve.values), cost=found.cost
        )

    def refined(self, valve: Valve, problem: Problem) -> Valve:
        """Return a valve after descents and, where costs are rugged, evolutions in turn."""
        valve = self.fit(valve, problem)
        if 'f_s' not in (unknown.name for unknown in problem[0]):
            return valve
        _, signal, drive = problem
        for turn in range(MOST_TURNS):
            left = leftover(self.residuals(valve, signal, drive)).excess
            if turn and not FAINT < left <= NEAR:
                break
            before, there = valve.cost, valve
            for way in eased(problem) if left > FAINT else ():
                spread = FINE if way == problem else NARROW
                there = self.fit(self.evolve(there, way, GENERATIONS, spread), way)
            valve = min(valve, there, key=by_cost)
            for spread in REFINING if left <= NEAR else REFINING[:2]:
                valve = self._evolved(valve, problem, spread)
            if valve.cost > ENDS * before:
                break
        return valve

    def _evolved(self, valve: Valve, problem: Problem, spread: float) -> Valve:
        """Return a valve after evolutions, as long as they gain."""
        for _ in range(MOST_TURNS):
            before = valve.cost
            more = self.fit(self.evolve(valve, problem, GENERATIONS, spread), problem)
            valve = min(valve, more, key=by_cost)
            if more.cost > ENDS * before:
                break
        return valve

    def problem(self, group: Group, valve: Valve) -> Problem:
        """Return what a refit of a valve varies in a group, driven as is usual here."""
        added = group.unknowns_of(valve.candidates)
        return (*self.unknowns(group), *added), group.signal, self.drive

    def scan(
        self,
        valve: Valve,
        starts: Sequence[Mapping[str, float]],
        problem: Problem,
        count: int = 1,
    ) -> list[Valve]:
        """Return the best starts, best first."""
        self.alive()
        _, signal, drive = problem
        there = [replace(valve, values=start) for start in starts]
        costs = cheapest(lambda each, bound: self.score(each, signal, drive, bound), there, count)
        each = [replace(one, cost=cost) for one, cost in zip(there, costs, strict=True)]
        return sorted(each, key=by_cost)[:count]
