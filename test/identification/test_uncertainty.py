# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the data cannot see is said, and intervals are as wide as the scatter they stand for."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from valve_sim_ros import identify, Recording, simulate
from valve_sim_ros.identification.colour import scatter
from valve_sim_ros.identification.problem import Problem

TRUTH = {'f_d1': 2.5, 'T_g1': 5.0, 'T_g2': 20.0, 'f_s': 7.0, 'f_d': 3.0}
STAIRS = np.repeat(np.random.default_rng(5).uniform(5.0, 95.0, 30), 50)
UP_STEP = np.r_[np.zeros(40), np.full(400, 60.0)]


def record(u, noise=0.1, signals=('x',), sample_time=0.2, memory=0.0, seed=0, **changes):
    clean = simulate(u, sample_time, {**TRUTH, **changes})
    rng = np.random.default_rng(seed)
    measured = {
        n: getattr(clean, n) + lfilter([noise], [1.0, -memory], rng.standard_normal(clean.t.size))
        for n in signals
    }
    return Recording(clean.t, clean.u, **measured)


@pytest.fixture(scope='module')
def up_step():
    return identify(record(UP_STEP), hold_out=False, profiles=True)


def test_one_up_step_shows_sums_but_not_their_parts(up_step):
    estimates = up_step.estimates
    for name in ('f_d1', 'f_s', 'f_d', 'T_g2'):
        assert estimates[name].verdict.startswith('not identified'), name
    assert estimates['T_g1'].identified
    together = up_step.assessment.combinations['f_d1 + f_d']
    assert together.lower <= TRUTH['f_d1'] + TRUTH['f_d'] <= together.upper
    assert together.half_width < 0.05
    assert any('f_d1 + f_d' in line for line in up_step.lines())


def test_profiles_follow_the_ridge_and_see_where_the_data_set_no_bound(up_step):
    profiles = {each.name: each for each in up_step.profiles}
    backlash = profiles['f_d1']
    assert backlash.lower < TRUTH['f_d1'] < backlash.upper
    # f_d cannot be negative, so the backlash alone cannot exceed the sum
    assert 5.4 < backlash.upper < 5.6
    assert profiles['T_g2'].lower is None
    assert profiles['T_g2'].upper is None
    assert 'no bound' in profiles['T_g2'].text()


def test_profile_agrees_with_the_interval_where_all_is_seen():
    result = identify(record(STAIRS, signals=('p2', 'x')), hold_out=False, profiles=True)
    for each in result.profiles:
        estimate = result.estimates[each.name]
        assert each.lower == pytest.approx(estimate.lower, abs=0.5 * estimate.half_width)
        assert each.upper == pytest.approx(estimate.upper, abs=0.5 * estimate.half_width)
    json.dumps(result.as_json(), allow_nan=False)


def test_a_1_and_a_2_part_when_slips_are_sampled_finely():
    u = np.repeat([0.0, 60.0, 20.0, 70.0, 10.0], 600)
    fast = identify(record(u, 0.05, ('p2', 'x'), 0.005, T_g1=0.5, T_g2=0.5), hold_out=False)
    for name, true in (('a_1', 2000.0), ('a_2', 176.0)):
        estimate = fast.estimates[name]
        assert not estimate.verdict.startswith('not'), name
        assert abs(estimate.value - true) < 3.0 * estimate.standard_error


def test_noise_that_remembers_widens_the_intervals():
    white = identify(record(STAIRS, 0.1, memory=0.0), hold_out=False)
    spread = 0.1 * np.sqrt(1.0 - 0.9**2)
    slow = identify(record(STAIRS, spread, memory=0.9), hold_out=False)
    assert slow.estimates['T_g1'].half_width > 2.0 * white.estimates['T_g1'].half_width


def test_scatter_is_that_of_the_process():
    """Against Omega written out, for residuals of a known autoregressive process."""
    memory, size = 0.7, 4000
    rng = np.random.default_rng(1)
    problem = Problem([record(np.resize(STAIRS, size))])
    residuals = lfilter([1.0], [1.0, -memory], rng.standard_normal(size))
    columns = np.cumsum(rng.standard_normal((size, 2)), axis=0) / 30.0
    lags = np.abs(np.subtract.outer(np.arange(size), np.arange(size)))
    expected = columns.T @ (memory**lags / (1.0 - memory**2)) @ columns
    assert scatter(problem, columns, residuals) == pytest.approx(expected, rel=0.2)
