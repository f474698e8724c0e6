# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fits of one group of stages: the base valve, and the base valve with a candidate effect."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import repeat
import math
import os

import numpy as np
from scipy.signal import periodogram

from ..model.pipeline import Array
from .bench import Bench, MIXED_JITTER
from .descent import descend, walk
from .evolution import evolve
from .stages import Candidate, Group
from .starts import friction_grid, grid, START, STEMS
from .unknowns import complete, EARLY, LATE, PHASE, to_point, to_values, Unknown

STEM_STARTS = 6
"""So many starts are followed where only the stem is sought."""
HOPELESS = 1e3
"""Residual of a run that is not finite [noise]."""
SHORT = 4
"""Steps of a descent that only shows where it leads."""
SCREENING, COARSE = 0.1, 0.04
"""Steps inside a sample while candidates are screened, and fitted [s]."""
SPREAD, NARROW = 5.0, 3.0
"""Standard deviation with which an evolution begins, and near an optimum [steps of unknowns]."""
FOLLOWED = 4
"""So many base valves are followed by an evolution where costs are rugged."""
POPULATION = 14
ROUNDS = ((40, 5), (10, 14), (4, 30))
"""Rounds of a race where costs are rugged: how many still run, and for how many generations."""
MOST_STARTS, FEWER_STARTS = 24, 8
"""Up to so many starts of an effect are tried with each level of friction; if there are more, only
so many of the best."""
SCREENED, FINISHERS, REFINED = 3, 5, 2
"""How many starts of a candidate are followed, runners refitted, and refined to the end."""


