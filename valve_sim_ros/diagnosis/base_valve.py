# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search for the base valve, with effects in force or without."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from . import odds
from .adequacy import Leftover, leftover
from .arrivals import put_in_its_period
from .bench import Bench, MIXED_JITTER
from .fitting import (
    by_cost,
    CROWD,
    eased,
    ENDS,
    FAINT,
    FINE,
    Fitter,
    MOST_TURNS,
    NARROW,
    NEAR,
    PATIENT,
    Problem,
    SHORT,
    Valve,
)
from .seen import friction_seen, mixed_arrivals
from .single_slips import FINEST, slip_by_slip
from .stages import Group
from .starts import friction_grid, grid, nearby, START, Starts, STEMS, SWEEP
from .stretch import PUT_TO_REST
from .unknowns import BLEND, EARLY, LATE, LEAD, PHASE, STANDSTILL, Unknown

FEW_STARTS = 3
"""So many starts are followed."""
SWEPT, FOLLOWED, GENERATIONS, FINENESS, SCATTERS = 4, 4, 30, 16, 8
"""So many base valves are tried with stems of all kinds; so many are followed by an evolution
where costs are rugged, and for how long; the binary logarithm of how many are scattered around
the best, and how many of them are followed."""
NEARLY = 0.95
"""Phase beyond which a command acts nearly a whole period late or early."""
SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Parts of a period by which commands that go on and on may be late, or sooner than steps."""
SPEEDS = (1e-3, 5e-3, 0.02, 0.08)
"""Where a search for the speed at which a stem stops begins [%/s]."""
LAG, CLEARLY = 'ip_lag', 50.0
"""An answer that lags may have gone less than half the way where it is first seen: with it that
sample must be told so much better."""


def starting_valve(bench: Bench) -> Valve:
    """Return a valve to start from, its starting values as measured."""
    values = dict(START)
    for index, stretch in enumerate(bench.stretches):
        suffix = f'.{index}' if index else ''
        values |= {f'{name}_0{suffix}': value for name, value in stretch.first.items()}
    return Valve(values)


def find_base(
    fitter: Fitter,
    group: Group,
    valve: Valve,
    drive: Sequence[str],
    *,
    roughly: bool = False,
    closely: bool = False,
    carried: float = 0.0,
) -> Valve:
    """Find the base valve's values in one group from a grid, `drive` as measured.

    `roughly` leaves out the long searches, where the values are sought anew later; `closely` does
    them even where nothing but noise is left. Nor are they done where no more is left than the
    signals before `carried` on.
    """
    if group.stages == ('u-p1',) and drive == group.drive:
        _settle_phase(fitter, group, valve)
        phase = min(max(0.0, fitter.phase.lower), fitter.phase.upper)
        valve = replace(valve, values={**valve.values, 'phase': phase})
    problem = (fitter.unknowns(group), group.signal, tuple(drive))
    points = grid(problem[0])
    stems = STEMS if group.has_stem else ({},)
    starts = [{**valve.values, **stem, **there} for stem in stems for there in points]
    starts.append(dict(valve.values))
    apart, most = [starts], FEW_STARTS
    if group.has_stem:
        # of each (share of) friction one, or all end in the same valley
        name = 'f_s'
        if group.stages == ('p2-x',):
            name = 'f_d/f_s'
            seen, _ = friction_seen(fitter.bench, fitter.results(valve))
            around = friction_grid(seen)
            starts += [{**valve.values, **there, **stem} for there in around for stem in STEMS]
        apart, most = _apart(starts, name), 1

    def followed(way: Problem) -> list[Valve]:
        tried = [each for some in apart for each in fitter.scan(valve, some, way, most)]
        each = [fitter.fit(one, way, SHORT) for one in tried]
        if fitter.phase in way[0]:  # one that ran to the end of its range seldom comes back
            far = [one for one in each if abs(one.values['phase']) > NEARLY]
            back = [replace(one, values={**one.values, 'phase': 0.0}) for one in far]
            each += [fitter.fit(one, way, SHORT) for one in back]
        return sorted(each, key=by_cost)

    found = followed(problem)
    if roughly:
        return found[0]
    if not group.has_stem:
        best = fitter.refined(found[0], problem)
        if group.stages == ('u-p1',):
            # samples of ramps say where those were then, not where they stayed until the next one
            return with_nuisance(fitter, [best], BLEND, SHARES, problem)
        best = ahead_on_ramps(fitter, group, best, problem)
        problem = (fitter.unknowns(group), *problem[1:])
        return put_in_its_period(fitter, group, best, problem)
    swept = [with_any_stem(fitter, each, problem) for each in found[:SWEPT]]
    found += [fitter.fit(each, problem, SHORT) for each in swept]
    found.sort(key=by_cost)
    best = fitter.fit(found[0], problem)
    left = leftover(fitter.residuals(best, group.signal, drive))
    smeared = len(group.stages) > 1 and left.mean_square > odds.COLOURED  # no window is quiet
    worth = odds.suspicious(left, group, fitter.bench.mixed) and not odds.carried_on(left, carried)
    if not (closely or smeared or worth):
        return best
    stopping = standing_still(fitter, best, problem, found)
    if stopping is not best:
        return stopping
    # caught where it is far from its rest, a stem that slips too late is only a little wrong
    way = eased(problem)[0]
    if way != problem:
        stem_only = len(group.stages) == 1
        if stem_only:
            found += slip_by_slip(fitter, valve, starts, problem)
            best = min(found, key=by_cost)
            left = leftover(fitter.residuals(best, group.signal, drive))
        if odds.no_base(left, group):
            return best
        if stem_only and not (closely or odds.suspicious(left, group, fitter.bench.mixed)):
            return fitter.refined(best, problem)
    eases = found if way == problem else followed(way)
    rested = [fitter.evolve(each, way, GENERATIONS, NARROW) for each in eases]
    if len(group.stages) > 1 and way != problem:
        rested += _along_the_valley(fitter, best, problem)
    found += [fitter.fit(each, problem) for each in rested]
    found = sorted(found, key=by_cost)[:FOLLOWED]
    found += [fitter.evolve(each, problem, GENERATIONS, NARROW) for each in found]
    best = fitter.refined(min(found, key=by_cost), problem)
    left = leftover(fitter.residuals(best, group.signal, drive))
    if len(group.stages) > 1 and left.excess <= NEAR:
        best = _to_the_end(fitter, best, problem)
    return standing_still(fitter, best, problem)


def _to_the_end(fitter: Fitter, valve: Valve, problem: Problem) -> Valve:
    """Return the valve at the end of the valley in which this one stands, narrow and bent."""
    for _ in range(MOST_TURNS):
        before = valve.cost
        for way in eased(problem):
            there = fitter.fit(fitter.evolve(valve, way, 2 * PATIENT, FINEST, CROWD), problem)
            if way != problem:
                there = fitter.fit(fitter.evolve(there, problem, GENERATIONS, FINE), problem)
            valve = min(valve, there, key=by_cost)
        if valve.cost > ENDS * before:
            break
    return valve


def standing_still(
    fitter: Fitter, valve: Valve, problem: Problem, others: Sequence[Valve] = ()
) -> Valve:
    """Return a valve whose stem stops at another speed than is printed, if that is all it lacks.

    Where p2 goes on slowly it stops that much sooner, and leaves by a slip. What would leave more
    than noise, once refined if it closes half, might only imitate an effect; one that is put to
    rest does not tell. All searches vary the speed from then on; it is also sought from the
    `others`.
    """
    _, signal, drive = problem
    if signal != 'x' or PUT_TO_REST & {*drive}:
        return valve
    before = leftover(fitter.residuals(valve, signal, drive))
    if before.excess <= FAINT:
        return valve

    def led(start: Valve, problem: Problem) -> Valve:
        there = start
        for way in eased(problem):
            there = fitter.fit(there, way)
        return min(there, fitter.fit(start, problem), key=by_cost)

    def explains(found: Valve, problem: Problem) -> Valve:
        after = leftover(fitter.residuals(found, signal, drive))
        if before.closed_by(after) < odds.LEAST_CLOSED:
            return valve
        found = fitter.refined(found, problem)
        after = leftover(fitter.residuals(found, signal, drive))
        return found if after.excess <= odds.SPOTLESS else valve

    return with_nuisance(fitter, [valve, *others], STANDSTILL, SPEEDS, problem, led, explains)


def ahead_on_ramps(fitter: Fitter, group: Group, valve: Valve, problem: Problem) -> Valve:
    """Return a valve to which commands that go on and on do so between two samples as well.

    Held until the next sample they would be late by half a period; steps are not.
    """
    if group.signal != 'p2' or fitter.phase is LATE or 'p1' in problem[2]:
        return valve
    return with_nuisance(fitter, [valve], LEAD, SHARES, problem)


def with_nuisance(
    fitter: Fitter,
    valves: Sequence[Valve],
    nuisance: Unknown,
    tried: Sequence[float],
    problem: Problem,
    fit: Callable[[Valve, Problem], Valve] | None = None,
    ended: Callable[[Valve, Problem], Valve] = lambda found, problem: found,
) -> Valve:
    """Return the first valve, or one with one more unknown that is no effect if clearly better.

    `tried` are its values from which the search starts, from any of the valves, by another `fit`
    than is usual if told; the best is `ended`, which may return the first. All searches vary the
    unknown from then on.
    """
    valve, *_ = valves
    if nuisance in fitter.nuisances:
        return valve
    problem = ((*problem[0], nuisance), *problem[1:])
    fit = fit or fitter.fit
    each = [[{**one.values, nuisance.name: value} for one in valves] for value in tried]
    found = [fit(fitter.scan(valve, some, problem)[0], problem) for some in each]
    better = ended(min(found, key=by_cost), problem)
    left = leftover(fitter.residuals(better, *problem[1:]))
    if 0.5 * (valve.cost - better.cost) / left.worth < odds.TWIN_GAIN:
        return valve
    fitter.nuisances |= {nuisance}
    return better


def _along_the_valley(fitter: Fitter, valve: Valve, problem: Problem) -> list[Valve]:
    """Return valves with other frictions, for which their lags make up."""
    caught, on_time, _ = eased(problem)
    scattered = nearby(valve.values, problem[0], FINENESS)
    found = fitter.scan(valve, scattered, caught, SCATTERS)
    for way, turns in ((caught, PATIENT), (on_time, GENERATIONS)):
        led = [fitter.fit(fitter.evolve(each, way, turns, FINE), way) for each in found]
        found = sorted(led, key=by_cost)[:FEW_STARTS]
    return found


def on_time(fitter: Fitter, group: Group, valve: Valve) -> Leftover:
    """Return what a base valve leaves of x if its stem is caught where it is far off.

    A slip that only just comes, or does not, hangs on less than noise leaves open; all after it is
    then off for as long as the stem rests. Caught, it is off until it is seen to rest.
    """
    *ways, _ = eased(fitter.problem(group, valve))
    for way, spread in zip(ways, (NARROW, FINE), strict=True):
        valve = fitter.fit(fitter.evolve(valve, way, GENERATIONS, spread), way)
    return leftover(fitter.residuals(valve, group.signal, way[2]))


def _apart(starts: Starts, name: str) -> list[Starts]:
    """Return the starts in groups of one value of an unknown each."""
    levels = dict.fromkeys(start[name] for start in starts)
    return [[start for start in starts if start[name] == level] for level in levels]


def with_any_stem(fitter: Fitter, valve: Valve, problem: Problem) -> Valve:
    """Return a valve with the stem, of those of all kinds, that fits best."""
    stems = [dict(valve.values), *({**valve.values, **stem} for stem in SWEEP)]
    return fitter.scan(valve, stems, problem)[0]


def on_other_side(fitter: Fitter, group: Group, valve: Valve) -> Valve:
    """Return a valve with an effect in p1, on the other side of the sample if clearly better.

    Behind a positioner the base valve does not show whether p1 answers at the sample that shows
    the command or at the next.
    """
    phase = fitter.phase
    if group.stages != ('u-p1',) or phase not in (EARLY, LATE):
        return valve
    fitter.phase = LATE if phase == EARLY else EARLY
    there = replace(valve, values={**valve.values, 'phase': min(fitter.phase.upper, 0.0)})
    better = False
    try:
        there = fitter.fit(there, fitter.problem(group, there))
        better = there.cost < valve.cost - CLEARLY
    finally:  # so that an end here leaves a valve and a phase that belong together
        fitter.phase = fitter.phase if better else phase
    return there if better else valve


def _settle_phase(fitter: Fitter, group: Group, valve: Valve) -> None:
    """Find out whether p1 answers at the sample that shows the command or at the next."""
    lag = next(each for each in group.candidates() if each.effect == LAG)
    effects = tuple(dict.fromkeys((*valve.effects, LAG)))
    lagging = replace(valve, effects=effects, candidates=(lag,))

    def fitted(kind: Valve, added: Sequence[dict[str, float]], phase: Unknown) -> Valve:
        fitter.phase = phase
        problem = (fitter.problem(group, kind)[0], group.signal, group.drive)
        values = {**valve.values, 'phase': min(phase.upper, 0.0)}
        points = grid(fitter.unknowns(group))
        starts = [{**values, **own, **there} for own in added for there in points]
        return fitter.fit(fitter.scan(kind, starts, problem)[0], problem, SHORT)

    fitter.nuisances = frozenset()
    early, late = (fitted(valve, [{}], phase) for phase in (EARLY, LATE))
    lags_early, lags_late = (fitted(lagging, lag.starts({}), phase) for phase in (EARLY, LATE))
    # a lag of 0 is none: the search with one may have ended elsewhere
    best_early, best_late = (
        min(one.cost, other.cost) for one, other in ((early, lags_early), (late, lags_late))
    )
    answers_late = early.cost > late.cost and best_early > best_late - CLEARLY
    fitter.phase = LATE if answers_late else EARLY
    on_time = replace(early, values={**early.values, 'phase': 0.0})
    results = fitter.results(on_time, ())
    if mixed_arrivals(fitter.bench, results):
        fitter.bench.weigh_down(MIXED_JITTER, results)
        fitter.phase = PHASE
