# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Effects that look like the best of a race, sought from where that ended."""

from collections.abc import Mapping, Sequence

from . import odds
from .adequacy import leftover
from .fitting import by_cost, Fitter, Valve
from .stages import Candidate, Group
from .starts import Starts
from .workers import each_on_its_own

NEAR = 10.0
"""Beside the best one that costs so many times more is no twin, however long it is sought."""


def alike(fitter: Fitter, group: Group, runners: Sequence[Valve]) -> list[Valve]:
    """Return the runners, those that look like the best sought from its base valve as well."""
    best = runners[0]
    effect = best.candidates[-1].effect
    explains = leftover(fitter.residuals(best, group.signal)).excess <= odds.CLEAN
    base = {unknown.name: best.values[unknown.name] for unknown in fitter.unknowns(group)}

    def sought(runner: Valve) -> Valve:
        candidate = runner.candidates[-1]
        if effect == candidate.effect or not odds.look_alike(effect, candidate.effect):
            return runner
        own = [{**base, **start} for start in ({}, *candidate.starts({}))]
        starts = [{**runner.values, **each} for each in (*own, *_same(best, candidate, base))]
        problem = fitter.problem(group, runner)
        there = fitter.fit(fitter.scan(runner, starts, problem)[0], problem)
        there = min(runner, there, key=by_cost)
        # where slips tell, it is not said to be worse before it was sought as long
        near = odds.TWIN_GAIN < there.cost - best.cost < NEAR * best.cost
        if explains and group.has_stem and near and not candidate.laborious:
            there = min(there, fitter.refined(there, problem), key=by_cost)
        return there

    return sorted(each_on_its_own(sought, runners), key=by_cost)


def _same(best: Valve, candidate: Candidate, base: Mapping[str, float]) -> Starts:
    """Return what one effect is as another one with parameters of the same names.

    All is linear but for friction: zero and span of the converter do to x what those of the sensor
    do if friction and the pressures at the beginning are as much greater.
    """
    effect = best.candidates[-1].effect
    names = [name for name in candidate.names if name in best.candidates[-1].names]
    if 'f_s' not in base or not names:
        return []
    same = {name: best.values[f'{effect}.{name}'] for name in names}
    zero, span = same.get('zero', 0.0), same.get('span', 1.0)
    values = {**candidate.neutral, **{f'{candidate.effect}.{n}': v for n, v in same.items()}}
    hidden = {name: base[name] for name in base if name.startswith(('p1_0', 'p2_0'))}
    greater = {name: zero + span * value for name, value in hidden.items()}
    less = {name: (value - zero) / span for name, value in hidden.items()}
    return [
        {**base, **values},
        {**base, **values, **greater, 'f_s': base['f_s'] * span},
        {**base, **values, **less, 'f_s': base['f_s'] / span},
    ]
