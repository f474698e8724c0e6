# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands whose sample is in doubt; starts of which the first samples are lost."""

from dataclasses import replace

import numpy as np
import pytest

from valve_sim_ros import identify, Recording, simulate
from valve_sim_ros.identification.placing import placed
from valve_sim_ros.identification.problem import Problem

TRUTH = {'f_d1': 2.5, 'T_g1': 5.0, 'T_g2': 20.0, 'f_s': 7.0, 'f_d': 3.0}
MOVED = {150: 1, 450: -1, 900: 1}
"""Samples with which commands begin, and by how many samples they were recorded off."""


@pytest.fixture(scope='module')
def truth():
    return np.repeat(np.random.default_rng(5).uniform(5.0, 95.0, 40), 50)


def recorded(u, signals=('p1', 'p2', 'x'), lost=()):
    s = simulate(u, parameters=TRUTH)
    rng = np.random.default_rng(0)
    noisy = {n: getattr(s, n) + 0.1 * rng.standard_normal(u.size) for n in signals}
    for name in {'p1', 'p2'} & set(signals):
        noisy[name][list(lost)] = np.nan
    return Recording(s.t, s.u, **noisy)


def displaced(data, doubtful):
    """Return the recording with commands a sample off, and those in doubt."""
    u = data.u.copy()
    for row, by in MOVED.items():
        u[min(row, row + by) : max(row, row + by)] = u[row - 1] if by > 0 else u[row]
    return replace(data, u=u, quality=replace(data.quality, doubtful_commands=tuple(doubtful)))


@pytest.mark.parametrize('signals', [('p1', 'p2', 'x'), ('p2', 'x')])
def test_doubtful_commands_are_put_where_the_valve_answers(truth, signals):
    data = recorded(truth, signals, lost=[149, 150, 449, 450, 899, 900])
    doubtful = [row + by for row, by in MOVED.items()]
    wrong = displaced(data, [*doubtful, 1200])
    problem = Problem([wrong])
    found = placed(problem, problem.point(TRUTH))
    np.testing.assert_array_equal(found.stretches[0].u, truth)
    result = identify(wrong, hold_out=False)
    assert any('3 command(s) in doubt' in line for line in result.remarks)
    for name, value in TRUTH.items():
        estimate = result.estimates[name]
        assert abs(estimate.value - value) < 2.0 * estimate.half_width, name


def test_commands_that_are_not_in_doubt_stay(truth):
    problem = Problem([displaced(recorded(truth), [])])
    assert placed(problem, problem.point(TRUTH)) is problem


def test_a_start_whose_first_samples_are_lost_does_not_bias(truth):
    result = identify(recorded(truth, lost=range(4)), hold_out=False)
    assert all(eta > 99.9 for eta in result.eta_by_signal.values())
    for name, value in TRUTH.items():
        estimate = result.estimates[name]
        assert abs(estimate.value - value) < 2.0 * estimate.half_width, name
