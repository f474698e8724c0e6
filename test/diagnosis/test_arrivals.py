# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands that come just when samples are taken."""

from dataclasses import replace
import itertools

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import diagnose, odds
from valve_sim_ros.diagnosis.base_valve import starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.clues import clues
from valve_sim_ros.diagnosis.fitting import Fitter
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.diagnosis.unknowns import BLEND
from valve_sim_ros.recordings.recording import Recording

VALVE = {'f_d1': 0.5, 'T_g1': 8.0, 'T_g2': 30.0, 'f_s': 4.0, 'f_d': 2.4}


def recorded(rng, share, **effects):
    """Return a record with a share of the steps at the sample after that by which they came.

    Also returns the first samples of all steps, and of those.
    """
    u = np.repeat(rng.uniform(10.0, 90.0, 120), rng.integers(6, 16, 120))
    steps = np.flatnonzero(np.diff(u)) + 1
    early = steps[rng.random(steps.size) < share]
    sent = u.copy()
    sent[early - 1] = u[early]
    used = list({name.split('.')[0] for name in effects})
    run = simulate(sent, 0.5, {**VALVE, 'effects': used, **effects})
    p1 = run.p1.copy()
    p1[early - 1] = p1[early - 2]  # taken a little before the command
    noisy = [each + 0.2 * rng.standard_normal(u.size) for each in (p1, run.p2)]
    return Recording(run.t, u, *noisy), steps, early


@pytest.mark.slow
@pytest.mark.parametrize(
    ('share', 'effect'),
    [
        (0.3, {}),
        (0.3, {'quick_exhaust.factor': 5.0, 'quick_exhaust.threshold': 9.0}),
        (0.93, {}),
    ],
)
def test_each_step_is_put_in_its_period_behind_a_slow_chamber(share, effect):
    record, steps, early = recorded(np.random.default_rng(11), share, **effect)
    found = diagnose([record])
    assert [named.rung.effect for named in found.effects] == [*{n.split('.')[0] for n in effect}]
    assert found.ladders[1].after.mean_square < 1.0  # noise
    (stretch,) = found.bench.stretches
    large = steps[np.abs(np.diff(record.u)[steps - 1]) > 30.0]
    assert large.size > 30
    if share < 0.5:
        moved = stretch.u[large - 1] != record.u[large - 1]
        few = np.isin(large, early)
    else:
        moved = stretch.u[large] != record.u[large]
        few = ~np.isin(large, early)
    assert few.any()
    assert np.mean(moved == few) > 0.95


@pytest.mark.parametrize(('period', 'since', 'lag'), [(0.5, 0.15, 0.32), (0.2, 0.01, 0.06)])
def test_a_lag_is_named_from_what_follows_steps_wherever_the_sample_is(period, since, lag):
    rng = np.random.default_rng(2)
    fine = 0.01
    per_sample = round(period / fine)
    rows = np.repeat(rng.uniform(10.0, 90.0, 40), rng.integers(20, 60, 40))
    values = {**VALVE, 'effects': ['ip_lag'], 'ip_lag.time_constant': lag}
    run = simulate(np.repeat(rows, per_sample), fine, values)
    p1 = run.p1[round(since / fine) :: per_sample] + 0.27 * rng.standard_normal(rows.size)
    found = diagnose([Recording(period * np.arange(rows.size), rows, p1)])
    (named,) = found.effects
    assert named.rung.effect == 'ip_lag'
    assert named.values['ip_lag.time_constant'] == pytest.approx(lag, rel=0.05)
    assert found.ladders[0].after.excess < 0.1


def test_a_lag_before_the_play_is_told_from_one_behind_it():
    rng = np.random.default_rng(5)
    u = np.repeat(rng.uniform(10.0, 90.0, 40), 40)
    lag = {'ip_lag.time_constant': 0.8, 'ip_lag.upstream': 1.0}
    run = simulate(u, parameters={**VALVE, 'f_d1': 2.0, 'effects': ['ip_lag'], **lag})
    found = diagnose([Recording(run.t, u, run.p1 + 0.2 * rng.standard_normal(u.size))])
    (named,) = found.effects
    assert named.rung.effect == 'ip_lag'
    assert named.values['ip_lag.time_constant'] == pytest.approx(0.8, rel=0.03)
    assert named.values['ip_lag.upstream'] == pytest.approx(1.0, abs=0.05)


QUICK = {'f_d1': 0.5, 'T_g1': 1.0, 'T_g2': 2.0, 'f_s': 4.0, 'f_d': 2.4}


def sampled(u, every, offset=0, **values):
    """Return a record in which only some samples of the commands, and of what follows, are seen.

    Outputs are seen `offset` samples after the command beside them.
    """
    run = simulate(u, 0.05, {**QUICK, **values})
    rng = np.random.default_rng(1)
    outputs = (each[offset::every] for each in (run.p1, run.p2))
    noisy = [each + 0.2 * rng.standard_normal(each.size) for each in outputs]
    size = noisy[0].size
    return Recording(run.t[::every][:size], u[::every][:size], *noisy)


def steps_at_any_time(rng):
    """Return 0.05 s samples of a command that steps whenever it likes."""
    return np.repeat(rng.uniform(10.0, 90.0, 50), rng.integers(250, 600, 50))


