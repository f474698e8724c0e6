# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The order in which effects race, and how long each of them is followed."""

from dataclasses import replace

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import heats, odds
from valve_sim_ros.diagnosis.adequacy import leftover
from valve_sim_ros.diagnosis.base_valve import starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.clues import clues
from valve_sim_ros.diagnosis.fitting import FAINT, Fitter
from valve_sim_ros.diagnosis.race import race
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.recordings.recording import Recording

STEM = groups(('p1', 'p2', 'x'))[-1]
LABORIOUS, QUICK = 'stribeck_friction', 'fluid_force'


@pytest.fixture
def steps(monkeypatch):
    """Return what names the steps of a race in which each effect closes a share of the gap."""

    def run(closes, gap=50.0, beside=(), sized=(), foretold='', **how):
        u = np.repeat(np.random.default_rng(5).uniform(10.0, 90.0, 40), 50)
        s = simulate(u)
        fitter = Fitter(Bench([Recording(s.t, u, s.p1, s.p2, s.x)]))
        base = replace(starting_valve(fitter.bench), cost=1e5, candidates=beside)
        noise = np.random.default_rng(0).standard_normal(u.size)
        misfit = gap**0.5 * np.sin(0.01 * np.arange(u.size)) * (np.arange(u.size) % 400 > 150)
        done = []

        def share(valve):
            return closes[valve.candidates[-1].effect] if valve.candidates != beside else 0.0

        def screened(fitter, candidate, *rest):
            done.append(candidate.effect)
            values = {**base.values, **candidate.neutral, **dict(sized)}
            there = replace(base, values=values, candidates=(candidate,))
            return replace(there, cost=(1.0 - share(there)) * base.cost)

        def same(self, valve, *rest):
            return valve

        def refined(self, valve, *rest):
            done.append(f'{valve.candidates[-1].effect} refined')
            return valve

        def found_base(fitter, group, valve, drive):
            done.append('deepened')
            return valve

        def residuals(self, valve, *rest):
            return noise + misfit * (1.0 - share(valve)) ** 0.5

        def told(*about):
            return replace(clues(*about), foretold=foretold)

        monkeypatch.setattr(heats, 'screened', screened)
        monkeypatch.setattr('valve_sim_ros.diagnosis.race.clues', told)
        monkeypatch.setattr('valve_sim_ros.diagnosis.race.find_base', found_base)
        for name, search in (('fit', same), ('evolve', same), ('refined', refined)):
            monkeypatch.setattr(Fitter, name, search)
        monkeypatch.setattr(Fitter, 'residuals', residuals)
        left = leftover(residuals(fitter, base)).excess
        race(fitter, STEM, base, [c for c in STEM.candidates() if c.effect in closes], **how)
        return left, done

    return run


@pytest.mark.parametrize(('closed', 'deepened'), [(0.9999, False), (0.8, True)])
def test_in_haste_one_that_takes_long_is_tried_before_another_is_deepened(closed, deepened, steps):
    _, done = steps({LABORIOUS: closed, QUICK: 0.9}, deeply=True, hastily=True)
    assert ('deepened' in done) == deepened
    assert not deepened or done.index(LABORIOUS) < done.index('deepened')


@pytest.mark.parametrize(
    ('closed', 'beside', 'tried'),
    [(0.97, '', False), (0.9, '', True), (0.9, QUICK, False), (0.5, QUICK, True)],
)
def test_in_haste_one_that_takes_long_waits_if_others_explain_enough(closed, beside, tried, steps):
    named = tuple(each for each in STEM.candidates() if each.effect == beside)[:1]
    _, done = steps(
        {LABORIOUS: 0.99, 'friction_asymmetry': closed}, beside=named, hastily=True, deeply=True
    )
    assert (LABORIOUS in done) == tried


@pytest.mark.parametrize(('second', 'longer'), [(0.5, True), (0.1, False)])
def test_one_that_costs_far_more_than_the_best_is_not_refined(second, longer, steps):
    _, done = steps({'friction_asymmetry': 0.6, QUICK: second})
    assert (f'{QUICK} refined' in done) == longer
    assert 'friction_asymmetry refined' in done


@pytest.mark.parametrize(('force', 'tried'), [(15.0, False), (40.0, True)])
def test_others_are_tried_beside_one_far_larger_than_usual_whatever_it_explains(
    force, tried, steps
):
    closes = {QUICK: 0.9999, 'linkage_backlash': 0.5, LABORIOUS: 0.5}
    _, done = steps(closes, sized={f'{QUICK}.force': force})
    assert ('linkage_backlash' in done) == (LABORIOUS in done) == tried


@pytest.mark.parametrize(('gap', 'tried'), [(0.5, True), (0.01, False)])
def test_a_little_that_is_left_is_reason_enough_for_one_that_takes_long(gap, tried, steps):
    left, done = steps({LABORIOUS: 0.5, 'spring_preload': 0.1}, gap)
    assert left < odds.SPOTLESS
    assert (left > FAINT) == tried == (LABORIOUS in done)


@pytest.mark.parametrize(('closed', 'others'), [(0.9999, False), (0.9, True)])
def test_a_race_begins_with_what_the_record_itself_tells(closed, others, steps):
    told = 'sensor_drift'
    _, done = steps({told: closed, QUICK: 0.5, LABORIOUS: 0.5}, foretold=told, deeply=True)
    assert done[0] == told
    assert done.count(told) == 2  # both forms of its law, once
    assert (QUICK in done) == (LABORIOUS in done) == others
    assert ('deepened' in done) == others


@pytest.mark.parametrize(('part', 'tried'), [(0.95, False), (0.8, True)])
def test_a_stem_at_the_edge_of_a_step_leaves_more_beside_a_coarse_sensor(part, tried, steps):
    _, done = steps({odds.COARSE: part, 'linkage_backlash': 0.5}, gap=3.0)
    assert ('linkage_backlash' in done) == tried
