# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands that never reached the recorder."""

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import diagnose
from valve_sim_ros.diagnosis.adequacy import leftover
from valve_sim_ros.diagnosis.base_valve import find_base, starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.fitting import Fitter
from valve_sim_ros.diagnosis.readings import bridged
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.recordings import read_recording

VALVE = {'f_d1': 0.8, 'T_g1': 2.0, 'T_g2': 12.0, 'f_s': 6.0, 'f_d': 3.0}


def written(path, u, lost, rng):
    """Write the record of a valve that received all commands, some of which were lost."""
    run = simulate(u, 0.2, VALVE)
    columns = [run.t, np.where(lost, np.nan, u)]
    columns += [each + 0.15 * rng.standard_normal(u.size) for each in (run.p1, run.p2, run.x)]
    lines = [
        ','.join('' if v != v else f'{v:.6f}' for v in row) for row in zip(*columns, strict=True)
    ]
    path.write_text('t,u,p1,p2,x\n' + '\n'.join(lines) + '\n')
    return path


def without_rows(path, lost):
    """Leave out the rows of a record that are lost."""
    header, *lines = path.read_text().splitlines()
    kept = [line for line, gone in zip(lines, lost, strict=True) if not gone]
    path.write_text('\n'.join([header, *kept]) + '\n')
    return path


def test_lost_commands_of_one_that_creeps_lie_on_a_line_and_steps_are_unsure():
    u = np.array([0.0, 1.0, 2.0, 2.0, 4.0, 5.0, 5.0, 5.0, 5.0, 40.0, 40.0, 40.0, 40.0])
    sent, unsure = bridged(u, np.array([3, 8, 11]))
    assert sent.tolist() == [0, 1, 2, 3, 4, 5, 5, 5, 5, 40, 40, 40, 40]
    assert unsure.tolist() == [9]


@pytest.mark.slow
@pytest.mark.parametrize('ramp', [False, True])
def test_a_clean_record_that_lost_commands_is_adequate(tmp_path, ramp):
    rng = np.random.default_rng(8)
    levels = rng.uniform(10.0, 90.0, 40)
    u = np.repeat(levels, 60)
    if ramp:
        u = np.interp(np.arange(u.size), 60 * np.arange(levels.size), levels)
    lost = rng.random(u.size) < 0.02
    lost[60:1200:120] = True  # every other step of the first half came with one of them
    lost[0] = False
    found = diagnose([written(tmp_path / 'lossy.csv', u, lost, rng)])
    assert found.verdict == 'adequate'
    assert found.gaps['p2'].before.held_out < 0.16
    (stretch,) = found.bench.stretches
    known = ~lost | (np.diff(u, prepend=u[0]) == 0.0)
    assert np.abs(stretch.u - u)[known].max() < 1e-5
    if not ramp:
        put = np.abs(stretch.u - u)[lost & ~known] < 1e-5
        assert put.mean() > 0.8


def test_a_lost_command_that_was_not_on_the_line_tells_nothing_of_p1(tmp_path):
    rng = np.random.default_rng(8)
    u = 50.0 + 30.0 * np.sin(np.arange(1500) / 20.0)
    lost = rng.random(u.size) < 0.02
    lost[[0, -1]] = False
    u[np.flatnonzero(lost)[::2]] = u[np.flatnonzero(lost)[::2] - 1]  # the new one came late
    bench = Bench([read_recording(written(tmp_path / 'late.csv', u, lost, rng))])
    fitter, group = Fitter(bench), groups(bench.signals)[0]
    base = find_base(fitter, group, starting_valve(bench), ())
    left = leftover(fitter.residuals(base, 'p1'))
    assert (left.far, base.values['f_d1']) == (0, pytest.approx(VALVE['f_d1'], abs=0.02))


@pytest.mark.slow
def test_a_clean_record_that_lost_whole_rows_is_adequate(tmp_path):
    rng = np.random.default_rng(9)
    u = np.repeat(rng.uniform(10.0, 90.0, 40), 60)
    lost = rng.random(u.size) < 0.02
    lost[60:1200:120] = True
    lost[[0, -1]] = False
    path = without_rows(written(tmp_path / 'holes.csv', u, np.zeros(u.size), rng), lost)
    recording = read_recording(path)
    assert recording.quality.lost_commands == tuple(np.flatnonzero(lost))
    np.testing.assert_allclose(recording.time, 0.2 * np.arange(u.size), atol=1e-9)
    assert np.isnan(recording.x[lost]).all()
    assert not np.isnan(recording.x[~lost]).any()
    found = diagnose(recording)
    assert found.verdict == 'adequate'
    assert found.gaps['p2'].before.held_out < 0.16
    (stretch,) = found.bench.stretches
    steps = lost & (np.diff(u, prepend=u[0]) != 0.0)
    assert np.mean(np.abs(stretch.u - u)[steps] < 1e-5) > 0.8


def test_rows_of_no_grid_and_behind_gaps_are_not_filled_in(tmp_path):
    path = tmp_path / 'times.csv'
    for times, count in (
        ([0, 1, 2, 4, 5, 6, 7, 8, 9, 20, 21], 12),
        ([0, 1, 2.4, 3, 4.6, 6, 7.5], 7),
    ):
        path.write_text('t,u,x\n' + ''.join(f'{time},5,1\n' for time in times))
        assert len(read_recording(path)) == count


def test_a_first_command_that_was_lost_is_refused(tmp_path):
    path = tmp_path / 'headless.csv'
    path.write_text('t,u,x\n0,,1\n1,5,1\n2,,1\n')
    with pytest.raises(ValueError, match='u holds 1 values'):
        read_recording(path)
    path.write_text('t,u,x\n0,5,1\n1,6,1\n2,,1\n')
    recording = read_recording(path)
    assert recording.u.tolist() == [5.0, 6.0, 6.0]
    assert recording.quality.lost_commands == (2,)
    assert 'u: 1 samples without a command, the one before holds' in recording.quality.lines()
