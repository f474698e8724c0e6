# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Each defect of a recording raises its sentence, and the recommended signal cures it."""

from pathlib import Path

from click.testing import CliRunner
import numpy as np
import pytest

from valve_sim_ros import read_recording, Recording, RecordingError, simulate, write_recording
from valve_sim_ros.cli import main
from valve_sim_ros.recordings.advice import recommended, wanted
from valve_sim_ros.recordings.doctor import examine, HIDDEN, PARAMETERS, together, VISIBLE, WEAK
from valve_sim_ros.recordings.excitation import moves, slips, span, turns


def measured(u, signals=('p1', 'p2', 'x'), noise=0.1, sample_time=0.2, **parameters):
    s = simulate(u, sample_time, parameters)
    rng = np.random.default_rng(0)
    outputs = {n: getattr(s, n) + noise * rng.standard_normal(u.size) for n in signals}
    return Recording(s.t, s.u, **outputs)


def steps(*plan):
    """Return commands from pairs of level [%] and samples."""
    return np.concatenate([np.full(count, float(level)) for level, count in plan])


def verdicts(recording):
    return {each.parameter: each.visibility for each in examine(recording).verdicts}


UP = steps((10, 50), (60, 400))


@pytest.fixture(name='good', scope='module')
def _good():
    return measured(recommended().u)


def test_the_recommended_signal_shows_everything(good):
    found = examine(good)
    assert verdicts(good) == dict.fromkeys(PARAMETERS, VISIBLE)
    assert not found.missing
    assert not found.warnings
    assert found.filling.time_constant == pytest.approx(8.84, rel=0.1)
    assert found.emptying.time_constant == pytest.approx(150.74, rel=0.1)


@pytest.mark.parametrize(
    'valve',
    [
        {'f_d1': 0.5, 'T_g1': 3.0, 'T_g2': 30.0, 'f_s': 4.0, 'f_d': 2.0},
        {'f_d1': 5.0, 'T_g1': 20.0, 'T_g2': 60.0, 'f_s': 15.0, 'f_d': 6.0},
        {'T_g1': 1.0, 'T_g2': 1.5, 'f_s': 2.0, 'f_d': 1.0},
    ],
)
def test_the_recommended_signal_serves_other_valves_too(valve):
    found = verdicts(measured(recommended().u, **valve))
    assert found.pop('a_1/a_2') != HIDDEN
    assert set(found.values()) == {VISIBLE}


def test_the_noise_floor_and_the_resolution_are_told():
    good = measured(UP, noise=0.3)
    assert examine(good).signals['x'].noise == pytest.approx(0.3, rel=0.15)
    coarse = Recording(good.time, good.u, x=np.round(good.x / 0.5) * 0.5)
    assert examine(coarse).signals['x'].resolution == 0.5


@pytest.mark.parametrize(
    ('recording', 'parameter', 'visibility', 'words'),
    [
        (measured(UP), 'f_d1', HIDDEN, 'u never turns back'),
        (measured(UP), 'T_g2', HIDDEN, 'never empties'),
        (measured(UP), 'f_s', WEAK, '0 times down'),
        (measured(UP), 'f_d', WEAK, 'only one way'),
        (measured(UP, ('p1', 'p2')), 'f_s', HIDDEN, 'x was not measured'),
        (measured(UP, ('p1',)), 'T_g1', HIDDEN, 'neither p2 nor x'),
        (
            measured(steps((40, 900), (42, 99), (40, 99))).slice(180.0, 220.0),
            'f_d',
            HIDDEN,
            'travels up to',
        ),
        (measured(steps((10, 50), (90, 30), (10, 30)), ('x',)), 'f_d1', WEAK, '1 reversal'),
        (measured(steps((10, 9), (90, 9)), sample_time=10.0), 'T_g1', WEAK, 'few samples'),
    ],
    ids=lambda each: each if isinstance(each, str) else '',
)
def test_what_is_missing_is_said_parameter_by_parameter(recording, parameter, visibility, words):
    found = {each.parameter: each for each in examine(recording).verdicts}[parameter]
    assert found.visibility == visibility
    assert words in found.reason
    assert found.cure
    assert any(line.startswith('record next: ') for line in examine(recording).lines())


