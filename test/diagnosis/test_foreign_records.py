# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What records of simulators by other authors showed."""

from dataclasses import replace

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import diagnose
from valve_sim_ros.diagnosis.adequacy import Leftover
from valve_sim_ros.diagnosis.diagnose import _closes_nothing
from valve_sim_ros.diagnosis.outcome import concluded, Ladder
from valve_sim_ros.diagnosis.proof import Gap, Halves
from valve_sim_ros.diagnosis.rung import Rung
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.recordings.recording import Recording

VALVE = {'f_d1': 0.9, 'T_g1': 4.0, 'T_g2': 6.0, 'f_s': 5.0, 'f_d': 2.5}


def read_just_before(rows, period, noise, rng, **effects):
    """Return the record of a valve whose signals are read just before each command."""
    fine = 0.01
    per_sample = round(period / fine)
    used = list({name.split('.')[0] for name in effects})
    u = np.repeat(rows, per_sample)
    run = simulate(u, fine, {**VALVE, 'effects': used, **effects})
    before = np.maximum(per_sample * np.arange(rows.size) - 1, 0)
    whole = (run.p1, run.p2, run.x)
    signals = [each[before] + noise * rng.standard_normal(rows.size) for each in whole]
    return Recording(period * np.arange(rows.size), rows, *signals)


def staircase(rng, levels, hold):
    return np.repeat(rng.uniform(10.0, 90.0, levels), hold)


def named(record):
    return [each.rung.effect for each in diagnose([record]).effects]


@pytest.mark.slow
def test_behind_a_positioner_p1_read_just_before_the_command_is_no_dead_time():
    rng = np.random.default_rng(3)
    rows = staircase(rng, 40, 25)
    record = read_just_before(rows, 0.5, 0.25, rng, **{'positioner_loop.gain': 0.4})
    assert named(record) == ['positioner_loop']


@pytest.mark.parametrize('command', ['steps', 'triangle'])
def test_p1_read_just_before_the_command_is_no_lag(command):
    rng = np.random.default_rng(5)
    rows = staircase(rng, 30, 40)
    if command == 'triangle':
        rows = 50.0 + 40.0 * np.abs(np.arange(1200) / 100 % 2 - 1)
    assert named(read_just_before(rows, 0.2, 0.06, rng)) == []


@pytest.mark.slow
def test_misfit_all_over_p2_does_not_pass_for_coloured_noise():
    rng = np.random.default_rng(6)
    effects = {'nonlinear_flow.exponent': 0.74}
    run = simulate(
        staircase(rng, 90, 8),
        1.0,
        {**VALVE, 'T_g2': 11.0, 'effects': ['nonlinear_flow'], **effects},
    )
    noisy = [each + 0.25 * rng.standard_normal(run.t.size) for each in (run.p1, run.p2)]
    assert named(Recording(run.t, run.u, *noisy)) == ['nonlinear_flow']


@pytest.mark.parametrize(('colour', 'expected'), [(0.0, []), (0.75, []), (0.88, [])])
def test_coloured_noise_of_p2_is_no_effect(colour, expected):
    rng = np.random.default_rng(7)
    run = simulate(staircase(rng, 60, 30), 0.2, VALVE)
    noisy = []
    for signal in (run.p1, run.p2):
        noise = np.zeros(run.t.size)
        for k in range(1, noise.size):
            noise[k] = colour * noise[k - 1] + rng.standard_normal()
        noisy.append(signal + 0.25 * noise / noise.std())
    assert named(Recording(run.t, run.u, *noisy)) == expected


@pytest.mark.slow
@pytest.mark.parametrize('offset', [0.0, 0.5])
def test_steps_of_a_sensor_show_under_noise_that_comes_after_them(offset):
    rng = np.random.default_rng(8)
    run = simulate(staircase(rng, 60, 12), 1.0, VALVE)
    x = 3.1 * np.rint((run.x - offset) / 3.1) + offset
    noisy = [each + 0.2 * rng.standard_normal(run.t.size) for each in (run.p1, run.p2, x)]
    assert named(Recording(run.t, run.u, *noisy)) == ['sensor_quantisation']


@pytest.mark.parametrize(
    ('fitted', 'held_out', 'empty'),
    [(1.0, 1.0, True), (0.3, 1.0, False), (1.0, 0.3, False), (0.95, 0.9, True)],
)
def test_a_name_that_closes_little_on_both_parts_is_withdrawn(fitted, held_out, empty):
    left, before = Halves(fitted, held_out), Halves(1.0, 1.0)
    gap = Gap(0.2, before, left, before, before)
    group = groups(('p1', 'p2', 'x'))[2]
    noise = Leftover(1.2, 1.2, 1.0, 5000, 1.0)
    ladder = Ladder(group, 'missing_effect', None, None, noise, noise)
    assert _closes_nothing({'x': gap}, ladder) == empty
    assert concluded(ladder).outcome == 'adequate'
    coarse = Rung('sensor_quantisation', 'sensor', {}, noise, noise, 0.0, 0.9, (), None)
    assert not _closes_nothing({'x': gap}, replace(ladder, rungs=(coarse,)))


@pytest.mark.slow
def test_a_lag_of_the_sensor_is_not_taken_for_a_stem_slower_than_any():
    rng = np.random.default_rng(9)
    valve = {'f_d1': 0.5, 'T_g1': 2.9, 'T_g2': 4.2, 'f_s': 3.4, 'f_d': 2.7}
    lag = {'effects': ['sensor_lag'], 'sensor_lag.time_constant': 1.0}
    run = simulate(staircase(rng, 60, 28), 0.5, {**valve, **lag})
    noisy = [each + 0.3 * rng.standard_normal(run.t.size) for each in (run.p2, run.x)]
    assert named(Recording(run.t, run.u, p2=noisy[0], x=noisy[1])) == ['sensor_lag']