@pytest.mark.parametrize('offset', [0, 8])
def test_steps_that_come_at_any_time_are_put_where_they_came(offset):
    found = diagnose([sampled(steps_at_any_time(np.random.default_rng(2)), 10, offset)])
    assert found.verdict == 'adequate'
    assert max(ladder.before.excess for ladder in found.ladders) < 0.2
    values = found.base_valve.values
    assert [values[n] for n in ('T_g1', 'T_g2')] == pytest.approx([1.0, 2.0], rel=0.03)


@pytest.mark.slow
def test_some_steps_may_come_between_those_on_either_side_of_a_sample():
    rng = np.random.default_rng(2)
    since = rng.choice([0, 1, 6], 50, p=[0.2, 0.6, 0.2])
    starts = 10 * np.cumsum(rng.integers(25, 60, 50)) + since
    u = np.repeat(rng.uniform(10.0, 90.0, 50), np.diff(starts, prepend=0))
    found = diagnose([sampled(u, 10, T_g1=3.0, T_g2=9.0)])
    assert found.verdict == 'adequate'
    assert max(ladder.before.mean_square for ladder in found.ladders) < 1.0  # noise


@pytest.mark.slow
def test_an_effect_of_the_chamber_is_no_scatter_of_commands():
    u = steps_at_any_time(np.random.default_rng(2))
    run = simulate(
        u, 0.5, {**QUICK, 'effects': ['nonlinear_flow'], 'nonlinear_flow.exponent': 0.6}
    )
    rng = np.random.default_rng(1)
    noisy = [each + 0.2 * rng.standard_normal(u.size) for each in (run.p1, run.p2)]
    found = diagnose([Recording(run.t, u, *noisy)])
    assert [named.rung.effect for named in found.effects] == ['nonlinear_flow']
    assert not any(stretch.sooner.any() for stretch in found.bench.stretches)


def test_a_swing_that_is_late_by_a_part_of_a_period_is_no_lag():
    u = 50.0 + 40.0 * np.sin(2.0 * np.pi * np.arange(12_000) / 900.0)
    late = np.concatenate([np.full(3, u[0]), u[:-3]])
    run, rng = simulate(late, 0.05, QUICK), np.random.default_rng(1)
    p1 = run.p1[::10] + 0.2 * rng.standard_normal(1200)
    found = diagnose([Recording(run.t[::10], u[::10], p1)])
    assert found.verdict == 'adequate'
    assert found.base_valve.values['blend'] == pytest.approx(0.3, abs=0.05)


def test_commands_that_go_on_between_samples_are_no_effect_beside_steps():
    """Ramps are followed between two samples, steps come with them."""
    found = diagnose([ramps_and_steps()])
    assert found.verdict == 'adequate'
    assert found.base_valve.values['lead'] == pytest.approx(0.45, abs=0.05)
    assert found.ladders[1].before.excess < 0.05


def test_a_dead_time_below_a_period_is_no_lag_where_ramps_go_on_between_samples():
    """Steps show it at the next sample, ramps as it is: a lag would be over by then."""
    effect = {'effects': ['ip_dead_time'], 'ip_dead_time.dead_time': 0.25}
    found = diagnose([ramps_and_steps(**effect)])
    assert [named.rung.effect for named in found.effects] == ['ip_dead_time']
    assert found.ladders[0].after.excess < 0.05
    assert found.augmented_valve.values['ip_dead_time.dead_time'] == pytest.approx(0.25, abs=0.1)


def ramps_and_steps(fine=10, **effect):
    """Return a record of 0.5 s samples of commands that came ten times as often."""
    rng = np.random.default_rng(2)
    levels = rng.uniform(10.0, 90.0, 30)
    pieces = [np.full(40 * fine, levels[0])]
    for before, after in itertools.pairwise(levels):
        size = int(rng.integers(20, 40)) * fine
        pieces += [np.linspace(before, after, size + 1)[1:], np.full(size, after)]
        pieces += [np.full(size, level) for level in rng.uniform(10.0, 90.0, 2)]
        pieces += [np.full(size, after)]
    u = np.concatenate(pieces)
    run = simulate(u, 0.05, {**QUICK, **effect})
    seen = slice(None, None, fine)
    noisy = [each[seen] + 0.2 * rng.standard_normal(each[seen].size) for each in (run.p1, run.p2)]
    return Recording(run.t[seen], u[seen], *noisy)


def test_a_lag_is_also_sought_where_ramps_come_with_steps():
    """That ramps are late by most of a period may have made up for it."""
    fitter = Fitter(Bench([ramps_and_steps()]), nuisances=frozenset({BLEND}))
    group = groups(fitter.bench.signals)[0]
    base = starting_valve(fitter.bench)
    shown = clues(fitter, group, replace(base, values={**base.values, 'blend': 0.9}))
    assert {'blend': 0.0} in shown.lags


@pytest.mark.parametrize(
    ('effect', 'parameter', 'late'),
    [('ip_lag', 'time_constant', 0.22), ('ip_dead_time', 'dead_time', 0.28)],
)
def test_what_is_late_by_more_than_a_period_is_no_phase(effect, parameter, late):
    """Where p2 alone tells it, a base valve a whole period late leaves next to nothing."""
    u = np.repeat(np.random.default_rng(2).uniform(10.0, 90.0, 60), 60 * 4)
    given = {'effects': [effect], f'{effect}.{parameter}': late}
    record = sampled(u, 4, T_g1=4.0, T_g2=9.0, **given)
    found = diagnose([Recording(record.time, record.u, p2=record.p2)])
    assert found.ladders[0].before.excess < odds.LEAST_EXCESS['p2']
    (named,) = found.effects
    assert effect in {named.rung.effect, *named.rung.twins}