def changed(recording, **signals):
    columns = {n: getattr(recording, n) for n in ('u', *recording.signals)}
    return Recording(recording.time, **{**columns, **signals})


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (lambda r: {'u': np.full(len(r), 30.0)}, 'u stays at 30 %'),
        (lambda r: {'p1': None}, 'p1 not measured'),
        (lambda r: {'x': np.full(len(r), 20.0) + 0.1 * np.sin(r.time * 99)}, 'hardly leaves'),
        (lambda r: {'x': np.minimum(r.x, 50.0)}, 'x is clipped'),
        (lambda r: {'p1': 0.16 * r.p1 + 4.0, 'x': 2.0 * r.x}, 'is it in per cent of span'),
        (lambda r: {'x': np.where(np.arange(len(r)) % 3, np.nan, r.x)}, 'are lost'),
        (lambda r: {'x': r.x + 3.0 * np.random.default_rng(1).normal(size=len(r))}, 'x is noisy'),
        (lambda r: {'x': np.where(r.x < 50.0, 0.5, r.x)}, 'at an end of its travel'),
    ],
    ids=lambda each: each if isinstance(each, str) else '',
)
def test_each_defect_raises_its_sentence_and_a_good_recording_none(good, change, words):
    found = '; '.join(examine(changed(good, **change(good))).warnings)
    assert words in found


def test_recordings_complete_each_other():
    up = examine(measured(UP))
    down = examine(measured(steps((90, 50), (10, 1500), (50, 300), (20, 300))))
    best = {each.parameter: each.visibility for each in together([up, down])}
    assert best['T_g1'] == best['T_g2'] == VISIBLE
    assert best['f_s'] != HIDDEN


def test_the_signal_asks_only_for_what_is_missing_and_keeps_to_the_range():
    found = examine(measured(UP))
    assert set(wanted(found.verdicts)) >= {'f_d1', 'T_g2'}
    only = recommended(found, missing=('T_g2',), low=20.0, high=70.0)
    assert only.u.min() == 20.0
    assert only.u.max() == 70.0
    assert only.time[-1] < recommended(found, low=20.0, high=70.0).time[-1]
    with pytest.raises(RecordingError, match='at least 20 %'):
        recommended(low=50.0, high=60.0)


def test_the_facts_behind_the_verdicts():
    assert turns(np.array([0.0, 10.0, 20.0, 19.8, 30.0, 5.0, 5.0, 50.0])).tolist() == [
        0.0,
        30.0,
        5.0,
        50.0,
    ]
    x = np.concatenate([np.full(50, 20.0), np.linspace(20.0, 60.0, 100), np.full(50, 60.0)])
    (move,) = moves(x, 0.0)
    assert move.distance == pytest.approx(40.0, abs=1.0)
    assert slips(x, 0.0)[0] == 0
    noisy = x + 0.1 * np.random.default_rng(0).standard_normal(x.size)
    assert span(noisy).clipped == 0.0
    assert span(np.clip(noisy, 30.0, 50.0)).clipped > 0.5
    jump = np.concatenate([np.full(30, 5.0), 9.0 - 1.0 * 0.3 ** np.arange(30)])
    assert slips(jump, 0.01)[0] == 1


def test_the_command_line(tmp_path, good):
    write_recording(good, tmp_path / 'good.csv')
    write_recording(measured(UP), tmp_path / 'up.csv')
    signal = tmp_path / 'signal.csv'
    run = CliRunner().invoke
    result = run(main, ['doctor', str(tmp_path / 'up.csv'), '--signal', str(signal)])
    assert result.exit_code == 0, result.output
    assert 'record next' in result.output
    assert str(signal) in result.output
    written = np.genfromtxt(signal, delimiter=',', names=True)
    assert written['u'].min() == 10.0
    result = run(main, ['doctor', str(tmp_path / 'up.csv'), str(tmp_path / 'good.csv')])
    assert 'together:' in result.output
    assert 'f_d1: visible' in result.output.split('together:')[1]
    for bad in (['doctor'], ['doctor', str(tmp_path / 'none')]):
        assert run(main, bad).exit_code != 0


def test_a_bag_goes_to_the_doctor_as_it_is():
    path = Path(__file__).parents[1] / 'data' / 'gap.mcap.zstd'
    lines = examine(read_recording(path)).lines()
    assert any(line.startswith('gap: ') for line in lines)