@dataclass(frozen=True)
class Valve:
    """A fitted valve: values of all unknowns, effects in force, what they may vary, its cost."""

    values: Mapping[str, float]
    effects: tuple[str, ...] = ()
    freed: tuple[Unknown, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    cost: float = math.inf


@dataclass
class Fitter:
    """Fits valves to what a bench has measured."""

    bench: Bench
    phase: Unknown = PHASE
    drive: tuple[str, ...] = ()
    seed: int = 0

    def unknowns(self, group: Group) -> tuple[Unknown, ...]:
        """Return what a fit of the base valve varies in a group."""
        return group.unknowns(len(self.bench.stretches), self.phase)

    def residuals(
        self,
        valve: Valve,
        signal: str,
        drive: Sequence[str] | None = None,
        coarse: float = COARSE,
    ) -> Array:
        """Return the residuals of a signal over its noise, 0 where they do not count."""
        driven = self.drive if drive is None else drive
        results = self.bench.run(complete(valve.values), valve.effects, driven, coarse)
        residual = np.nan_to_num(self.bench.residual(results, signal))
        if not all(np.isfinite(each).all() for each in results):
            residual[:] = HOPELESS  # a run that blew up must not look like one that fits
        return residual

    def score(
        self,
        valve: Valve,
        signal: str,
        drive: Sequence[str] = (),
        coarse: float = 0.0,
        bound: float = math.inf,
    ) -> float:
        """Return the robust sum of squares of a signal over its noise, or more than `bound`."""
        score = self.bench.score(
            complete(valve.values), valve.effects, signal, drive, coarse, bound
        )
        return score if math.isfinite(score) else math.inf

    def fit(
        self, valve: Valve, problem: 'Problem', most: int = 20, coarse: float = COARSE
    ) -> Valve:
        """Return the valve at the bottom of the valley in which it stands."""
        unknowns, signal, drive = problem

        def residuals(point: Array) -> Array:
            there = replace(valve, values=to_values(unknowns, point, valve.values))
            return self.residuals(there, signal, drive, coarse)

        def score(point: Array, bound: float) -> float:
            there = replace(valve, values=to_values(unknowns, point, valve.values))
            return self.score(there, signal, drive, coarse, bound)

        found = descend(residuals, to_point(unknowns, valve.values), most)
        if most > SHORT:
            found = walk(score, found)
        return replace(
            valve, values=to_values(unknowns, found.point, valve.values), cost=found.cost
        )

    def evolve(
        self,
        valve: Valve,
        problem: 'Problem',
        generations: int,
        spread: float = SPREAD,
        coarse: float = SCREENING,
    ) -> Valve:
        """Return the best valve that evolution finds around this one."""
        unknowns, signal, drive = problem

        def score(point: Array, bound: float) -> float:
            there = replace(valve, values=to_values(unknowns, point, valve.values))
            return self.score(there, signal, drive, coarse, bound)

        found = evolve(
            score,
            to_point(unknowns, valve.values),
            spread,
            np.random.default_rng(self.seed),
            generations,
            POPULATION,
        )
        return replace(
            valve, values=to_values(unknowns, found.point, valve.values), cost=found.cost
        )

    def _results(self, valve: Valve) -> list[Array]:
        """Return p1, p2, x of a valve by stretch, driven as is usual here."""
        return self.bench.run(complete(valve.values), valve.effects, self.drive, COARSE)

    def base(self, group: Group, valve: Valve, drive: Sequence[str]) -> Valve:
        """Find the base valve's values in one group from a grid, `drive` as measured."""
        if group.stages == ('u-p1',) and drive == group.drive:
            self._settle_phase(group, valve)
            valve = replace(valve, values={**valve.values, 'phase': self.phase_start})
        problem = (self.unknowns(group), group.signal, tuple(drive))
        stems = STEMS if 'p2-x' in group.stages else ({},)
        points = grid(problem[0])
        starts = [{**valve.values, **stem, **there} for stem in stems for there in points]
        starts.append(dict(valve.values))
        alone = group.stages == ('p2-x',)
        if alone:
            seen = self.bench.friction_seen(self._results(valve))
            starts += [{**valve.values, **there} for there in friction_grid(seen)]
        found = self._best_of(valve, starts, problem, STEM_STARTS if alone else 3)
        if 'p2-x' not in group.stages:
            return self.refined(found[0], problem)
        # put to rest where it was seen to rest, a stem that slips too late is only a little wrong
        eases = self._best_of(valve, starts, _eased(problem), STEM_STARTS if alone else 3)

        with ThreadPoolExecutor(os.cpu_count()) as pool:  # compiled runs release the lock
            others = pool.map(lambda each: self._by_way_of_rests(each, problem), eases)
            found = sorted([*found, *others], key=_cost)[:FOLLOWED]
            found += pool.map(lambda each: self.evolve(each, problem, 30, NARROW, COARSE), found)
        return self.refined(min(found, key=_cost), problem)

    def refined(self, valve: Valve, problem: 'Problem') -> Valve:
        """Return a valve after descents and, where costs are rugged, evolutions in turn."""
        valve = self.fit(valve, problem)
        while 'f_s' in (unknown.name for unknown in problem[0]):
            more = self.evolve(valve, problem, 40, NARROW, COARSE)
            more = self.fit(more, problem)
            if more.cost > 0.99 * valve.cost:
                return min(valve, more, key=_cost)
            valve = more
        return valve

    def _by_way_of_rests(self, valve: Valve, problem: 'Problem') -> Valve:
        """Return what evolution finds with the stem put to rest as seen, then fitted without."""
        found = self.evolve(valve, _eased(problem), 30, NARROW, COARSE)
        return self.fit(found, problem, SHORT)

    def race(
        self,
        group: Group,
        valve: Valve,
        candidates: Sequence[Candidate],
        progress: Callable[[float], object] = lambda share: None,
    ) -> list[Valve]:
        """Return valves with one more effect, best first; the better, the more refitted."""
        rugged = 'p2-x' in group.stages
        peaks: tuple[float, ...] = ()
        frictions: list[dict[str, float]] = []
        if rugged:
            results = self._results(valve)
            peaks = self._peaks(np.nan_to_num(self.bench.residual(results, group.signal)))
            frictions = friction_grid(self.bench.friction_seen(results))
        done, total = 0, len(candidates) + FINISHERS

        def count(runner: Valve) -> Valve:
            nonlocal done
            done += 1
            progress(min(done / total, 1.0))
            return runner

        def evolved(runner: Valve, generations: int) -> Valve:
            more = self.evolve(runner, self.problem(group, runner), generations)
            return min(runner, more, key=_cost)

        with ThreadPoolExecutor(os.cpu_count()) as pool:  # compiled runs release the lock
            screened = pool.map(
                lambda c: self._screen(c, group, valve, peaks, frictions), candidates
            )
            runners = sorted((count(each) for each in screened), key=_cost)
            for left, generations in ROUNDS if rugged else ():
                first = pool.map(evolved, runners[:left], repeat(generations))
                runners = sorted([*first, *runners[left:]], key=_cost)
            first = pool.map(lambda r: self.fit(r, self.problem(group, r)), runners[:FINISHERS])
            runners = sorted([*map(count, first), *runners[FINISHERS:]], key=_cost)
            last = REFINED if rugged else 0
            first = pool.map(lambda r: self.refined(r, self.problem(group, r)), runners[:last])
            return sorted([*first, *runners[last:]], key=_cost)

    def rebased(self, group: Group, valve: Valve, runners: Sequence[Valve]) -> Valve:
        """Return the valve without a further effect, refitted from where the runners ended."""
        problem = self.problem(group, valve)
        names = [unknown.name for unknown in problem[0]]
        there = [
            replace(valve, values={**valve.values, **{name: r.values[name] for name in names}})
            for r in runners
        ]
        costs = [self.score(each, group.signal, self.drive, COARSE) for each in there]
        best = there[int(np.argmin(costs))]
        return min(valve, self.fit(best, problem), key=_cost)

    def problem(self, group: Group, valve: Valve) -> 'Problem':
        """Return what a refit of a valve varies in a group, driven as is usual here."""
        return (*self.unknowns(group), *valve.freed), group.signal, self.drive

    @property
    def phase_start(self) -> float:
        """A phase to start from."""
        return min(max(0.0, self.phase.lower), self.phase.upper)

    def _screen(
        self,
        candidate: Candidate,
        group: Group,
        valve: Valve,
        peaks: tuple[float, ...],
        frictions: Sequence[dict[str, float]],
    ) -> Valve:
        """Return the valve with one more effect after a short refit of its group."""
        there = replace(
            valve,
            effects=tuple(dict.fromkeys((*valve.effects, candidate.effect))),
            freed=(*valve.freed, *candidate.unknowns),
            candidates=(*valve.candidates, candidate),
        )
        own = candidate.starts(peaks)
        problem = self.problem(group, there)
        rugged = 'p2-x' in group.stages
        eased = _eased(problem) if rugged else problem
        if len(own) > MOST_STARTS:
            firsts = [{**candidate.neutral, **valve.values, **start} for start in own]
            costs = [self._scan(there, [first], eased, SCREENING)[0].cost for first in firsts]
            own = [own[index] for index in np.argsort(costs, kind='stable')[:FEWER_STARTS]]
        bases = ({}, *frictions)
        starts = [
            [{**candidate.neutral, **valve.values, **base, **start} for base in bases]
            for start in own
        ]

        def best(way: 'Problem', count: int) -> list[Valve]:
            each = [self._scan(there, some, way, SCREENING)[0] for some in starts]
            return sorted(each, key=_cost)[:count]

        found = best(problem, SCREENED)
        if rugged:
            found += [self.fit(each, eased, SHORT, SCREENING) for each in best(eased, 1)]
        return min((self.fit(each, problem, SHORT, SCREENING) for each in found), key=_cost)

    def _peaks(self, residual: Array) -> tuple[float, ...]:
        """Return the frequencies at which a residual swings most, and their neighbours [Hz]."""
        period = float(np.median(np.diff(self.bench.stretches[0].time)))
        frequency, power = periodogram(np.clip(residual, -10.0, 10.0), 1.0 / period)
        inside = (frequency > 0.02) & (frequency < 0.45 / period)
        tops = frequency[inside][np.argsort(-power[inside])[:3]]
        return tuple(f + part * frequency[1] for f in tops for part in (-0.4, 0.0, 0.4))

    def _settle_phase(self, group: Group, valve: Valve) -> None:
        """Find out whether p1 answers at the sample that shows the command or at the next."""
        best = []
        for phase in (EARLY, LATE):
            self.phase = phase
            problem = (self.unknowns(group), group.signal, group.drive)
            values = {**valve.values, 'phase': min(phase.upper, 0.0)}
            starts = [{**values, **there} for there in grid(problem[0])]
            best.append(self._best_of(valve, starts, problem, 1)[0])
        self.phase = EARLY if best[0].cost <= best[1].cost else LATE
        values = {**best[0].values, 'phase': 0.0}
        results = self.bench.run(complete(values), best[0].effects)
        if self.bench.mixed_arrivals(results):
            self.bench.weigh_down(MIXED_JITTER, results)
            self.phase = PHASE

    def _best_of(
        self,
        valve: Valve,
        starts: Sequence[Mapping[str, float]],
        problem: 'Problem',
        count: int,
        coarse: float = COARSE,
    ) -> list[Valve]:
        """Try starts, descend a little from the best of them, and order what comes out."""
        tried = self._scan(valve, starts, problem, coarse, count)
        fits = [self.fit(there, problem, SHORT, coarse) for there in tried]
        return sorted(fits, key=_cost)

    def _scan(
        self,
        valve: Valve,
        starts: Sequence[Mapping[str, float]],
        problem: 'Problem',
        coarse: float,
        count: int = 1,
    ) -> list[Valve]:
        """Return the best starts, best first."""
        _, signal, drive = problem
        tried: list[Valve] = []
        bound = math.inf
        for start in starts:
            there = replace(valve, values=start)
            cost = self.score(there, signal, drive, coarse, bound)
            tried = sorted([*tried, replace(there, cost=cost)], key=_cost)[:count]
            bound = tried[-1].cost if len(tried) == count else math.inf
        return tried


Problem = tuple[tuple[Unknown, ...], str, tuple[str, ...]]
"""What a fit varies, the signal it looks at, and the signals that drive the stages."""


def _eased(problem: Problem) -> Problem:
    """Return the problem in which the stem is put to rest where it was seen to rest."""
    unknowns, signal, drive = problem
    return unknowns, signal, (*drive, 'x')


def _cost(valve: Valve) -> float:
    """Return what to sort by."""
    return valve.cost


def starting_valve(bench: Bench) -> Valve:
    """Return a valve to start from, its starting values as measured."""
    values = dict(START)
    for index in range(len(bench.stretches)):
        suffix = f'.{index}' if index else ''
        p1, p2, x = (float(v) for v in bench.start(index, values)[:3])
        values |= {f'p1_0{suffix}': p1, f'p2_0{suffix}': p2, f'x_0{suffix}': x}
    return Valve(values)
