# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a record shows of effects before any search for one: where the searches begin."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from . import odds
from .fitting import Fitter, Valve
from .leaving import DRIFT, drift_seen, DWELL, dwell_seen, FORETOLD, PLACES, places_seen, WANDER
from .seen import (
    calibration_seen,
    friction_seen,
    shaken_seen,
    SHAKES,
    STOPS,
    stops_seen,
    swings_seen,
)
from .stages import Candidate, Group
from .starts import friction_grid, grid, START, Starts
from .stretch import RESTS
from .unknowns import BLEND

LAGS = ('T_g1', 'T_g2')


@dataclass(frozen=True)
class Clues:
    """Where searches for effects beside a valve begin.

    Attributes
    ----------
    held : float
        What holds the stem [% of span].
    lags, frictions : list of dict
        Starts of the base valve: without the effect it may have been found far off.
    shown : mapping of str to tuple of float
        Values of parameters, by what shows them; see `EffectParameter.shown`.
    told : mapping of str to list of dict
        Starts of whole effects, by their ids, that rests and slips tell.
    foretold : str
        The effect with which steps or rests of x alone make sense, if there is one.
    """

    held: float
    lags: Starts
    frictions: Starts = field(default_factory=lambda: [{}])
    shown: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    told: Mapping[str, Starts] = field(default_factory=dict)
    foretold: str = ''

    def own(self, candidate: Candidate) -> Starts:
        """Return the starts that a candidate declares, or values that the record shows."""
        return candidate.starts(self.shown)

    def suited(self, candidate: Candidate) -> Starts:
        """Return the starts of a candidate that rests and slips tell."""
        return candidate.suited(self.told.get(candidate.effect, []))

    def possible(self, candidate: Candidate) -> bool:
        """Tell whether x may come of this candidate: not a coarse sensor if it keeps to no steps.

        A grid through 0 needs no offset.
        """
        if candidate.effect != odds.COARSE or 'steps' not in self.shown:
            return True
        return bool(self.shown['steps']) and (
            'offset' not in candidate.names or any(self.shown['offsets'])
        )


def clues(fitter: Fitter, group: Group, valve: Valve) -> Clues:
    """Return what the record shows beside a run of the valve."""
    free = {each.name: each for each in fitter.unknowns(group)}
    lags = grid([free[name] for name in LAGS if name in free])
    if BLEND.name in free:  # that ramps are late may have made up for a lag
        lags = [*lags, {BLEND.name: 0.0}]
    if not group.has_stem:
        return Clues(valve.values['f_s'], lags)
    bench, results = fitter.bench, fitter.results(valve)
    held = friction_seen(bench, results)[0]
    frictions = friction_grid(held)
    if 'f_d1' in free and valve.values['f_d1'] > valve.values['f_s']:
        # a play of the converter may have made up for friction
        frictions += [{**each, 'f_d1': START['f_d1']} for each in frictions]
    # whole slips would hide a swing
    residual = fitter.residuals(valve, group.signal, (*fitter.drive, RESTS))
    rests = {
        **{name: drift_seen(bench, results, name) for name in (DRIFT, WANDER)},
        DWELL: dwell_seen(bench, results),
        PLACES: places_seen(bench, results),
    }
    best = min(rests, key=lambda name: rests[name].left)
    foretold = best if rests[best].left < FORETOLD else ''
    if keeps_to_steps(fitter, group, valve):
        foretold = odds.COARSE
    return Clues(
        held,
        lags,
        frictions,
        shown={
            'swings': swings_seen(bench, residual),
            'steps': tuple(step for step, _ in bench.grids_of_x),
            'offsets': tuple(offset for _, offset in bench.grids_of_x),
            **calibration_seen(bench, results),
        },
        told={
            **{name: each.starts for name, each in rests.items()},
            SHAKES: shaken_seen(bench, held),
            STOPS: stops_seen(bench, results),
        },
        foretold=foretold,
    )


def keeps_to_steps(fitter: Fitter, group: Group, valve: Valve) -> bool:
    """Tell whether x, where it seems to keep to steps, is better explained by a coarse sensor."""
    if not group.has_stem:
        return False
    effects = tuple(dict.fromkeys((*valve.effects, odds.COARSE)))
    names = [f'{odds.COARSE}.{name}' for name in ('step', 'offset')]
    grids = [dict(zip(names, grid, strict=True)) for grid in fitter.bench.grids_of_x]
    each = [replace(valve, effects=effects, values={**valve.values, **grid}) for grid in grids]
    return any(fitter.score(one, group.signal, fitter.drive) < valve.cost for one in each)
