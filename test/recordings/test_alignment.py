# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Samples and commands find each other again, whatever the recorder did to their stamps."""

import numpy as np
import pytest
from recorded import commands, faults, recorded

from valve_sim_ros.recordings.align import align
from valve_sim_ros.recordings.arrivals import Arrivals
from valve_sim_ros.recordings.recording import Provenance

SEEDS = range(3)
COMMANDS = 30


def found_and_faults(seed, count=COMMANDS, phase=None, **recorder):
    rng = np.random.default_rng(seed)
    truth, arrivals = recorded(rng, *commands(rng, count, 8.0, phase), **recorder)
    found = align(arrivals, Provenance())
    return truth, found, faults(truth, found)


@pytest.mark.parametrize('seed', SEEDS)
@pytest.mark.parametrize(
    'recorder',
    [
        {},
        {'lag': 0.05},
        {'lag': 0.12},
        {'lag': 0.18, 'signals': ('p1',)},
        {'command_lag': 0.1},
        {'command_lag': 0.18},
        {'dead_samples': 1},
        {'dead_samples': 2, 'lag': 0.06},
        {'sample_time': 0.01, 'noise': 0.02, 'lag': 0.004},
    ],
    ids=str,
)
def test_a_constant_lag_is_found_and_no_sample_gets_another_command(seed, recorder):
    _, found, wrong = found_and_faults(seed, **recorder)
    assert wrong == (0, 0)
    low, high = found.quality.command_offset_range
    sample = recorder.get('sample_time', 0.2)
    lag = recorder.get('lag', 0.0) - recorder.get('command_lag', 0.0)
    assert low - sample / 40 <= lag <= high + sample / 40
    assert found.quality.dead_samples == recorder.get('dead_samples', 0)


@pytest.mark.parametrize('seed', SEEDS)
@pytest.mark.parametrize('share', [0.5, 0.7, 0.95])
@pytest.mark.parametrize('loss', [0.0, 0.02])
def test_stamps_that_lag_by_up_to_a_sample_at_random(seed, share, loss):
    rng = np.random.default_rng(100 + seed)
    truth, found, (_, wrong) = found_and_faults(
        seed, lag=lambda count: rng.uniform(0.0, 0.2 * share, count), loss=loss
    )
    assert wrong == 0
    assert len(found) == truth.t.size
    assert found.quality.period == 0.2


def test_loss_and_jitter_misplace_no_sample_and_hardly_a_command():
    wrong = sum(np.array(found_and_faults(seed, jitter=0.02, loss=0.05)[2]) for seed in range(8))
    assert wrong[1] == 0
    assert wrong[0] <= 0.03 * 8 * COMMANDS


def test_commands_sent_right_at_the_samples_are_sorted_out_by_the_outputs():
    _, found, wrong = found_and_faults(0, phase=0.0, jitter=0.005)
    assert wrong == (0, 0)
    assert not found.quality.doubtful_commands


def test_where_only_a_sticking_stem_answers_no_offset_is_claimed():
    _, found, wrong = found_and_faults(0, signals=('x',))
    assert wrong == (0, 0)
    assert np.isnan(found.quality.command_offset_range).all()
    assert 'the data cannot tell' in '; '.join(found.quality.lines())


def test_commands_at_every_sample_and_only_on_change_mean_the_same():
    rng = np.random.default_rng(2)
    truth, arrivals = recorded(rng, *commands(rng, 20, 8.0))
    sparse = align(arrivals, Provenance())
    stamps = arrivals['x'].stamps - 1_000_000
    arrivals['u'] = type(arrivals['u'])(stamps, truth.u)
    dense = align(arrivals, Provenance())
    np.testing.assert_array_equal(sparse.u, truth.u)
    np.testing.assert_array_equal(dense.u, truth.u)


def test_outputs_slower_than_the_valve_keep_their_places():
    rng = np.random.default_rng(3)
    truth, arrivals = recorded(rng, *commands(rng, 20, 8.0), jitter=0.01)
    slow = {name: each.part(slice(None, None, 4)) for name, each in arrivals.items()}
    slow['u'] = arrivals['u']
    found = align(slow, Provenance(), sample_time=0.2)
    there = np.flatnonzero(np.isfinite(found.x))
    np.testing.assert_array_equal(there, np.arange(0, truth.t.size, 4))
    np.testing.assert_array_equal(found.x[there], truth.x[::4])
    assert found.quality.loss == 0.0


def test_stamps_without_any_regularity_are_used_as_they_are():
    rng = np.random.default_rng(4)
    _, arrivals = recorded(rng, *commands(rng, 20, 8.0), signals=('x',))
    count = arrivals['x'].stamps.size
    steps = rng.exponential(0.2, count) + 0.001
    stamps = arrivals['x'].stamps[0] + np.int64(1e9 * np.cumsum(steps))
    arrivals['x'] = type(arrivals['x'])(stamps, arrivals['x'].values)
    found = align(arrivals, Provenance())
    assert not found.quality.regular
    assert 'no regular grid' in '; '.join(found.quality.lines())
    assert len(found) > 0.98 * count


@pytest.mark.parametrize('seed', SEEDS)
@pytest.mark.parametrize('jitter', [0.0, 0.004])
@pytest.mark.parametrize('dead_samples', [1, 3, 4, 9])
def test_commands_stay_together_where_p1_is_read_just_before_them(seed, jitter, dead_samples):
    rng = np.random.default_rng(seed)
    truth, arrivals = recorded(
        rng,
        *commands(rng, COMMANDS, 8.0, 0.0),
        parameters={'T_g1': 2.0, 'T_g2': 3.0},
        noise=0.16,
        jitter=jitter,
        command_lag=0.001 + jitter,
        dead_samples=dead_samples,
    )
    late = np.concatenate([truth.p1[:1], truth.p1[:-1]])
    arrivals['p1'] = Arrivals(arrivals['p1'].stamps, late)
    found = align(arrivals, Provenance())
    steps, sent = (np.flatnonzero(np.diff(u)) for u in (found.u, truth.u))
    assert np.unique(steps - sent[: steps.size]).size == 1
    assert found.quality.decided_commands == 0
